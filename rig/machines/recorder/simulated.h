/* A recorder without hardware, behind the firmware: simulated mechanics, and what may go wrong with them.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_SIMULATED_H
#define TQ_SIMULATED_H

#include "recorder.h"

#include "plant.h"

typedef struct {
    tq_plant plant;
    tq_number given[TQ_AXES], current_a[TQ_AXES];
    uint16_t counts[TQ_AXES];
    int button; /* the marks: 1 for one, 2 for the index */
    int motor_fails, mounted;
    double sum_force_n, sum_speed_mm_s; /* true ones, while it records */
    uint32_t recorded;
} tq_simulated;

static inline void tq_simulated_board(tq_board *board)
{
    board->most_a = 20;
}

static inline void tq_simulated_start(tq_simulated *s, uint16_t offset)
{
    (void)offset;
    memset(s, 0, sizeof *s);
    tq_plant_start(&s->plant, &tq_usual_parts);
}

static inline int tq_simulated_write(tq_simulated *s, int output, tq_number value)
{
    int fails = output == TQ_ARM && s->motor_fails;
    s->given[output] = value;
    s->current_a[output] = fails ? 0 : value;
    return fails;
}

static inline void tq_simulated_spoil(tq_simulated *s, int what)
{
    s->plant.stuck[TQ_TABLE] = what == TQD_SIMULATION_TABLE_STUCK;
    s->plant.stuck[TQ_ARM] = what == TQD_SIMULATION_ARM_STUCK;
    s->plant.parts.coupling_n_m = what == TQD_SIMULATION_SLIPPING ? 0.004 : tq_usual_parts.coupling_n_m;
    s->plant.parts.gap_m = what == TQD_SIMULATION_NO_SAMPLE ? 1 : tq_usual_parts.gap_m;
    s->motor_fails = what == TQD_SIMULATION_MOTOR;
}

static inline double tq_simulated_share(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (double)(*state >> 8) / 16777216.0;
}

/* Another sample at each start, at another angle: friction, stiffness and wobble are not those of the law. */
static inline void tq_simulated_mount(tq_simulated *s, uint32_t entropy)
{
    tq_plant *p = &s->plant;
    uint32_t state = entropy;
    (void)tq_simulated_share(&state);
    p->disc_rad = p->motor_rad = 6.283185307179586 * tq_simulated_share(&state);
    p->parts.friction = 0.1 + 0.4 * tq_simulated_share(&state);
    p->parts.contact_n_per_m = 4000 + 2000 * tq_simulated_share(&state);
    p->parts.wobble_m = 4e-5 * tq_simulated_share(&state);
    s->mounted = 1;
}

static inline void tq_simulated_before(tq_simulated *s, tq_device *d, int ticks)
{
    int what = d->simulate, index, mark;
    d->simulate = -1;
    if (!s->mounted)
        tq_simulated_mount(s, d->board.entropy);
    if (what == TQD_SIMULATION_BROWN_OUT) {
        tq_board board = d->board;
        board.entropy = board.entropy * 2654435761u + d->values.tick + 1;
        s->current_a[TQ_TABLE] = s->current_a[TQ_ARM] = 0;
        tq_device_start(d, &board);
    } else if (what >= 0) {
        tq_simulated_spoil(s, what);
    }
    for (; ticks; ticks--)
        tq_plant_tick(&s->plant, s->current_a, 1.0 / TQ_TICK_HZ);
    if (d->recorder.phase == TQ_RECORDS_NOW) {
        s->sum_force_n += s->plant.contact_n, s->recorded++;
        s->sum_speed_mm_s += s->plant.disc_rad_s * s->plant.parts.radius_m * 1e3;
        d->values.emerged[0] = (float)(s->sum_speed_mm_s / s->recorded);
        d->values.emerged[1] = (float)(s->sum_force_n / s->recorded);
    } else if (d->recorder.phase == TQ_LOWERS) {
        s->sum_force_n = s->sum_speed_mm_s = 0, s->recorded = 0;
    }
    memcpy(s->counts, s->plant.counter, sizeof s->counts);
    mark = tq_plant_mark(&s->plant, &index);
    s->button = mark | index << 1;
}

#endif
