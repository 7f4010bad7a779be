/* Rivals that play stored sounds: looped wavetables, and grains of recordings.

   A sound is a row of 16-bit integers, one for each node of the texture's grid; the table (of a texture
   without layers) holds what a sound's integers are multiplied by. The hand is given at each sample and
   read at each update, as by the kernel.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_SOUNDS_H
#define TQ_SOUNDS_H

#include "rivals.h"

/* --- Looped wavetables --------------------------------------------------------------------------- */

/* All loops are of one noise, shaped for each node. The four around the hand play in step, with bilinear
   weights that ramp from update to update: being in phase, they blend as their magnitudes do. All zeros,
   but for sounds and length, is silence at position 0. */
typedef struct {
    const int16_t *sounds; /* (nodes, length) */
    int length, since_update;
    uint64_t position;
    tq_real speed, force; /* on the grid, where the weights lead */
    int nodes[4];         /* around the hand */
    tq_real weight[4], step[4];
} tq_loops;

/* The cell that holds `at` on the side of `to`, which is moved to the cell's edge if it lies beyond:
   nothing jumps where the hand goes from cell to cell. */
TQ_INLINE int tq_cell_towards(const tq_real *axis, int size, tq_real at, tq_real *to, tq_real *share)
{
    int i = 0;
    while (i < size - 2 && (at > axis[i + 1] || (at == axis[i + 1] && *to > at)))
        i++;
    *to = tq_within(*to, axis[i], axis[i + 1]);
    *share = (*to - axis[i]) / (axis[i + 1] - axis[i]);
    return i;
}

/* The share of the level that is left below the grid's lowest speed or force; a hand that is not finite
   is lifted off. */
TQ_INLINE tq_real tq_level(const tq_texture *t, tq_real *speed, tq_real *force)
{
    const tq_real *v = t->speed_mm_s, *f = t->force_n;
    tq_real level = 1;
    if (!(*speed - *speed == 0 && *force - *force == 0))
        *speed = *force = 0;
    if (*speed < 0)
        *speed = -*speed;
    if (*speed < v[0])
        level = *speed / v[0];
    if (*force < f[0])
        level *= *force > 0 ? *force / f[0] : 0;
    *speed = tq_within(*speed, v[0], v[t->speeds - 1]);
    *force = tq_within(*force, f[0], f[t->forces - 1]);
    return level;
}

/* Weights that lead to those of the hand at the next update. */
TQ_INLINE void tq_loops_update(const tq_texture *t, tq_loops *s, tq_real speed, tq_real force)
{
    tq_real level = tq_level(t, &speed, &force), share = 1 / (tq_real)t->update_samples, x, y, low, now[4];
    int first = s->position == 0, nodes[4], k, old, i, j;
    i = tq_cell_towards(t->speed_mm_s, t->speeds, first ? speed : s->speed, &speed, &x);
    j = tq_cell_towards(t->force_n, t->forces, first ? force : s->force, &force, &y);
    s->speed = speed, s->force = force;
    low = 1 - y;
    for (k = 0; k < 4; k++)
        nodes[k] = (i + (k & 1)) * t->forces + j + (k >> 1);
    for (k = 0; k < 4; k++) {
        now[k] = 0;
        for (old = 0; old < 4; old++)
            if (!first && s->nodes[old] == nodes[k])
                now[k] = s->weight[old];
    }
    for (k = 0; k < 4; k++) {
        tq_real to = t->values[nodes[k]] * level * (k >> 1 ? y : low) * (k & 1 ? x : 1 - x);
        s->nodes[k] = nodes[k];
        s->weight[k] = first ? to : now[k];
        s->step[k] = first ? 0 : (to - now[k]) * share;
    }
}

/* The next `count` samples for a hand whose speed and force are given at each of them. */
static void tq_loops_render(const tq_texture *t, tq_loops *s, const tq_real *speed,
                            const tq_real *force, tq_real *out, size_t count)
{
    while (count) {
        int at = (int)(s->position % (uint64_t)s->length), piece = s->length - at, n, k;
        const int16_t *x[4];
        tq_real w0, w1, w2, w3;
        if (s->position == 0 || s->since_update == t->update_samples) {
            tq_loops_update(t, s, *speed, *force);
            s->since_update = 0;
        }
        if (piece > t->update_samples - s->since_update)
            piece = t->update_samples - s->since_update;
        if ((size_t)piece > count)
            piece = (int)count;
        for (k = 0; k < 4; k++)
            x[k] = s->sounds + (size_t)s->nodes[k] * (size_t)s->length + at;
        w0 = s->weight[0], w1 = s->weight[1], w2 = s->weight[2], w3 = s->weight[3];
        for (n = 0; n < piece; n++) {
            w0 += s->step[0], w1 += s->step[1], w2 += s->step[2], w3 += s->step[3];
            out[n] = (w0 * (tq_real)x[0][n] + w1 * (tq_real)x[1][n]) +
                     (w2 * (tq_real)x[2][n] + w3 * (tq_real)x[3][n]);
        }
        s->weight[0] = w0, s->weight[1] = w1, s->weight[2] = w2, s->weight[3] = w3;
        s->position += (uint64_t)piece;
        s->since_update += piece;
        speed += piece, force += piece, out += piece, count -= (size_t)piece;
    }
}

/* --- Grains of recordings ------------------------------------------------------------------------ */

/* What one grain plays: of each recording around the hand a piece from a random place, and its gain. */
typedef struct {
    const int16_t *from[4];
    tq_real gain[4];
} tq_grain;

/* Two grains overlap by half, each faded in and out by `window`, whose squares add up to 1 there. The
   pieces of a grain are independent, so their powers add up: gains are roots of bilinear weights. All
   zeros, but for sounds, length, grain and window, is silence at position 0; `drawn` is the seed. */
typedef struct {
    const int16_t *sounds;     /* (nodes, length) */
    const tq_real *window;     /* (grain) */
    int length, grain, into;   /* samples; of a grain an even number, less than the length */
    uint64_t drawn, position;
    tq_grain grains[2];        /* the one before, then the one that fades in */
} tq_grains;

/* A grain for the hand; places from a linear congruential generator (Knuth's MMIX). */
TQ_INLINE tq_grain tq_grain_of(const tq_texture *t, tq_grains *s, tq_real speed, tq_real force)
{
    tq_real level = tq_level(t, &speed, &force), x, y;
    int i = tq_cell(t->speed_mm_s, t->speeds, speed, &x);
    int j = tq_cell(t->force_n, t->forces, force, &y), k;
    tq_grain grain;
    for (k = 0; k < 4; k++) {
        size_t node = (size_t)((i + (k & 1)) * t->forces + j + (k >> 1));
        tq_real share = (k & 1 ? x : 1 - x) * (k >> 1 ? y : 1 - y);
        s->drawn = s->drawn * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
        grain.from[k] = s->sounds + node * (size_t)s->length +
                        (s->drawn >> 33) % (uint64_t)(s->length - s->grain + 1);
        grain.gain[k] = t->values[node] * level * TQ_SQRT(share);
    }
    return grain;
}

TQ_INLINE tq_real tq_played(const tq_grain *grain, int n)
{
    return (grain->gain[0] * (tq_real)grain->from[0][n] + grain->gain[1] * (tq_real)grain->from[1][n]) +
           (grain->gain[2] * (tq_real)grain->from[2][n] + grain->gain[3] * (tq_real)grain->from[3][n]);
}

/* The next `count` samples; the hand is read when a grain begins. */
static void tq_grains_render(const tq_texture *t, tq_grains *s, const tq_real *speed,
                             const tq_real *force, tq_real *out, size_t count)
{
    int half = s->grain / 2;
    while (count) {
        int piece, n;
        tq_grain before, now;
        if (s->position == 0 || s->into == half) {
            s->grains[0] = s->position ? s->grains[1] : tq_grain_of(t, s, *speed, *force);
            s->grains[1] = tq_grain_of(t, s, *speed, *force);
            s->into = 0;
        }
        piece = (size_t)(half - s->into) < count ? half - s->into : (int)count;
        before = s->grains[0], now = s->grains[1];
        for (n = 0; n < piece; n++) {
            int at = s->into + n;
            out[n] = s->window[half + at] * tq_played(&before, half + at) +
                     s->window[at] * tq_played(&now, at);
        }
        s->into += piece;
        s->position += (uint64_t)piece;
        speed += piece, force += piece, out += piece, count -= (size_t)piece;
    }
}

#endif
