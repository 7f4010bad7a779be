/* A board without a hand: a simulated one that strokes, the mechanics of mechanics.h, and what may go wrong
   with them. Simulated; the flag SIMULATED says so in every record.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_SIMULATED_H
#define TQ_SIMULATED_H

#include "device.h"
#include "mechanics.h"

/* The hand: stiffness and damping (its mass is in tool_kg); it strokes while a wall is shown and else rests. With
   the button down it goes on to the real surface. */
#define TQ_HAND_N_PER_MM ((tq_number)0.3)
#define TQ_HAND_N_S_PER_MM ((tq_number)0.0094)
#define TQ_LOWERS_MM_S 60 /* faster, and the motors overrun where it is stopped */
typedef struct {
    tq_mechanics mechanics;
    tq_number share, lower_mm; /* how far it has begun to stroke, and how far below the virtual surface */
    tq_number cosine, sine;    /* of the stroke's phase */
    tq_number hand_n;          /* on the hand, upwards */
    tq_number current_a[TQ_MOTORS], given[TQ_OUTPUTS]; /* what flows, and what was asked for */
    uint16_t counts[TQ_MOTORS], offset[TQ_MOTORS];
    int stuck, flipped, unplugged, motor_fails, button;
} tq_simulated;

/* What is not the same of every board. */
static inline void tq_simulated_board(tq_board *board)
{
    board->cables = tq_usual_cables(), board->cables.rewind_n = tq_usual_mechanics().rewind_n;
    board->most_g = (float)tq_usual_mechanics().converter_g;
}

static inline void tq_simulated_start(tq_simulated *s, uint16_t offset)
{
    const tq_mechanics_parts parts = tq_usual_mechanics();
    const tq_cables cables = tq_usual_cables();
    memset(s, 0, sizeof *s);
    tq_mechanics_start(&s->mechanics, &parts, &cables);
    s->cosine = 1;
    s->offset[0] = s->offset[1] = offset;
}

/* What a motor, or the vibrator's converter, is told. */
static inline int tq_simulated_write(tq_simulated *s, int output, tq_number value)
{
    s->given[output] = value;
    if (output == TQ_LEFT && s->motor_fails) {
        s->current_a[output] = 0;
        return 1;
    }
    if (output < TQ_MOTORS)
        s->current_a[output] = value;
    return 0;
}

/* How hard the hand pushes the tool along x and z: towards a place that strokes. */
static inline void tq_simulated_push(tq_simulated *s, const tq_device *d, tq_number push_n[2])
{
    const tqd_values *v = &d->values;
    const tq_cables *c = &d->board.cables;
    const tq_mechanics *m = &s->mechanics;
    const tq_number step_s = (tq_number)1 / TQ_TICK_HZ, most_mm = TQ_LOWERS_MM_S * step_s;
    int strokes = (v->state == TQ_RUNNING || v->state == TQ_RELEASING) && d->force.proven;
    tq_number turn = (tq_number)6.283185307179586 * (tq_number)v->stroke[1] * step_s;
    tq_number surface_mm = -50 - m->parts.surface_z_mm, goal_x, goal_z;
    /* At rest it bears what the pulleys' springs pull. */
    tq_number holds_n = -2 * m->parts.rewind_n * c->rest_z_mm / tq_cable_length(c, TQ_LEFT, 0, c->rest_z_mm);
    s->share += (strokes ? step_s : -step_s) * 2;
    s->share = s->share < 0 ? 0 : s->share > 1 ? 1 : s->share;
    s->lower_mm += s->button && s->share >= 1 ? most_mm : -most_mm; /* first to the virtual surface */
    s->lower_mm = s->lower_mm < 0 ? 0 : s->lower_mm > surface_mm ? surface_mm : s->lower_mm;
    s->cosine -= turn * s->sine, s->sine += turn * s->cosine; /* keeps its size */
    if (s->sine > 1 || s->sine < -1)
        s->sine = s->sine > 0 ? 1 : -1;
    goal_x = s->share * (tq_number)v->stroke[0] * s->sine;
    goal_z = TQ_REST_Z_MM + s->share * (-50 - TQ_REST_Z_MM - s->lower_mm - (tq_number)v->stroke[2]);
    push_n[0] = TQ_HAND_N_PER_MM * (goal_x - m->x_mm) - TQ_HAND_N_S_PER_MM * m->vx_mm_s;
    push_n[1] = TQ_HAND_N_PER_MM * (goal_z - m->z_mm) - TQ_HAND_N_S_PER_MM * m->vz_mm_s - holds_n;
    s->hand_n = -push_n[1];
}

/* One tick of hand and mechanics. */
static inline void tq_simulated_move(tq_simulated *s, const tq_device *d)
{
    tq_number push_n[2];
    tq_simulated_push(s, d, push_n);
    tq_mechanics_tick(&s->mechanics, &d->board.cables, s->current_a, push_n, s->given[TQ_VIBRATOR]);
}

/* Encoder counts of the motors, modulo 2^16, and what is wrong with them. */
static inline void tq_simulated_count(tq_simulated *s, const tq_cables *c)
{
    int n;
    for (n = 0; n < TQ_MOTORS; n++) {
        int32_t count = tq_mechanics_counted(&s->mechanics, c, n);
        if (n == TQ_LEFT && s->stuck)
            continue;
        s->counts[n] = (uint16_t)((s->flipped ? 0u - (uint32_t)count : (uint32_t)count) + s->offset[n]);
        if (s->unplugged)
            s->counts[n] = 0;
    }
}

/* What nobody but a simulated board knows. */
static inline void tq_simulated_emerge(const tq_simulated *s, tqd_values *v)
{
    const tq_mechanics *m = &s->mechanics;
    int n;
    v->emerged[0] = (float)m->x_mm, v->emerged[1] = (float)m->z_mm;
    for (n = 0; n < TQ_MOTORS; n++) {
        v->emerged[2 + n] = (float)m->tension_n[n];
        v->emerged[5 + n] = (float)m->slacks[n];
        v->emerged[7 + n] = (float)m->above_k[n];
    }
    v->emerged[4] = (float)s->hand_n;
    v->emerged[9] = (float)TQ_ROOT(m->square_g2);
}

/* What was asked to go wrong. */
static inline void tq_simulated_spoil(tq_simulated *s, int what)
{
    int n;
    s->stuck = what == TQD_SIMULATION_STUCK, s->unplugged = what == TQD_SIMULATION_UNPLUGGED;
    s->motor_fails = what == TQD_SIMULATION_MOTOR, s->button = what == TQD_SIMULATION_BUTTON;
    s->mechanics.cut[TQ_LEFT] = what == TQD_SIMULATION_SLACK;
    if (what == TQD_SIMULATION_JUMP)
        s->offset[TQ_LEFT] = (uint16_t)(s->offset[TQ_LEFT] + 326); /* 5 mm */
    if (what == TQD_SIMULATION_FLIPPED && !s->flipped)
        for (n = 0; n < TQ_MOTORS; n++) /* from where they are */
            s->offset[n] = (uint16_t)(2u * s->counts[n] - s->offset[n]);
    if (what == TQD_SIMULATION_FLIPPED)
        s->flipped = 1;
}

/* Before a tick of a simulated board: what was asked to go wrong, and where the hand is by now. */
static inline void tq_simulated_before(tq_simulated *s, tq_device *d, int ticks)
{
    int what = d->simulate;
    d->simulate = -1;
    if (what == TQD_SIMULATION_BROWN_OUT || what == TQD_SIMULATION_WRAPPED) {
        tq_board board = d->board;
        board.entropy = board.entropy * 2654435761u + d->values.tick + 1;
        tq_simulated_start(s, what == TQD_SIMULATION_WRAPPED ? 65436 : 0);
        tq_device_start(d, &board);
    } else if (what >= 0) {
        tq_simulated_spoil(s, what);
    }
    for (; ticks; ticks--)
        tq_simulated_move(s, d);
    tq_simulated_count(s, &d->board.cables);
    tq_simulated_emerge(s, &d->values);
}

#endif
