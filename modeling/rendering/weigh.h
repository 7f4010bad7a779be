/* Sections of second order in series, by which vibration is weighted for the exposure of the hand.

   C99 or C++17; in the reals of kernel.h.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_WEIGH_H
#define TQ_WEIGH_H

#ifndef TQ_KERNEL_H
#include "kernel.h"
#endif

#define TQ_WEIGHTS 4 /* sections at most */

typedef struct {
    tq_real section[TQ_WEIGHTS][5]; /* b0, b1, b2, a1, a2 */
    tq_real state[TQ_WEIGHTS][2];
    int count;
} tq_weighting;

/* A sample after the weighting (transposed direct form II); 0 without one. */
TQ_INLINE tq_real tq_weigh(tq_weighting *w, tq_real x)
{
    const tq_real least = (tq_real)1e-30; /* no numbers that are slow to compute with */
    int n;
    for (n = 0; n < w->count; n++) {
        const tq_real *c = w->section[n];
        tq_real *state = w->state[n], y = c[0] * x + state[0];
        state[0] = c[1] * x - c[3] * y + state[1];
        state[1] = c[2] * x - c[4] * y;
        if (state[0] < least && state[0] > -least)
            state[0] = 0;
        if (state[1] < least && state[1] > -least)
            state[1] = 0;
        x = y;
    }
    return w->count ? x : 0;
}

#endif
