/* A board without a hand: a mass on a spring that strokes, cables that pull it, encoders that count, and
   what may go wrong with them. Simulated; the flag SIMULATED says so in every record.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_SIMULATED_H
#define TQ_SIMULATED_H

#include "device.h"

/* The hand: its mass, stiffness and damping; it strokes while a wall is shown and else rests. */
#define TQ_HAND_KG ((tq_number)0.15)
#define TQ_HAND_N_PER_MM ((tq_number)0.3)
#define TQ_HAND_N_S_PER_MM ((tq_number)0.0094)
typedef struct {
    tq_number x_mm, z_mm, vx_mm_s, vz_mm_s, share;
    tq_number cosine, sine; /* of the stroke's phase */
    tq_number current_a[TQ_MOTORS], converted;
    uint16_t counts[TQ_MOTORS], offset[TQ_MOTORS];
    int stuck, flipped, unplugged, motor_fails;
} tq_simulated;

static inline void tq_simulated_start(tq_simulated *s, uint16_t offset)
{
    memset(s, 0, sizeof *s);
    s->z_mm = TQ_REST_Z_MM, s->cosine = 1;
    s->offset[0] = s->offset[1] = offset;
}

/* What a motor, or the vibrator's converter, is told. */
static inline int tq_simulated_write(tq_simulated *s, int output, tq_number value)
{
    if (output == TQ_LEFT && s->motor_fails) {
        s->current_a[output] = 0;
        return 1;
    }
    if (output < TQ_MOTORS)
        s->current_a[output] = value;
    else
        s->converted = value;
    return 0;
}

/* The hand's movement in one tick. */
static inline void tq_simulated_move(tq_simulated *s, const tqd_values *v, const tq_cables *c)
{
    const tq_number step_s = (tq_number)1 / TQ_TICK_HZ;
    int strokes = v->state == TQ_RUNNING || v->state == TQ_RELEASING;
    tq_number turn = (tq_number)6.283185307179586 * (tq_number)v->stroke[1] * step_s;
    tq_number goal_x, goal_z, fx = 0, fz = 0;
    int n;
    s->share += (strokes ? step_s : -step_s) * 2;
    s->share = s->share < 0 ? 0 : s->share > 1 ? 1 : s->share;
    s->cosine -= turn * s->sine, s->sine += turn * s->cosine; /* keeps its size */
    if (s->sine > 1 || s->sine < -1)
        s->sine = s->sine > 0 ? 1 : -1;
    goal_x = s->share * (tq_number)v->stroke[0] * s->sine;
    goal_z = TQ_REST_Z_MM + s->share * (-50 - TQ_REST_Z_MM - (tq_number)v->stroke[2]);
    for (n = 0; n < TQ_MOTORS; n++) {
        tq_number along = n == TQ_LEFT ? s->x_mm + c->half_mm : s->x_mm - c->half_mm;
        tq_number pull = s->current_a[n] * c->n_per_a / tq_cable_length(c, n, s->x_mm, s->z_mm);
        fx -= pull * along, fz -= pull * s->z_mm;
    }
    fx += TQ_HAND_N_PER_MM * (goal_x - s->x_mm) - TQ_HAND_N_S_PER_MM * s->vx_mm_s;
    fz += TQ_HAND_N_PER_MM * (goal_z - s->z_mm) - TQ_HAND_N_S_PER_MM * s->vz_mm_s;
    s->vx_mm_s += fx / TQ_HAND_KG * 1000 * step_s, s->vz_mm_s += fz / TQ_HAND_KG * 1000 * step_s;
    s->x_mm += s->vx_mm_s * step_s, s->z_mm += s->vz_mm_s * step_s;
}

/* Encoder counts of where the hand is, modulo 2^16, and what is wrong with them. */
static inline void tq_simulated_count(tq_simulated *s, const tq_cables *c)
{
    int n;
    for (n = 0; n < TQ_MOTORS; n++) {
        tq_number longer = tq_cable_length(c, n, s->x_mm, s->z_mm)
                           - tq_cable_length(c, n, c->rest_x_mm, c->rest_z_mm);
        tq_number exact = longer / c->mm_per_count;
        int32_t count = (int32_t)(exact < 0 ? exact - (tq_number)0.5 : exact + (tq_number)0.5);
        if (n == TQ_LEFT && s->stuck)
            continue;
        s->counts[n] = (uint16_t)((uint32_t)(s->flipped ? -count : count) + s->offset[n]);
        if (s->unplugged)
            s->counts[n] = 0;
    }
}

/* What was asked to go wrong. */
static inline void tq_simulated_spoil(tq_simulated *s, int what)
{
    int n;
    s->stuck = what == TQD_SIMULATION_STUCK, s->unplugged = what == TQD_SIMULATION_UNPLUGGED;
    s->motor_fails = what == TQD_SIMULATION_MOTOR;
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
        tq_simulated_move(s, &d->values, &d->board.cables);
    tq_simulated_count(s, &d->board.cables);
}

#endif
