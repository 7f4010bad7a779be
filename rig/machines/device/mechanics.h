/* Two motors, two cables that only pull, a tool, a real surface below and a vibrator on the tool: what the
   firmware's currents do, and what its encoders see of it. Simulated; docs/cable-device.md#simulated

   Lengths in mm, forces in N, masses in kg, times in s. x and z as in cables.h. C99, no library but one
   square root, so that it runs on the micro-controller that QEMU emulates, too.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_MECHANICS_H
#define TQ_MECHANICS_H

#include "cables.h"

#include <stdint.h>
#include <string.h>

#define TQ_SUBSTEPS 2 /* in a tick: the stiffest mode, tool against both motors, has 2000 rad/s */
#define TQ_MECHANICS_S ((tq_number)0.0002) /* of a tick */
#define TQ_RMS_S ((tq_number)0.1)

/* What it is made of: what the firmware knows of it (tq_cables) may be wrong. */
typedef struct {
    tq_number rotor_kg_m2, n_m_per_a, friction_n_m, viscous_n_m_s, most_a; /* of each motor */
    tq_number pulley_mm, rewind_n;      /* a spring on each pulley takes up its cable without a current */
    tq_number ohm, k_per_w, j_per_k;    /* of a winding */
    tq_number strain_n, cable_n_s_per_mm; /* a cable's force per strain (E A), and its damping */
    tq_number tool_kg, tool_n_s_per_mm; /* with the hand that holds it; of its guide */
    tq_number surface_z_mm, surface_n_per_mm, surface_n_s_per_mm, travel_mm, stop_n_per_mm;
    tq_number resonance_rad_s, quality; /* of the vibrator */
    tq_number converter_g, sensor_g, noise_g; /* largest drive; range and standard deviation of the sensor */
} tq_mechanics_parts;

typedef struct {
    tq_mechanics_parts parts;
    tq_number x_mm, z_mm, vx_mm_s, vz_mm_s; /* the tool, truly */
    tq_number rest_mm[TQ_MOTORS];
    tq_number paid_mm[TQ_MOTORS], paid_mm_s[TQ_MOTORS]; /* cable paid out since the rest */
    tq_number tension_n[TQ_MOTORS], above_k[TQ_MOTORS], surface_n;
    int cut[TQ_MOTORS], slack[TQ_MOTORS];
    uint32_t slacks[TQ_MOTORS]; /* how often each became slack */
    tq_number mass, mass_s;         /* the vibrator's moving mass: place and speed, in g s² and g s */
    tq_number vibration_g, square_g2; /* what a sensor on the tool reads; its mean square of late */
    uint32_t chance;
} tq_mechanics;

/* Where the values are from: docs/cable-device.md#simulated */
static inline tq_mechanics_parts tq_usual_mechanics(void)
{
    tq_mechanics_parts p;
    p.rotor_kg_m2 = (tq_number)7.28e-6, p.n_m_per_a = (tq_number)0.0273;
    p.friction_n_m = (tq_number)1e-3, p.viscous_n_m_s = (tq_number)1e-6, p.most_a = 10;
    p.pulley_mm = 10, p.rewind_n = (tq_number)0.3;
    p.ohm = (tq_number)0.6, p.k_per_w = 10, p.j_per_k = 20;
    p.strain_n = 45000, p.cable_n_s_per_mm = (tq_number)0.01;
    p.tool_kg = (tq_number)0.15, p.tool_n_s_per_mm = (tq_number)0.0005;
    p.surface_z_mm = -130, p.surface_n_per_mm = 1, p.surface_n_s_per_mm = (tq_number)0.002;
    p.travel_mm = 10, p.stop_n_per_mm = 50;
    p.resonance_rad_s = (tq_number)502.6548245743669, p.quality = 3; /* 80 Hz */
    p.converter_g = 20, p.sensor_g = 50, p.noise_g = (tq_number)0.005;
    return p;
}

/* At rest where it is homed, the cables just taut. */
static inline void tq_mechanics_start(tq_mechanics *m, const tq_mechanics_parts *parts, const tq_cables *c)
{
    int n;
    memset(m, 0, sizeof *m);
    m->parts = *parts;
    m->x_mm = c->rest_x_mm, m->z_mm = c->rest_z_mm, m->chance = 1;
    for (n = 0; n < TQ_MOTORS; n++)
        m->rest_mm[n] = tq_cable_length(c, n, m->x_mm, m->z_mm) - parts->rewind_n * 300 / parts->strain_n;
}

/* A speed after friction, which changes it by `most` at the most and never turns it round: so it sticks. */
static inline tq_number tq_mechanics_rubbed(tq_number speed, tq_number most)
{
    return speed > most ? speed - most : speed < -most ? speed + most : 0;
}

static inline tq_number tq_mechanics_tension(tq_mechanics *m, int n, tq_number length_mm, tq_number faster_mm_s)
{
    const tq_mechanics_parts *p = &m->parts;
    tq_number loose_mm = m->rest_mm[n] + m->paid_mm[n], stretch = length_mm - loose_mm, tension = 0;
    if (stretch > 0 && !m->cut[n])
        tension = p->strain_n * stretch / loose_mm + p->cable_n_s_per_mm * faster_mm_s;
    tension = tension > 0 ? tension : 0;
    m->slacks[n] += tension == 0 && !m->slack[n];
    m->slack[n] = tension == 0;
    return m->tension_n[n] = tension;
}

/* One motor under its current and its cable. */
static inline void tq_mechanics_turn(tq_mechanics *m, int n, tq_number current_a, tq_number step_s)
{
    const tq_mechanics_parts *p = &m->parts;
    tq_number lever = p->pulley_mm / 1000, kg = p->rotor_kg_m2 / (lever * lever);
    tq_number winds = p->n_m_per_a / lever * current_a + p->rewind_n;
    tq_number viscous = p->viscous_n_m_s / (lever * lever) / 1000 * m->paid_mm_s[n];
    m->paid_mm_s[n] += (m->tension_n[n] - winds - viscous) / kg * 1000 * step_s;
    m->paid_mm_s[n] = tq_mechanics_rubbed(m->paid_mm_s[n], p->friction_n_m / lever / kg * 1000 * step_s);
    if (m->paid_mm[n] < 1 - m->rest_mm[n] && m->paid_mm_s[n] < 0) /* a cut cable is all on its pulley */
        m->paid_mm_s[n] = 0;
}

/* The real surface: springs that end at a stop. */
static inline tq_number tq_mechanics_surface(const tq_mechanics *m)
{
    const tq_mechanics_parts *p = &m->parts;
    tq_number deep = p->surface_z_mm - m->z_mm, force;
    if (deep <= 0)
        return 0;
    force = p->surface_n_per_mm * deep - p->surface_n_s_per_mm * m->vz_mm_s;
    if (deep > p->travel_mm)
        force += p->stop_n_per_mm * (deep - p->travel_mm);
    return force > 0 ? force : 0;
}

static inline void tq_mechanics_drift(tq_mechanics *m, tq_number step_s)
{
    int n;
    m->x_mm += m->vx_mm_s * step_s, m->z_mm += m->vz_mm_s * step_s;
    for (n = 0; n < TQ_MOTORS; n++)
        m->paid_mm[n] += m->paid_mm_s[n] * step_s;
}

/* Half of the way, forces there, the other half: symplectic, and a current that is held for a tick acts half a
   tick late, on which the wall's stability rests. */
static inline void tq_mechanics_move(tq_mechanics *m, const tq_cables *c, const tq_number current_a[TQ_MOTORS],
                                     const tq_number push_n[2], tq_number step_s)
{
    const tq_mechanics_parts *p = &m->parts;
    tq_number fx = push_n[0] - p->tool_n_s_per_mm * m->vx_mm_s;
    tq_number fz = push_n[1] - p->tool_n_s_per_mm * m->vz_mm_s;
    int n;
    tq_mechanics_drift(m, step_s / 2);
    for (n = 0; n < TQ_MOTORS; n++) {
        tq_number length = tq_cable_length(c, n, m->x_mm, m->z_mm), tension, ux, uz;
        length = length > 1 ? length : 1;
        ux = (n == TQ_LEFT ? m->x_mm + c->half_mm : m->x_mm - c->half_mm) / length, uz = m->z_mm / length;
        tension = tq_mechanics_tension(m, n, length, ux * m->vx_mm_s + uz * m->vz_mm_s - m->paid_mm_s[n]);
        fx -= tension * ux, fz -= tension * uz;
        tq_mechanics_turn(m, n, current_a[n], step_s);
    }
    m->surface_n = tq_mechanics_surface(m);
    fz += m->surface_n;
    m->vx_mm_s += fx / p->tool_kg * 1000 * step_s, m->vz_mm_s += fz / p->tool_kg * 1000 * step_s;
    tq_mechanics_drift(m, step_s / 2);
}

/* The vibrator: H(s) = s²/(s² + s ω/Q + ω²) from the converter's drive to the acceleration, as
   stimuli/planted/vibrators.py has it, and what an accelerometer reads. */
static inline void tq_mechanics_vibrate(tq_mechanics *m, tq_number drive_g)
{
    const tq_mechanics_parts *p = &m->parts;
    tq_number drive = drive_g > p->converter_g ? p->converter_g : drive_g < -p->converter_g ? -p->converter_g : drive_g;
    const tq_number half_s = TQ_MECHANICS_S / 2;
    tq_number w = p->resonance_rad_s, damps = w / p->quality, g;
    int n, dice = 0;
    m->mass += m->mass_s * half_s;
    g = (drive - damps * m->mass_s - w * w * m->mass) / (1 + damps * half_s);
    m->mass_s += g * TQ_MECHANICS_S, m->mass += m->mass_s * half_s;
    for (n = 0; n < 4; n++) {
        m->chance = m->chance * 1664525u + 1013904223u;
        dice += (int)(m->chance >> 16) - 0x8000;
    }
    g += p->noise_g * (tq_number)dice / 37837; /* 2^16 by the square root of 3 */
    m->vibration_g = g > p->sensor_g ? p->sensor_g : g < -p->sensor_g ? -p->sensor_g : g;
    m->square_g2 += (m->vibration_g * m->vibration_g - m->square_g2) * (TQ_MECHANICS_S / TQ_RMS_S);
}

/* One tick: with these currents, the hand's push along x and z, and this drive of the vibrator. */
static inline void tq_mechanics_tick(tq_mechanics *m, const tq_cables *c, const tq_number current_a[TQ_MOTORS],
                                     const tq_number push_n[2], tq_number drive_g)
{
    const tq_mechanics_parts *p = &m->parts;
    tq_number flows_a[TQ_MOTORS];
    int n;
    for (n = 0; n < TQ_MOTORS; n++) {
        flows_a[n] = current_a[n] > p->most_a ? p->most_a : current_a[n] < -p->most_a ? -p->most_a : current_a[n];
        m->above_k[n] += (p->ohm * flows_a[n] * flows_a[n] - m->above_k[n] / p->k_per_w) / p->j_per_k * TQ_MECHANICS_S;
    }
    for (n = 0; n < TQ_SUBSTEPS; n++)
        tq_mechanics_move(m, c, flows_a, push_n, TQ_MECHANICS_S / TQ_SUBSTEPS);
    tq_mechanics_vibrate(m, drive_g);
}

/* What an encoder on a motor has counted since the rest. */
static inline int32_t tq_mechanics_counted(const tq_mechanics *m, const tq_cables *c, int n)
{
    tq_number exact = m->paid_mm[n] / c->mm_per_count;
    return tq_truncated(exact < 0 ? exact - (tq_number)0.5 : exact + (tq_number)0.5);
}

#endif
