/* Disturbance observer and reaction torque observer of one motor (Ohnishi et al. 1996). docs/recorder.md

   A motor of inertia J that is given the current i obeys J dω/dt = K i − τ_dis. With nominal J and K, and a
   low-pass of cut-off g (rad/s),

       τ_dis = g/(s + g) (K i + g J ω) − g J ω;

   the reaction torque is the same less friction and gravity, as far as they are known. The low-pass is
   advanced by the forward Euler rule: with real values J', K' the compensated loop is stable while
   α g T < 2, α = (J/J') (K'/K), and while α g T < 1 where the current comes one period late.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_OBSERVER_H
#define TQ_OBSERVER_H

#include "backend.h"

/* What is known of a motor and what it turns. */
typedef struct {
    tq_number step_s;          /* from one tick to the next */
    tq_number inertia_kg_m2, n_m_per_a;
    tq_number cut, reaction_cut; /* of both observers, rad/s */
    tq_number speed_cut;       /* of the low-pass on the speed, rad/s */
    tq_number friction_n_m;    /* Coulomb's, where it turns: */
    tq_number slow_rad_s;      /* below that it may stick, and nobody knows what it holds */
    tq_number viscous_n_m_s, gravity_n_m;
} tq_motor;

typedef struct {
    tq_number speed, current_a;    /* rad/s; both of the last tick */
    tq_number low, reaction_low;   /* of the low-passes */
    tq_number disturbance_n_m, reaction_n_m;
} tq_observer;

static inline tq_number tq_friction(const tq_motor *m, tq_number speed)
{
    tq_number coulomb = speed > m->slow_rad_s ? m->friction_n_m : speed < -m->slow_rad_s ? -m->friction_n_m : 0;
    return coulomb + m->viscous_n_m_s * speed;
}

/* One tick: the speed now, after `current_a` was given since the last tick. */
static inline void tq_observe(tq_observer *o, const tq_motor *m, tq_number current_a, tq_number speed)
{
    tq_number drive = m->n_m_per_a * current_a, known = tq_friction(m, o->speed) + m->gravity_n_m;
    tq_number momentum = m->inertia_kg_m2 * o->speed, now = m->inertia_kg_m2 * speed;
    o->low += m->cut * m->step_s * (drive + m->cut * momentum - o->low);
    o->reaction_low += m->reaction_cut * m->step_s * (drive - known + m->reaction_cut * momentum - o->reaction_low);
    o->disturbance_n_m = o->low - m->cut * now;
    o->reaction_n_m = o->reaction_low - m->reaction_cut * now;
    o->speed = speed, o->current_a = current_a;
}

/* The current for an acceleration (rad/s²), disturbances compensated. */
static inline tq_number tq_accelerating_a(const tq_observer *o, const tq_motor *m, tq_number acceleration)
{
    return (m->inertia_kg_m2 * acceleration + o->disturbance_n_m) / m->n_m_per_a;
}

#endif
