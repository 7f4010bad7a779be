/* What the render bench compares the kernel with, in equally good C.

   The same noise, the same interpolation of the grid, updates every `update_samples`, chunks of
   TQ_CHUNK samples and compiler flags as the kernel; but none of its safety: no value is moved into
   a legal range, no gain glides, nothing is limited, the rate is the model's own.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_RIVALS_H
#define TQ_RIVALS_H

#include "kernel.h"

#ifndef TQ_FLAGS
#define TQ_FLAGS "flags unknown"
#endif

#define TQ_MOST_ORDER 40 /* poles or zeros of the filter by its coefficients */

/* The rivals. */
enum { TQ_DIRECT, TQ_TRANSPOSED, TQ_TPT, TQ_COEFFICIENTS, TQ_BANDS };

/* Lanes that run side by side. */
enum { TQ_GROUPS = TQ_SIDE_BY_SIDE / TQ_LANES };

/* The state of any rival; all zeros, but for kind, key and numbers of poles (4 at least) and zeros of the
   filter by its coefficients, is silence at position 0. */
typedef struct {
    int kind, poles, zeros, since_update;
    uint64_t key, position;
    tq_real floor;       /* the noise gain now; the gain of the filter by its coefficients */
    tq_real before[2];   /* the last two samples of noise */
    tq_real rows[6][40]; /* filter states and coefficients, one value per layer or lag */
} tq_rival;

typedef void tq_rival_layers(tq_rival *s, int first, int width, const tq_real *w, tq_real *out,
                             int count);

/* As the kernel does: the noise branch, then four layers side by side, then the rest. */
TQ_INLINE void tq_all_layers(const tq_texture *t, tq_rival *s, const tq_real *w, tq_real *out,
                                 int count, tq_rival_layers *layers)
{
    int i = 0, n;
    for (n = 0; n < count; n++)
        out[n] = s->floor * w[n];
    for (; i + TQ_SIDE_BY_SIDE <= t->layers; i += TQ_SIDE_BY_SIDE)
        layers(s, i, TQ_SIDE_BY_SIDE, w, out, count);
    switch (t->layers - i) { /* a constant width lets the compiler unroll */
    case 3: layers(s, i, 3, w, out, count); break;
    case 2: layers(s, i, 2, w, out, count); break;
    case 1: layers(s, i, 1, w, out, count); break;
    default: break;
    }
}

/* As tq_blend does; an index that cannot wrap lets the compiler take layers together. */
TQ_INLINE tq_real tq_blend_at(const tq_hand *hand, size_t i)
{
    tq_real low = hand->corner[0][i] * (1 - hand->x) + hand->corner[1][i] * hand->x;
    tq_real high = hand->corner[2][i] * (1 - hand->x) + hand->corner[3][i] * hand->x;
    return low * (1 - hand->y) + high * hand->y;
}

/* tan(angle / 2) = numerator / denominator, by the kernel's formula. */
TQ_INLINE void tq_tangent_parts(tq_real angle, tq_real *numerator, tq_real *denominator)
{
    tq_real half = angle * (tq_real)0.5, z = half * half;
    *numerator = TQ_TANGENT_NUMERATOR(half, z);
    *denominator = TQ_TANGENT_DENOMINATOR(z);
}

/* --- Direct form ------------------------------------------------------------------------------- */

/* y = b (x - x'') - a1 y' - a2 y''. With k = tan(pi B / rate): b = k / (1 + k),
   a1 = -2 cos(2 pi f / rate) / (1 + k), a2 = (1 - k) / (1 + k); the gain is part of b. */
enum { TQ_Y1, TQ_Y2, TQ_A1, TQ_A2, TQ_B };

TQ_INLINE void tq_direct_update(const tq_texture *t, tq_rival *TQ_RESTRICT s, const tq_hand *hand)
{
    size_t m = (size_t)t->layers, i;
    tq_real angle = (tq_real)3.141592653589793 / t->rate_hz;
    s->floor = tq_blend(hand, 0) * hand->ramp;
    for (i = 0; i < m; i++) {
        tq_real n, d, k_n, k_d, whole, cosine, scale;
        tq_tangent_parts(angle * tq_blend_at(hand, 1 + i), &n, &d);
        whole = d * d + n * n;
        cosine = (d - n) * (d + n); /* cos(pi f / rate) = cosine / whole */
        tq_tangent_parts(angle * tq_blend_at(hand, 1 + m + i), &n, &d);
        k_n = 2 * n * d;
        k_d = (d - n) * (d + n); /* k = k_n / k_d */
        scale = 1 / (whole * (k_d + k_n)); /* one division serves both */
        cosine *= scale * (k_d + k_n);
        scale *= whole;
        s->rows[TQ_A1][i] = (2 - 4 * cosine * cosine) * k_d * scale;
        s->rows[TQ_A2][i] = (k_d - k_n) * scale;
        s->rows[TQ_B][i] = k_n * scale * tq_blend_at(hand, 1 + 2 * m + i) * hand->ramp;
    }
}

/* Form I: one x - x'' serves all bands, which makes it the cheapest; two layers at a time it is no faster. */
TQ_INLINE void tq_direct_layers(tq_rival *s, int first, int width, const tq_real *w,
                                    tq_real *out, int count)
{
    tq_real y1[TQ_SIDE_BY_SIDE], y2[TQ_SIDE_BY_SIDE];
    tq_real a1[TQ_SIDE_BY_SIDE], a2[TQ_SIDE_BY_SIDE], b[TQ_SIDE_BY_SIDE];
    int n, i;
    for (i = 0; i < width; i++) {
        y1[i] = s->rows[TQ_Y1][first + i], y2[i] = s->rows[TQ_Y2][first + i];
        a1[i] = s->rows[TQ_A1][first + i], a2[i] = s->rows[TQ_A2][first + i];
        b[i] = s->rows[TQ_B][first + i];
    }
    for (n = 0; n < count; n++) {
        tq_real x = w[n] - w[n - 2], sum = out[n];
        for (i = 0; i < width; i++) {
            tq_real y = b[i] * x - a2[i] * y2[i] - a1[i] * y1[i];
            y2[i] = y1[i];
            y1[i] = y;
        }
        for (i = 0; i < width; i++)
            sum += y1[i];
        out[n] = sum;
    }
    for (i = 0; i < width; i++)
        s->rows[TQ_Y1][first + i] = y1[i], s->rows[TQ_Y2][first + i] = y2[i];
}

/* The same coefficients, read from the table: noise gain, all a1, all a2, all b. */
TQ_INLINE void tq_bands_update(const tq_texture *t, tq_rival *TQ_RESTRICT s, const tq_hand *hand)
{
    size_t m = (size_t)t->layers, i;
    s->floor = tq_blend(hand, 0) * hand->ramp;
    for (i = 0; i < m; i++) {
        s->rows[TQ_A1][i] = tq_blend_at(hand, 1 + i);
        s->rows[TQ_A2][i] = tq_blend_at(hand, 1 + m + i);
        s->rows[TQ_B][i] = tq_blend_at(hand, 1 + 2 * m + i) * hand->ramp;
    }
}

/* The transposed form II, as scipy.signal.sosfilt has it. */
TQ_INLINE void tq_transposed_layers(tq_rival *s, int first, int width, const tq_real *w,
                                    tq_real *out, int count)
{
    tq_lanes z1[TQ_GROUPS], z2[TQ_GROUPS], a1[TQ_GROUPS], a2[TQ_GROUPS], b[TQ_GROUPS];
    int groups = (width + TQ_LANES - 1) / TQ_LANES, n, i;
    for (i = 0; i < groups; i++) {
        int at = first + i * TQ_LANES;
        z1[i] = tq_load(s->rows[TQ_Y1] + at), z2[i] = tq_load(s->rows[TQ_Y2] + at);
        a1[i] = tq_load(s->rows[TQ_A1] + at), a2[i] = tq_load(s->rows[TQ_A2] + at);
        b[i] = tq_load(s->rows[TQ_B] + at);
    }
    for (n = 0; n < count; n++) {
        tq_real x = w[n], sum = out[n], band[TQ_SIDE_BY_SIDE];
        for (i = 0; i < groups; i++) {
            tq_lanes fed = b[i] * x, y = fed + z1[i];
            z1[i] = z2[i] - a1[i] * y;
            z2[i] = -fed - a2[i] * y;
            tq_store(band + i * TQ_LANES, y);
        }
        for (i = 0; i < width; i++)
            sum += band[i];
        out[n] = sum;
    }
    for (i = 0; i < groups; i++) {
        int at = first + i * TQ_LANES;
        tq_store(s->rows[TQ_Y1] + at, z1[i]), tq_store(s->rows[TQ_Y2] + at, z2[i]);
    }
}

/* --- Topology-preserving state-variable filter ------------------------------------------------- */

/* Zavalishin's trapezoidal integrators as Simper solves them: with g = tan(pi f / rate),
   K = k (1 + g^2) / g, a1 = 1 / (1 + g (g + K)), a2 = g a1, a3 = g a2 and e = x - s2,
   s1' = (2 a1 - 1) s1 + 2 a2 e, s2' = s2 + 2 a2 s1 + 2 a3 e, band = K (s1 + s1') / 2. */
enum { TQ_T1, TQ_T2, TQ_TURN, TQ_CROSS, TQ_FEED, TQ_TAP };

TQ_INLINE void tq_tpt_update(const tq_texture *t, tq_rival *TQ_RESTRICT s, const tq_hand *hand)
{
    size_t m = (size_t)t->layers, i;
    tq_real angle = (tq_real)3.141592653589793 / t->rate_hz;
    s->floor = tq_blend(hand, 0) * hand->ramp;
    for (i = 0; i < m; i++) {
        tq_real n, d, k_n, k_d, scale, cosine, sine, share;
        tq_tangent_parts(angle * tq_blend_at(hand, 1 + i), &n, &d);
        scale = 1 / (d * d + n * n);
        cosine = (d - n) * (d + n) * scale;
        sine = 2 * n * d * scale;
        tq_tangent_parts(angle * tq_blend_at(hand, 1 + m + i), &n, &d);
        k_n = 2 * n * d;
        k_d = (d - n) * (d + n);
        share = 2 * k_d / (k_d + k_n);
        s->rows[TQ_TURN][i] = cosine * cosine * share - 1;
        s->rows[TQ_CROSS][i] = sine * cosine * share;
        s->rows[TQ_FEED][i] = sine * sine * share;
        s->rows[TQ_TAP][i] =
            tq_blend_at(hand, 1 + 2 * m + i) * hand->ramp * k_n / (2 * k_d * sine * cosine);
    }
}

TQ_INLINE void tq_tpt_layers(tq_rival *s, int first, int width, const tq_real *w, tq_real *out,
                             int count)
{
    tq_lanes s1[TQ_GROUPS], s2[TQ_GROUPS], turn[TQ_GROUPS];
    tq_lanes cross[TQ_GROUPS], feed[TQ_GROUPS], tap[TQ_GROUPS];
    int groups = (width + TQ_LANES - 1) / TQ_LANES, n, i;
    for (i = 0; i < groups; i++) {
        int at = first + i * TQ_LANES;
        s1[i] = tq_load(s->rows[TQ_T1] + at), s2[i] = tq_load(s->rows[TQ_T2] + at);
        turn[i] = tq_load(s->rows[TQ_TURN] + at), cross[i] = tq_load(s->rows[TQ_CROSS] + at);
        feed[i] = tq_load(s->rows[TQ_FEED] + at), tap[i] = tq_load(s->rows[TQ_TAP] + at);
    }
    for (n = 0; n < count; n++) {
        tq_real sum = out[n], band[TQ_SIDE_BY_SIDE];
        for (i = 0; i < groups; i++) {
            tq_lanes e = w[n] - s2[i], next = turn[i] * s1[i] + cross[i] * e;
            s2[i] += cross[i] * s1[i] + feed[i] * e;
            tq_store(band + i * TQ_LANES, tap[i] * (s1[i] + next));
            s1[i] = next;
        }
        for (i = 0; i < width; i++)
            sum += band[i];
        out[n] = sum;
    }
    for (i = 0; i < groups; i++) {
        int at = first + i * TQ_LANES;
        tq_store(s->rows[TQ_T1] + at, s1[i]), tq_store(s->rows[TQ_T2] + at, s2[i]);
    }
}

/* --- A filter by its coefficients --------------------------------------------------------------- */

/* `layers` only tells how wide the table is: 1 + 3 layers >= 1 + poles + zeros columns, the gain and
   the coefficients, then anything. y = x + sum b x' - sum a y', with x the noise times the gain. */
enum { TQ_PAST, TQ_WEIGHTS, TQ_PAST_INPUT, TQ_INPUT_WEIGHTS };

TQ_INLINE void tq_coefficients_update(tq_rival *TQ_RESTRICT s, const tq_hand *hand)
{
    int i;
    s->floor = tq_blend(hand, 0) * hand->ramp;
    for (i = 0; i < s->poles; i++)
        s->rows[TQ_WEIGHTS][i] = tq_blend_at(hand, 1 + (size_t)i);
    for (i = 0; i < s->zeros; i++)
        s->rows[TQ_INPUT_WEIGHTS][i] = tq_blend_at(hand, 1 + (size_t)(s->poles + i));
}

/* Four samples at once as far as the past goes, then one after the other. */
TQ_INLINE void tq_all_pole(tq_rival *s, const tq_real *x, tq_real *out, int count, int order)
{
    tq_real past[TQ_MOST_ORDER + TQ_CHUNK], a[TQ_MOST_ORDER + 1], *y = past + order;
    int n = 0, i, lag;
    memcpy(past, s->rows[TQ_PAST], (size_t)order * sizeof(tq_real));
    memcpy(a + 1, s->rows[TQ_WEIGHTS], (size_t)order * sizeof(tq_real));
    for (; n + 4 <= count; n += 4) {
        tq_real sum[4];
        for (i = 0; i < 4; i++)
            sum[i] = x[n + i];
        for (lag = order; lag > 3; lag--)
            for (i = 0; i < 4; i++)
                sum[i] -= a[lag] * y[n + i - lag];
        for (i = 0; i < 4; i++)
            y[n + i] = sum[i] - a[3] * y[n + i - 3] - a[2] * y[n + i - 2] - a[1] * y[n + i - 1];
    }
    for (; n < count; n++) {
        tq_real sum = x[n];
        for (lag = order; lag > 0; lag--)
            sum -= a[lag] * y[n - lag];
        y[n] = sum;
    }
    memcpy(out, y, (size_t)count * sizeof(tq_real));
    memcpy(s->rows[TQ_PAST], y + count - order, (size_t)order * sizeof(tq_real));
}

/* The zeros; samples are independent. */
TQ_INLINE void tq_all_zero(tq_rival *s, tq_real *x, int count)
{
    tq_real past[TQ_MOST_ORDER + TQ_CHUNK], *in = past + s->zeros;
    int n, lag;
    memcpy(past, s->rows[TQ_PAST_INPUT], (size_t)s->zeros * sizeof(tq_real));
    memcpy(in, x, (size_t)count * sizeof(tq_real));
    for (lag = 1; lag <= s->zeros; lag++) {
        tq_real b = s->rows[TQ_INPUT_WEIGHTS][lag - 1];
        for (n = 0; n < count; n++)
            x[n] += b * in[n - lag];
    }
    memcpy(s->rows[TQ_PAST_INPUT], in + count - s->zeros, (size_t)s->zeros * sizeof(tq_real));
}

/* A constant order lets the compiler unroll. */
TQ_INLINE void tq_coefficients_filter(tq_rival *s, const tq_real *w, tq_real *out, int count)
{
    tq_real x[TQ_CHUNK];
    int n;
    for (n = 0; n < count; n++)
        x[n] = s->floor * w[n];
    if (s->zeros)
        tq_all_zero(s, x, count);
    switch (s->poles) {
    case 6: tq_all_pole(s, x, out, count, 6); break;
    case 8: tq_all_pole(s, x, out, count, 8); break;
    case 12: tq_all_pole(s, x, out, count, 12); break;
    case 20: tq_all_pole(s, x, out, count, 20); break;
    case 40: tq_all_pole(s, x, out, count, 40); break;
    default: tq_all_pole(s, x, out, count, s->poles); break;
    }
}

/* --- The call ---------------------------------------------------------------------------------- */

TQ_INLINE void tq_rival_update(const tq_texture *t, tq_rival *TQ_RESTRICT s, const tq_hand *hand)
{
    switch (s->kind) {
    case TQ_DIRECT:
    case TQ_TRANSPOSED: tq_direct_update(t, s, hand); break;
    case TQ_TPT: tq_tpt_update(t, s, hand); break;
    case TQ_BANDS: tq_bands_update(t, s, hand); break;
    default: tq_coefficients_update(s, hand); break;
    }
}

TQ_INLINE void tq_rival_filter(const tq_texture *t, tq_rival *s, const tq_real *w, tq_real *out,
                                   int count)
{
    switch (s->kind) {
    case TQ_DIRECT:
    case TQ_BANDS: tq_all_layers(t, s, w, out, count, tq_direct_layers); break;
    case TQ_TRANSPOSED: tq_all_layers(t, s, w, out, count, tq_transposed_layers); break;
    case TQ_TPT: tq_all_layers(t, s, w, out, count, tq_tpt_layers); break;
    default: tq_coefficients_filter(s, w, out, count); break;
    }
}

/* The next `count` samples for a hand whose speed and force are given at each of them. */
static void tq_rival_render(const tq_texture *t, tq_rival *s, const tq_real *speed,
                            const tq_real *force, tq_real *out, size_t count)
{
    while (count) {
        tq_real noise[TQ_CHUNK + 2], *w = noise + 2;
        int chunk = count < TQ_CHUNK ? (int)count : TQ_CHUNK, done = 0, n;
        noise[0] = s->before[0], noise[1] = s->before[1];
        for (n = 0; n < chunk; n++)
            w[n] = tq_noise(s->key, s->position + (uint64_t)n);
        s->before[0] = noise[chunk], s->before[1] = noise[chunk + 1];
        while (done < chunk) {
            int left = t->update_samples - s->since_update, piece;
            if (s->position == 0 || left == 0) {
                tq_hand hand = tq_hand_at(t, speed[done], force[done]);
                tq_rival_update(t, s, &hand);
                s->since_update = 0;
                left = t->update_samples;
            }
            piece = left < chunk - done ? left : chunk - done;
            tq_rival_filter(t, s, w + done, out + done, piece);
            s->position += (uint64_t)piece;
            s->since_update += piece;
            done += piece;
        }
        speed += chunk, force += chunk, out += chunk, count -= (size_t)chunk;
    }
}

/* The same in calls of `block` samples each, as a device makes them that reads the hand so often. */
static void tq_rival_calls(const tq_texture *t, tq_rival *s, const tq_real *speed,
                           const tq_real *force, tq_real *out, size_t count, size_t block)
{
    size_t n;
    for (n = 0; n < count; n += block)
        tq_rival_render(t, s, speed + n, force + n, out + n, block < count - n ? block : count - n);
}

/* The kernel in such calls. */
static void tq_kernel_calls(const tq_texture *t, tq_state *s, const tq_real *speed,
                            const tq_real *force, tq_real *out, size_t count, size_t block)
{
    size_t n;
    for (n = 0; n < count; n += block)
        tq_render(t, s, speed + n, force + n, out + n, block < count - n ? block : count - n);
}

/* How this file and the kernel were compiled, beside the flags of Python. */
static const char *tq_build(void)
{
#if defined __clang__
    return "Clang " __clang_version__ ", " TQ_FLAGS;
#elif defined __GNUC__
    return "GCC " __VERSION__ ", " TQ_FLAGS;
#else
    return "another compiler, " TQ_FLAGS;
#endif
}

#endif
