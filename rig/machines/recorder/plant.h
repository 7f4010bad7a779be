/* A recorder without hardware: two motors with friction and heat, a magnetic coupling, a contactor on a
   surface, quantised encoders, marks. Simulated; force, speed, hopping and slipping emerge from it, contact
   vibration does not (docs/recorder.md#what-is-simulated).

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_PLANT_H
#define TQ_PLANT_H

#include "control.h"

#include <math.h>

enum { TQ_SUBSTEPS = 4 };

/* What it is made of: what the law knows of it may be wrong. SI units. */
typedef struct {
    double table_kg_m2, disc_kg_m2, arm_kg_m2;  /* motor of the turntable, turntable, contactor with its motor */
    double n_m_per_a[TQ_AXES], friction_n_m[TQ_AXES], viscous_n_m_s[TQ_AXES], gravity_n_m;
    double coupling_n_m, poles, coupling_n_m_s; /* largest torque of the magnets, their pairs, damping */
    double counts[TQ_AXES], arm_m, radius_m;
    double contact_n_per_m, contact_n_s_per_m;  /* ball on sample */
    double gap_m, wobble_m, friction;           /* height of the lifted ball; of the sample once a turn; μ */
    double bearing_n_m;                         /* of the turntable */
    double ohm, k_per_w, j_per_k;               /* of a winding: its resistance and heat */
} tq_plant_parts;

/* The same as tactileq.rig.machines.recorder.virtual.RecorderParts. */
static const tq_plant_parts tq_usual_parts = {
    7.28e-6, 2.75e-4, 1.6e-5, { 0.0273, 0.0273 }, { 2e-3, 3e-4 }, { 1e-6, 1e-6 }, 0, 0.3, 4, 2e-3,
    { 4096, 4096 }, 0.03, 0.04, 5000, 5, 1.5e-3, 2e-5, 0.3, 2e-3, 1, 10, 20
};

typedef struct {
    tq_plant_parts parts;
    double motor_rad, disc_rad, arm_rad, motor_rad_s, disc_rad_s, arm_rad_s;
    double contact_n, above_k[TQ_AXES];
    uint32_t hops; /* how often the ball left the sample */
    int touches;   /* whether it is on it */
    int stuck[TQ_AXES]; /* whether an encoder stands still */
    uint16_t counter[TQ_AXES];
} tq_plant;

static inline void tq_plant_start(tq_plant *p, const tq_plant_parts *parts)
{
    memset(p, 0, sizeof *p);
    p->parts = *parts;
}

/* Coulomb's friction as a torque against the movement; at rest it holds what it can. */
static inline double tq_plant_friction(double coulomb, double viscous, double speed, double torque)
{
    const double slow = 1e-3; /* rad/s, below which it sticks */
    if (speed > slow)
        return coulomb + viscous * speed;
    if (speed < -slow)
        return -coulomb + viscous * speed;
    return torque > coulomb ? coulomb : torque < -coulomb ? -coulomb : torque + viscous * speed;
}

static inline void tq_plant_contact(tq_plant *p)
{
    const tq_plant_parts *q = &p->parts;
    double deep = q->arm_m * p->arm_rad - q->gap_m + q->wobble_m * sin(p->disc_rad);
    double faster = q->arm_m * p->arm_rad_s + q->wobble_m * cos(p->disc_rad) * p->disc_rad_s;
    double force = q->contact_n_per_m * deep + q->contact_n_s_per_m * faster;
    int touches = deep > 0 && force > 0;
    p->hops += (uint32_t)(p->touches && !touches);
    p->touches = touches;
    p->contact_n = touches ? force : 0;
}

static inline void tq_plant_move(tq_plant *p, const tq_number current_a[TQ_AXES], double step_s)
{
    const tq_plant_parts *q = &p->parts;
    double coupled = q->coupling_n_m * sin(q->poles * (p->motor_rad - p->disc_rad))
                     + q->coupling_n_m_s * (p->motor_rad_s - p->disc_rad_s);
    double drive = q->n_m_per_a[TQ_TABLE] * (double)current_a[TQ_TABLE] - coupled;
    double turned, pushed;
    tq_plant_contact(p);
    drive -= tq_plant_friction(q->friction_n_m[TQ_TABLE], q->viscous_n_m_s[TQ_TABLE], p->motor_rad_s, drive);
    turned = coupled;
    turned -= tq_plant_friction(q->bearing_n_m + q->friction * p->contact_n * q->radius_m, 0, p->disc_rad_s, turned);
    pushed = q->n_m_per_a[TQ_ARM] * (double)current_a[TQ_ARM] + q->gravity_n_m - p->contact_n * q->arm_m;
    pushed -= tq_plant_friction(q->friction_n_m[TQ_ARM], q->viscous_n_m_s[TQ_ARM], p->arm_rad_s, pushed);
    p->motor_rad_s += drive / q->table_kg_m2 * step_s, p->disc_rad_s += turned / q->disc_kg_m2 * step_s;
    p->arm_rad_s += pushed / q->arm_kg_m2 * step_s;
    p->motor_rad += p->motor_rad_s * step_s, p->disc_rad += p->disc_rad_s * step_s;
    p->arm_rad += p->arm_rad_s * step_s;
    if (p->arm_rad < 0) /* its stop, lifted */
        p->arm_rad = 0, p->arm_rad_s = p->arm_rad_s < 0 ? 0 : p->arm_rad_s;
}

/* A counter modulo 2^16 at so many counts; of a place that is no number 0. */
static inline uint16_t tq_plant_counter(double counts)
{
    double rest = fmod(floor(counts), 65536);
    return rest == rest ? (uint16_t)(int32_t)rest : 0;
}

/* One tick with these currents, and what the law reads then. */
static inline void tq_plant_tick(tq_plant *p, const tq_number current_a[TQ_AXES], double step_s)
{
    const double turn = 6.283185307179586;
    double at[TQ_AXES];
    int n;
    for (n = 0; n < TQ_SUBSTEPS; n++)
        tq_plant_move(p, current_a, step_s / TQ_SUBSTEPS);
    for (n = 0; n < TQ_AXES; n++) {
        double watt = p->parts.ohm * (double)current_a[n] * (double)current_a[n];
        p->above_k[n] += (watt - p->above_k[n] / p->parts.k_per_w) / p->parts.j_per_k * step_s;
    }
    at[TQ_TABLE] = p->motor_rad, at[TQ_ARM] = p->arm_rad;
    for (n = 0; n < TQ_AXES; n++)
        if (!p->stuck[n])
            p->counter[n] = tq_plant_counter(at[n] / turn * p->parts.counts[n]);
}

/* Whether a mark of the turntable is before its sensor, and whether it is the index. */
static inline int tq_plant_mark(const tq_plant *p, int *index)
{
    double turns = p->disc_rad / 6.283185307179586, marks = turns * TQ_MARKS;
    double within = marks - floor(marks);
    *index = within < 0.2 && fmod(floor(marks), TQ_MARKS) == 0;
    return within < 0.2;
}

/* One tick of both. */
static inline void tq_recorder_step(tq_recorder *r, tq_plant *p)
{
    int index, mark;
    tq_plant_tick(p, r->current_a, (double)r->limits.motor[TQ_ARM].step_s);
    mark = tq_plant_mark(p, &index);
    tq_recorder_tick(r, p->counter, mark, index);
}

/* So many ticks, whatever they are. */
static inline void tq_recorder_rest(tq_recorder *r, tq_plant *p, long ticks)
{
    for (; ticks > 0; ticks--)
        tq_recorder_step(r, p);
}

/* Both together for so many ticks, at most until the record is done or failed; how many. `trace`, if any,
   takes the true force (N) and speed of the ball (mm/s) and both estimates, once in `every` ticks. */
static long tq_recorder_run(tq_recorder *r, tq_plant *p, long ticks, double *trace, long every)
{
    long n;
    for (n = 0; n < ticks && r->phase != TQ_RECORDED && r->phase != TQ_FAILS; n++) {
        tq_recorder_step(r, p);
        if (trace && n % every == 0) {
            double *row = trace + 5 * (n / every);
            row[0] = p->contact_n, row[1] = p->disc_rad_s * p->parts.radius_m * 1e3;
            row[2] = (double)tq_recorder_force(r), row[3] = (double)tq_recorder_speed(r);
            row[4] = r->phase;
        }
    }
    return n;
}

#endif
