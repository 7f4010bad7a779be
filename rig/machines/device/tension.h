/* What a cable carries, by the reaction torque observer of its motor: whether it is slack.
   docs/cable-device.md#what-is-simulated-and-what-is-not

   C99, no library.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_TENSION_H
#define TQ_TENSION_H

#include "cables.h"
#include "observer.h"

#include <limits.h>
#include <stdint.h>

/* The observer's motor in kg, N/A, N and m/s at the cable; the spring on the pulley helps, like gravity. One count
   of an encoder is 0.04 N at 200 rad/s. */
static inline tq_motor tq_cable_motor(const tq_cables *c, tq_number step_s)
{
    static const tq_motor none;
    tq_motor m = none;
    m.step_s = step_s, m.inertia_kg_m2 = c->motor_kg, m.n_m_per_a = c->n_per_a, m.gravity_n_m = -c->rewind_n;
    m.reaction_cut = m.speed_cut = 200;
    return m;
}

/* Of one cable: speed at which it is wound, current, and tension that it is to have, low-passed alike. */
typedef struct {
    tq_observer observer;
    tq_number speed_m_s, current_a, told_n;
    int32_t counted;
    int begun, slack; /* for how many readings it has carried too little */
} tq_felt;

/* One reading: a cable is slack that carries less than half of what it is to pull with; it is cut, or the tool is
   lifted faster than the motor winds. Command and estimate pass the same low-passes, so that a step of the
   command is no slackness. `m_s_per_count` is the speed of one count longer in a reading. */
static inline void tq_feel(tq_felt *f, const tq_motor *m, tq_number current_a, int32_t counted, tq_number m_s_per_count)
{
    const tq_number share = m->speed_cut * m->step_s;
    if (f->begun) {
        f->speed_m_s += share * ((tq_number)tq_counts_since(f->counted, counted) * m_s_per_count - f->speed_m_s);
        f->current_a += share * (current_a - f->current_a);
        tq_observe(&f->observer, m, f->current_a, f->speed_m_s);
        f->told_n += m->reaction_cut * m->step_s * (f->current_a * m->n_m_per_a - m->gravity_n_m - f->told_n);
        f->slack = f->told_n >= (tq_number)0.2 && f->observer.reaction_n_m < f->told_n / 2 ? f->slack + (f->slack < INT_MAX) : 0;
    }
    f->begun = 1, f->counted = counted;
}

#endif
