/* Two motors that pull one tool by two cables: where it is, and what pulls it up. docs/device.md#geometry

   The motors stand at (-a, 0) and (a, 0), z points upwards: the tool hangs below them. C99, no library but
   one square root.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_CABLES_H
#define TQ_CABLES_H

#include "backend.h"

enum { TQ_LEFT, TQ_RIGHT, TQ_MOTORS };

typedef struct {
    tq_number half_mm;                 /* a */
    tq_number mm_per_count;            /* of cable; positive where a longer cable counts up */
    tq_number n_per_a;                 /* tension by current: the motor's constant over its pulley's radius */
    tq_number nominal_a;               /* what a motor bears for ever */
    tq_number rewind_n;                /* of the spring on each pulley, without a current */
    tq_number motor_kg;                /* its rotor's inertia over the square of its pulley's radius */
    tq_number rest_x_mm, rest_z_mm;    /* where the tool stands when it is at home */
    tq_number damping_n_s_per_mm;      /* viscous, of the device itself */
} tq_cables;

#define TQ_REST_Z_MM (-30)

/* Motors of 27.3 mN m/A, 72.8 g cm² and 4.12 A at 300 mm from the middle, encoders of 4096 counts on pulleys of 10 mm;
   half distance, counts, pulleys, rest and damping are assumed. Without springs, which the paper does not name. */
static inline tq_cables tq_usual_cables(void)
{
    tq_cables c;
    c.half_mm = 300, c.mm_per_count = (tq_number)0.015339808, c.n_per_a = (tq_number)2.73;
    c.rewind_n = 0, c.motor_kg = (tq_number)0.0728;
    c.nominal_a = (tq_number)4.12, c.rest_x_mm = 0, c.rest_z_mm = TQ_REST_Z_MM;
    c.damping_n_s_per_mm = (tq_number)0.0005;
    return c;
}

/* Length of one cable for a tool at (x, z). */
static inline tq_number tq_cable_length(const tq_cables *c, int motor, tq_number x_mm, tq_number z_mm)
{
    tq_number along = motor == TQ_LEFT ? x_mm + c->half_mm : x_mm - c->half_mm;
    return TQ_ROOT(along * along + z_mm * z_mm);
}

/* Where the tool is for these lengths; 0 where no tool can be. */
static inline int tq_cables_place(const tq_cables *c, const tq_number length_mm[TQ_MOTORS],
                                  tq_number *x_mm, tq_number *z_mm)
{
    tq_number l1 = length_mm[TQ_LEFT], l2 = length_mm[TQ_RIGHT], a = c->half_mm, x, square;
    x = (l1 - l2) * (l1 + l2) / (4 * a);
    square = (l1 - (x + a)) * (l1 + (x + a));
    if (!(square >= 1)) /* at the motors' height, or not a number */
        return 0;
    *x_mm = x, *z_mm = -TQ_ROOT(square);
    return 1;
}

/* Tensions that pull straight up with this force; both are above 0 between the motors. */
static inline void tq_cables_tensions(const tq_cables *c, const tq_number length_mm[TQ_MOTORS],
                                      tq_number x_mm, tq_number z_mm, tq_number force_n,
                                      tq_number tension_n[TQ_MOTORS])
{
    tq_number share = force_n / (-2 * c->half_mm * z_mm);
    tension_n[TQ_LEFT] = share * length_mm[TQ_LEFT] * (c->half_mm - x_mm);
    tension_n[TQ_RIGHT] = share * length_mm[TQ_RIGHT] * (c->half_mm + x_mm);
}

#endif
