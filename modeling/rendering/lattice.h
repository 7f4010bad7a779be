/* All-pole (autoregressive) models in real time: a normalised lattice.
   docs/method/rendering.md#ar-models

   A lattice is a tq_texture without layers, whose only values are the gains over the grid: so the hand, the
   ramp of the gain, interpolation, compensation, limits and counters are those of kernel.h. The rest of the
   filter is in a tq_lattice.

   Every stage rotates (its input, its state) by an angle, so all states keep unit variance however the
   parameters move, and a jump of them cannot make the filter grow (Gray and Markel 1975).

   C99 or C++17, as kernel.h, whose lines on compiling and whose macros hold here, too. No allocation, no
   lock, no system call, and no library call but those of kernel.h. Meant for double precision: in single
   precision narrow peaks of high orders are lost.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_LATTICE_H
#define TQ_LATTICE_H

#include "kernel.h"

/* The filter: constant while playing. The texture beside it has no layers. */
typedef struct {
    int order;                  /* at least 1 */
    const tq_real *frequencies; /* (speeds, forces, order): line spectral ones, rising in (0, pi) */
} tq_lattice;

typedef struct {
    tq_real rms;      /* of the filter of gain 1 */
    tq_real *cosines; /* (4 order + 8): cos(pi n / (2 order + 4)) */
    tq_real *symmetric, *antisymmetric; /* (order + 3) each */
    tq_real *sine, *cosine, *held;      /* (order) each: angles and states of the stages */
} tq_lattice_state;

/* --- Coefficients ------------------------------------------------------------------------------ */

/* cos(angle), 0 <= angle <= pi, to 1e-15: minus the sine's series about pi / 2. */
TQ_INLINE tq_real tq_cosine(tq_real angle)
{
    tq_real x = angle - (tq_real)1.5707963267948966, z = x * x;
    tq_real high = (tq_real)1.6059043836821613e-10 +
                   z * ((tq_real)-7.647163731819816e-13 +
                        z * ((tq_real)2.8114572543455206e-15 - z * (tq_real)8.22063524662433e-18));
    tq_real low = (tq_real)2.7557319223985893e-6 + z * ((tq_real)-2.505210838544172e-8 + z * high);
    low = (tq_real)8.333333333333333e-3 + z * ((tq_real)-1.984126984126984e-4 + z * low);
    return -x * (1 + z * ((tq_real)-0.16666666666666666 + z * low));
}

/* Half of A's symmetric and of its antisymmetric part at `order` + 3 angles from 0 to pi, but for a common
   delay: the line spectral frequencies, in turn, are the zeros of both. */
TQ_INLINE void tq_lattice_response(const tq_lattice *l, tq_lattice_state *f, const tq_real *middle)
{
    int p = l->order, points = 2 * (p + 2), i, j;
    for (j = 0; j <= p + 2; j++) {
        tq_real part[2] = {1, 1}, at = f->cosines[2 * j];
        for (i = 0; i < p; i++)
            part[i % 2] *= 2 * (at - middle[i]);
        if (p % 2) {
            f->symmetric[j] = part[0] * (tq_real)0.5;
            f->antisymmetric[j] = part[1] * f->cosines[(2 * j + 3 * (p + 2)) % (2 * points)]; /* sine */
        } else {
            f->symmetric[j] = part[0] * f->cosines[j];
            f->antisymmetric[j] = part[1] * f->cosines[(j + 3 * (p + 2)) % (2 * points)];
        }
    }
}

/* Coefficients a1 ... ap of A, into `sine`: the inverse transform of both parts. On the circle no
   polynomial is multiplied out, which would lose digits at high orders. */
TQ_INLINE void tq_lattice_predictor(const tq_lattice *l, tq_lattice_state *f)
{
    int p = l->order, points = 2 * (p + 2), whole = 2 * points, j, k;
    for (k = 1; k <= (p + 1) / 2; k++) {
        tq_real even = 0, odd = 0;
        int turn = p + 1 - 2 * k, n = 0; /* n = turn j, of `whole` a turn */
        for (j = 0; j <= p + 2; j++, n = (n + turn) % whole) {
            tq_real weight = j == 0 || j == p + 2 ? 1 : 2;
            even += weight * f->symmetric[j] * f->cosines[n];
            odd += weight * f->antisymmetric[j] * f->cosines[(n + 3 * (p + 2)) % whole];
        }
        f->sine[k - 1] = (even + odd) / (tq_real)points;
        f->sine[p - k] = (even - odd) / (tq_real)points;
    }
}

/* Sines and cosines of the stages' angles, of which the sines are the reflection coefficients, by the
   step-down recursion; and the RMS that the filter has at a gain of 1. */
TQ_INLINE void tq_lattice_angles(const tq_lattice *l, tq_lattice_state *f)
{
    const tq_real highest = (tq_real)(1 - 1e-12); /* rounding must not put a pole on the unit circle */
    tq_real *a = f->sine, all = 1;
    int m, i;
    for (m = l->order - 1; m > 0; m--) {
        tq_real last = a[m], scale = 1 / (1 - last * last);
        for (i = 0; i <= m - 1 - i; i++) {
            tq_real low = a[i], high = a[m - 1 - i];
            a[i] = (low - last * high) * scale;
            a[m - 1 - i] = (high - last * low) * scale;
        }
    }
    for (i = 0; i < l->order; i++) {
        a[i] = a[i] == a[i] ? tq_within(a[i], -highest, highest) : 0;
        f->cosine[i] = TQ_SQRT((1 - a[i]) * (1 + a[i]));
        all *= f->cosine[i];
    }
    f->rms = 1 / all;
}

/* The angles for the hand in the middle of the time to the next update, and the ramp of the gain. */
TQ_INLINE void tq_lattice_update(const tq_texture *t, const tq_lattice *l, tq_state *s,
                                 tq_lattice_state *f)
{
    tq_hand amid, end, row;
    int i;
    tq_follow(t, s, &amid, &end);
    tq_update_floor(t, s, &end);
    row = amid;
    for (i = 0; i < 4; i++) /* of a node the texture has one value, its gain */
        row.corner[i] = l->frequencies + (size_t)(amid.corner[i] - t->values) * (size_t)l->order;
    for (i = 0; i < l->order; i++)
        f->cosine[i] = tq_cosine(tq_blend(&row, i));
    tq_lattice_response(l, f, f->cosine);
    tq_lattice_predictor(l, f);
    tq_lattice_angles(l, f);
}

/* --- Filtering --------------------------------------------------------------------------------- */

/* The next sample at the model's rate. */
TQ_INLINE tq_real tq_lattice_sample(const tq_lattice *l, tq_state *s, tq_lattice_state *f)
{
    tq_real forward = tq_noise(s->key, s->position), *held = f->held;
    int i = l->order - 1;
    for (; i >= 0; i--) {
        tq_real backward = f->sine[i] * forward + f->cosine[i] * held[i];
        forward = f->cosine[i] * forward - f->sine[i] * held[i];
        if (i + 1 < l->order)
            held[i + 1] = backward;
    }
    held[0] = forward;
    s->floor_now += s->floor_step;
    s->position++, s->since_update++;
    return s->floor_now * f->rms * forward;
}

/* The next `samples` at the model's rate, for `count` of the output; `hand` is speed and force, NULL as last
   read. */
TQ_INLINE void tq_lattice_model(const tq_texture *t, const tq_lattice *l, tq_state *s,
                                tq_lattice_state *f, const tq_real *hand, tq_real *out, int samples,
                                size_t count)
{
    size_t counted = 0;
    int n;
    for (n = 0; n < samples; n++) {
        if (s->position == 0 || s->since_update == t->update_samples) {
            size_t now = tq_outputs_before(t, s->phase, n);
            tq_count_hand(s, hand != NULL, now - counted);
            counted = now;
            if (hand)
                tq_take_in(t, s, 0, hand[0], hand[1]);
            tq_lattice_update(t, l, s, f);
            s->since_update = 0;
        }
        out[n] = tq_lattice_sample(l, s, f);
    }
    tq_count_hand(s, hand != NULL, count - counted);
}

/* --- The calls --------------------------------------------------------------------------------- */

/* How many reals of memory a lattice needs, that of its texture included. */
static inline size_t tq_lattice_memory(const tq_texture *t, const tq_lattice *l)
{
    return (size_t)(TQ_MEMORY(0, t->up) + 9 * l->order + 14);
}

/* Silence at position 0 of a noise stream. `memory` holds tq_lattice_memory reals and must live as long as
   the states. */
static inline void tq_lattice_start(const tq_texture *t, const tq_lattice *l, tq_state *s,
                                    tq_lattice_state *f, tq_real *memory, uint64_t key)
{
    int p = l->order, half = 2 * (p + 2), n;
    tq_start(t, s, memory, key);
    TQ_FILL(f, 0, sizeof *f);
    f->cosines = memory + TQ_MEMORY(0, t->up);
    f->symmetric = f->cosines + 2 * half, f->antisymmetric = f->symmetric + p + 3;
    f->sine = f->antisymmetric + p + 3, f->cosine = f->sine + p, f->held = f->cosine + p;
    for (n = 0; n < p; n++)
        f->held[n] = 0;
    for (n = 0; n <= half; n++) {
        f->cosines[n] = tq_cosine((tq_real)3.141592653589793 * (tq_real)n / (tq_real)half);
        f->cosines[(2 * half - n) % (2 * half)] = f->cosines[n];
    }
}

/* The next `count` samples, for a hand as of tq_lattice_model. */
TQ_INLINE void tq_lattice_render_by(const tq_texture *t, const tq_lattice *l, tq_state *s,
                                    tq_lattice_state *f, const tq_real *hand, tq_real *out, size_t count)
{
    while (count) {
        size_t most = tq_outputs_before(t, s->phase, TQ_CHUNK), chunk = count < most ? count : most;
        tq_real *made = t->up ? tq_past(t, s) + TQ_DOUBLING - 1 : out;
        int samples = tq_samples_for(t, s->phase, chunk);
        if (hand)
            s->counters.lift_offs += tq_lift_offs(hand, hand + 1, 0, (int)chunk);
        tq_lattice_model(t, l, s, f, hand, made, samples, chunk);
        if (t->up)
            tq_interpolate(t, s, samples, out, chunk);
        tq_restrain(t, s, out, (int)chunk);
        out += chunk, count -= chunk;
    }
}

/* The next `count` samples, for a hand whose speed and force are held. */
static inline void tq_lattice_render_held(const tq_texture *t, const tq_lattice *l, tq_state *s,
                                          tq_lattice_state *f, tq_real speed, tq_real force,
                                          tq_real *out, size_t count)
{
    tq_real hand[2];
    hand[0] = speed, hand[1] = force;
    tq_lattice_render_by(t, l, s, f, hand, out, count);
}

/* The next `count` samples, for the hand as it was read by tq_read. */
static inline void tq_lattice_render_on(const tq_texture *t, const tq_lattice *l, tq_state *s,
                                        tq_lattice_state *f, tq_real *out, size_t count)
{
    tq_lattice_render_by(t, l, s, f, NULL, out, count);
}

#endif
