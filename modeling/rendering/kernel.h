/* The rendering kernel: a texture under a moving hand, sample by sample.
   docs/method/rendering.md, docs/method/equalizer.md#recursion

   C99 or C++17, no allocation, no globals, no call of the mathematical library but one square root
   per layer and parameter update (and one per sample that the RMS limit touches). Compile with
   -ffp-contract=off, never with -ffast-math: then double precision equals the Python renderer bit for
   bit wherever double arithmetic is IEEE 754 without excess precision (not on x87). -fno-math-errno
   makes the square root one instruction where the processor has it.

   To be defined before including it, where needed:
   TQ_REAL          float, for single precision; no double is computed then.
   TQ_FREESTANDING  no library but memcpy, memmove and memset (GCC and Clang).
   TQ_LANES         1, if two layers in one operation are no faster than one after the other.
   TQ_SQRT(x)       another square root of a tq_real.

   Use: fill a tq_texture; give tq_start a tq_state and TQ_MEMORY(layers, up) reals; then call
   tq_render or tq_render_held as often as you like, with blocks of any size. Where readings of the hand
   come at times of their own, call tq_read for each of them and tq_render_on for blocks.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_KERNEL_H
#define TQ_KERNEL_H

#include <stddef.h>
#include <stdint.h>
#ifdef TQ_FREESTANDING
#define TQ_COPY __builtin_memcpy
#define TQ_MOVE __builtin_memmove
#define TQ_FILL __builtin_memset
#define TQ_SQRT_SINGLE __builtin_sqrtf
#define TQ_SQRT_DOUBLE __builtin_sqrt
#else
#include <math.h>
#include <string.h>
#define TQ_COPY memcpy
#define TQ_MOVE memmove
#define TQ_FILL memset
#define TQ_SQRT_SINGLE sqrtf
#define TQ_SQRT_DOUBLE sqrt
#endif

#ifndef TQ_REAL
#define TQ_REAL double
#endif

typedef TQ_REAL tq_real;

#ifndef TQ_SQRT
#define TQ_SQRT(x)                                                        \
    (sizeof(tq_real) == sizeof(float) ? (tq_real)TQ_SQRT_SINGLE((float)(x)) \
                                      : (tq_real)TQ_SQRT_DOUBLE((double)(x)))
#endif

/* Where the compiler can: always inlined, since constant widths make the loops fast; and two layers in
   one operation where the processor has an instruction for it. */
#ifdef __GNUC__
#define TQ_INLINE static inline __attribute__((always_inline))
#define TQ_RESTRICT __restrict
#else
#define TQ_INLINE static inline
#define TQ_RESTRICT
#endif
#ifndef TQ_LANES
#if defined __GNUC__ && (defined __SSE2__ || defined __ARM_NEON || defined __wasm_simd128__)
#define TQ_LANES 2
#else
#define TQ_LANES 1
#endif
#endif
#if TQ_LANES == 1
typedef tq_real tq_lanes;
#define TQ_PACK(x) ((x)[0])
#else
typedef tq_real tq_lanes __attribute__((vector_size(2 * sizeof(tq_real))));
#ifdef __cplusplus
#define TQ_PACK(x) (tq_lanes{(x)[0], (x)[1]})
#else
#define TQ_PACK(x) ((tq_lanes){(x)[0], (x)[1]}) /* of values just written, faster than tq_load */
#endif
#endif

#define TQ_CHUNK 64       /* samples that are filtered in one go */
#define TQ_DOUBLING 32    /* samples at the model's rate that one at twice the rate is made of */
#define TQ_PHASE 10       /* samples at twice the model's rate that one of the output is made of; even */
#define TQ_SIDE_BY_SIDE 4 /* layers whose recursions run side by side, a multiple of TQ_LANES */

/* Rows of the state's memory, each one value per layer, filled up to whole lanes; what is interpolated
   follows. */
enum { TQ_S1, TQ_S2, TQ_GAIN, TQ_P, TQ_Q, TQ_R, TQ_B1, TQ_B2, TQ_NOW, TQ_STEP, TQ_ROWS };
#define TQ_ROW(layers) (((layers) + TQ_LANES - 1) / TQ_LANES * TQ_LANES)

/* Samples that interpolation remembers, and a chunk more: at the model's rate, and at twice that rate. */
#define TQ_KEPT (TQ_DOUBLING - 1 + TQ_CHUNK)
#define TQ_KEPT_DOUBLED (TQ_PHASE + 1 + 2 * TQ_CHUNK)

/* How many reals of memory a state needs; up is 0 at the model's own rate. */
#define TQ_MEMORY(layers, up) (TQ_ROWS * TQ_ROW(layers) + ((up) ? TQ_KEPT + TQ_KEPT_DOUBLED : 0))

/* What is rendered, and where: constant while it plays. */
typedef struct {
    /* Parameters over a grid of speeds x forces: noise gain, then all frequencies (Hz), all
       bandwidths (Hz), all signed gains. A sign of 1 or -1 keeps a layer's gain from crossing 0
       where the grid stands for a regression, 0 leaves it alone. */
    int speeds, forces, layers;
    const tq_real *speed_mm_s, *force_n; /* (speeds), (forces): rising, above 0, at least two each */
    const tq_real *values;               /* (speeds, forces, 1 + 3 layers) */
    const tq_real *signs;                /* (layers) */
    /* Time. Bands, noise and updates run at the model's rate. The output's is up / down times twice that
       rate, at least once; at the model's own rate there is no interpolation and up is 0. */
    tq_real model_rate_hz, rate_hz;
    int up, down;
    const tq_real *doubling; /* (TQ_DOUBLING, 2): two samples for each one, weights of the oldest first */
    const tq_real *phases;   /* (up, TQ_PHASE): of those, each phase of the output's, oldest first */
    tq_real lead;            /* the delay of both, in updates: so much further a hand is extrapolated */
    int update_samples;      /* from one parameter update to the next at the model's rate, at least 1 */
    tq_real speed_change, force_change; /* the furthest a hand gets in one update (mm/s, N) */
    tq_real slope_share;  /* how much of a new change from update to update counts at once, up to 1 */
    /* Readings, in samples at the model's rate: how long one counts where none follows, and how long there
       must have been no contact until it counts as ended. */
    tq_real hold, release;
    const tq_real *slews; /* (1 + layers): the furthest a gain moves in one update */
    /* Vibrator compensation (eq. 7): out - share * band-pass(out); share 0 is none. */
    tq_real notch_hz, notch_width_hz, notch_share;
    /* Limits; 0 is none. The running mean square takes in mean_share of every new square. */
    tq_real peak, mean_square, mean_share;
    uint64_t longest, pause; /* samples of vibration without a pause; samples of silence that end it */
    tq_real silence;         /* the largest absolute value that counts as silence */
} tq_texture;

/* Coefficients of one unit-covariance band: s1' = s1 + p s1 - q s2 + b1 w, s2' = s2 + q s1 + r s2 +
   b2 w, and the unit-gain band-pass is tap (s1 + s1'). At high rates p and r are small: 1 + p in single
   precision would lose what distinguishes a narrow band from none. */
typedef struct {
    tq_real p, q, r, b1, b2, tap;
} tq_band;

/* What was corrected: samples without a finite hand (of tq_render_on: without a reading that counts);
   samples while the hand, as last read, touched and moved faster or pressed harder than the grid's
   highest, or else slower or more lightly than its lowest; parameter values moved into the legal range;
   samples that each limit touched. All samples are those of the output. */
typedef struct {
    uint64_t lift_offs, above_grid, below_grid, clamped, peak, rms, duration;
} tq_counters;

/* The hand, as last read; all 0 while none is known. */
typedef struct {
    int known;                        /* whether there is a reading that counts */
    int above_grid, below_grid;       /* whether it is */
    int leaving;                      /* whether there were readings without contact since */
    tq_real speed, force;
    tq_real speed_slope, force_slope; /* their change per update, smoothed */
    tq_real speed_turn, force_turn;   /* the same smoothed half as long, from then to now */
    /* It was read `ago` samples before position `read`, and first without contact `off_ago` before `off`. */
    uint64_t read, off;
    tq_real ago, off_ago;
} tq_followed;

typedef struct {
    uint64_t key, position; /* of the noise, and so samples at the model's rate */
    int since_update;
    int phase; /* of the next output sample since the newest of the model, of which one has 2 up */
    tq_followed hand;
    tq_real angle, per_sample; /* pi / rate; a sample's share of an update */
    tq_real to_middle, to_end; /* from an update to the middle and the end of its time, in updates */
    tq_real floor_gain, floor_now, floor_step;
    tq_real *memory;
    tq_band notch;
    tq_real notch_s1, notch_s2;
    tq_real mean_square;
    uint64_t sounding, silent;
    tq_counters counters;
} tq_state;

TQ_INLINE tq_real *tq_row(const tq_texture *t, const tq_state *s, int row)
{
    return s->memory + (size_t)row * (size_t)TQ_ROW(t->layers);
}

/* The last samples at the model's rate; then those at twice that rate. */
TQ_INLINE tq_real *tq_past(const tq_texture *t, const tq_state *s)
{
    return tq_row(t, s, TQ_ROWS);
}

TQ_INLINE tq_real tq_within(tq_real x, tq_real low, tq_real high)
{
    return x < low ? low : x > high ? high : x;
}

/* --- Noise ------------------------------------------------------------------------------------- */

/* Sample `position` of a stream: SplitMix64 as a counter, uniform on +-sqrt 3. */
TQ_INLINE tq_real tq_noise(uint64_t key, uint64_t position)
{
    uint64_t z = key + (position + 1) * UINT64_C(0x9E3779B97F4A7C15);
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    z ^= z >> 31;
    if (sizeof(tq_real) == sizeof(float)) /* 24 bits are exact in single precision, 53 in double */
        return ((tq_real)(int32_t)(z >> 40) * (tq_real)0x1p-23 - 1) * (tq_real)1.7320508075688772;
    return ((tq_real)(int64_t)(z >> 11) * (tq_real)0x1p-52 - 1) * (tq_real)1.7320508075688772;
}

/* --- Coefficients ------------------------------------------------------------------------------ */

TQ_INLINE tq_lanes tq_load(const tq_real *from)
{
    tq_lanes lanes;
    TQ_COPY(&lanes, from, sizeof lanes);
    return lanes;
}

TQ_INLINE void tq_store(tq_real *to, tq_lanes lanes)
{
    TQ_COPY(to, &lanes, sizeof lanes);
}

TQ_INLINE tq_lanes tq_root(tq_lanes x)
{
    tq_real each[TQ_LANES];
    int i;
    tq_store(each, x);
    for (i = 0; i < TQ_LANES; i++)
        each[i] = TQ_SQRT(each[i]);
    return TQ_PACK(each);
}

/* tan(half) = numerator / denominator, the [9/8] Pade approximant, with z = half^2, of reals or vectors of
   them: 0 <= half <= 0.245 pi. */
#define TQ_TANGENT_NUMERATOR(half, z) \
    ((half) * (TQ_K(34459425) + (z) * (TQ_K(-4729725) + (z) * (TQ_K(135135) + (z) * (TQ_K(-990) + (z))))))
#define TQ_TANGENT_DENOMINATOR(z) \
    (TQ_K(34459425) + \
     (z) * (TQ_K(-16216200) + (z) * (TQ_K(945945) + (z) * (TQ_K(-13860) + (z) * TQ_K(45)))))
#define TQ_K(constant) ((tq_real)(constant))

/* tan(angle / 2). */
TQ_INLINE void tq_half_tangent(tq_lanes angle, tq_lanes *numerator, tq_lanes *denominator)
{
    tq_lanes half = angle * (tq_real)0.5, z = half * half;
    *numerator = TQ_TANGENT_NUMERATOR(half, z);
    *denominator = TQ_TANGENT_DENOMINATOR(z);
}

/* Bands of peak frequency f and -3 dB width B, from angles pi f / rate and pi B / rate: p, q, r, b1,
   b2 and tap of tq_band. */
TQ_INLINE void tq_bands_of(tq_lanes frequency, tq_lanes bandwidth, tq_lanes band[6])
{
    const tq_real one = 1, two = 2;
    tq_lanes n, d, k_n, k_d, scale, cosine, sine, root, share;
    tq_half_tangent(frequency, &n, &d);
    scale = one / (d * d + n * n);
    cosine = (d - n) * (d + n) * scale;
    sine = two * n * d * scale;
    tq_half_tangent(bandwidth, &n, &d);
    k_n = two * n * d;
    k_d = (d - n) * (d + n); /* tan(pi B / rate) = k_n / k_d */
    scale = one / (k_d + k_n);
    share = k_d * scale;
    root = tq_root(k_n * k_d);
    band[2] = -two * sine * sine * share;
    band[0] = band[2] - two * k_n * scale;
    band[1] = two * sine * cosine * share;
    band[3] = two * root * scale * cosine;
    band[4] = two * root * scale * sine;
    band[5] = root / (two * k_d * cosine);
}

/* The same for one band. */
static tq_band tq_band_of(tq_real frequency, tq_real bandwidth)
{
    tq_real f[TQ_LANES], b[TQ_LANES], each[6][TQ_LANES];
    tq_lanes band[6];
    tq_band one;
    int i;
    for (i = 0; i < TQ_LANES; i++)
        f[i] = frequency, b[i] = bandwidth;
    tq_bands_of(tq_load(f), tq_load(b), band);
    for (i = 0; i < 6; i++)
        tq_store(each[i], band[i]);
    one.p = each[0][0], one.q = each[1][0], one.r = each[2][0];
    one.b1 = each[3][0], one.b2 = each[4][0], one.tap = each[5][0];
    return one;
}

/* --- Parameter updates ------------------------------------------------------------------------- */

/* The grid cell that holds x, which lies within the axis, and how far x is into it (0 to 1). */
TQ_INLINE int tq_cell(const tq_real *axis, int size, tq_real x, tq_real *share)
{
    int i = 0;
    while (i < size - 2 && x >= axis[i + 1])
        i++;
    *share = (x - axis[i]) / (axis[i + 1] - axis[i]);
    return i;
}

/* Where a hand is on the grid: the four corners around it, the place between them, and the share of
   the level that is left below the lowest speed or force (0 at rest or lift-off). */
typedef struct {
    const tq_real *corner[4];
    tq_real x, y, ramp;
} tq_hand;

TQ_INLINE tq_hand tq_hand_at(const tq_texture *t, tq_real speed, tq_real force)
{
    tq_hand hand;
    const tq_real *v = t->speed_mm_s, *f = t->force_n;
    int width = 1 + 3 * t->layers, i, j;
    if (!(speed - speed == 0 && force - force == 0)) /* NaN or infinite: lift-off */
        speed = force = 0;
    speed = speed < 0 ? -speed : speed;
    hand.ramp = speed < v[0] ? speed / v[0] : 1;
    if (force < f[0])
        hand.ramp *= force > 0 ? force / f[0] : 0;
    i = tq_cell(v, t->speeds, tq_within(speed, v[0], v[t->speeds - 1]), &hand.x);
    j = tq_cell(f, t->forces, tq_within(force, f[0], f[t->forces - 1]), &hand.y);
    hand.corner[0] = t->values + ((size_t)i * (size_t)t->forces + (size_t)j) * (size_t)width;
    hand.corner[1] = hand.corner[0] + (size_t)t->forces * (size_t)width;
    hand.corner[2] = hand.corner[0] + width;
    hand.corner[3] = hand.corner[1] + width;
    return hand;
}

TQ_INLINE tq_real tq_blend(const tq_hand *hand, int i)
{
    tq_real low = hand->corner[0][i] * (1 - hand->x) + hand->corner[1][i] * hand->x;
    tq_real high = hand->corner[2][i] * (1 - hand->x) + hand->corner[3][i] * hand->x;
    return low * (1 - hand->y) + high * hand->y;
}

/* Values `first` ... first + width - 1. */
TQ_INLINE void tq_blend_all(const tq_hand *hand, int first, int width, tq_real *to)
{
    tq_real x = hand->x, y = hand->y;
    int i = 0;
    for (; i + TQ_LANES <= width; i += TQ_LANES) {
        int at = first + i;
        tq_lanes low = tq_load(hand->corner[0] + at) * (1 - x) + tq_load(hand->corner[1] + at) * x;
        tq_lanes high = tq_load(hand->corner[2] + at) * (1 - x) + tq_load(hand->corner[3] + at) * x;
        tq_store(to + i, low * (1 - y) + high * y);
    }
    for (; i < width; i++)
        to[i] = tq_blend(hand, first + i);
}

/* Speeds, forces and their changes below a billionth of the grid's lowest count as 0: values that decay
   exponentially would become subnormal numbers and stay so; some processors compute these at a
   fraction of their speed. */
TQ_INLINE tq_real tq_settled(tq_real x, tq_real lowest)
{
    tq_real least = (tq_real)1e-9 * lowest;
    return x < least && x > -least ? 0 : x;
}

/* The exponentially smoothed change of a reading per update, by which the hand is extrapolated linearly;
   the last reading was 1 / `rate` updates ago. A step, which is a change beyond what a hand can do, and a
   reading of 0 reset it. */
TQ_INLINE tq_real tq_slope(tq_real slope, tq_real last, tq_real now, tq_real rate, tq_real furthest,
                           tq_real share, tq_real lowest)
{
    tq_real change = now - last;
    int goes_on = change <= furthest && change >= -furthest && now != 0;
    return goes_on ? tq_settled(slope + share * (change * rate - slope), lowest) : 0;
}

/* The next gain: `wanted`, or as far towards it as one update may go. */
TQ_INLINE tq_real tq_towards(tq_real gain, tq_real wanted, tq_real slew)
{
    tq_real change = wanted - gain;
    if (change > slew)
        return gain + slew;
    return change < -slew ? gain - slew : wanted;
}

/* Whether a value was moved by more than the rounding of an interpolation between legal ones. */
TQ_INLINE int tq_moved(tq_real value, tq_real legal)
{
    tq_real by = value - legal;
    return (by < 0 ? -by : by) > (tq_real)1e-6 * legal;
}

/* Of `width` layers from `from` on: coefficients, and the ramps of gains until the next update. */
TQ_INLINE void tq_update_layers(const tq_texture *t, tq_state *s, const tq_hand *amid,
                                const tq_hand *end, int from, int width)
{
    tq_real f[TQ_SIDE_BY_SIDE], b[TQ_SIDE_BY_SIDE], now[TQ_SIDE_BY_SIDE], next[TQ_SIDE_BY_SIDE];
    tq_real highest = (tq_real)0.49 * t->model_rate_hz, widest = (tq_real)0.45 * t->model_rate_hz;
    tq_real *gain = tq_row(t, s, TQ_GAIN) + from;
    int first = s->position == 0, m = t->layers, row, i;
    tq_blend_all(amid, 1 + from, width, f);
    tq_blend_all(amid, 1 + m + from, width, b);
    tq_blend_all(end, 1 + 2 * m + from, width, next);
    for (i = 0; i < width; i++) {
        tq_real f_legal = tq_within(f[i], 1, highest), b_legal = tq_within(b[i], (tq_real)0.1, widest);
        tq_real wanted = (t->signs[from + i] * next[i] < 0 ? 0 : next[i]) * end->ramp;
        if (f[i] != f_legal || b[i] != b_legal)
            s->counters.clamped += (uint64_t)(tq_moved(f[i], f_legal) + tq_moved(b[i], b_legal));
        f[i] = s->angle * f_legal;
        b[i] = s->angle * b_legal;
        if (first)
            gain[i] = wanted;
        now[i] = gain[i];
        next[i] = gain[i] = tq_towards(now[i], wanted, t->slews[1 + from + i]);
    }
    for (; i % TQ_LANES; i++) /* a lane without a layer does as the first does, in silence */
        f[i] = f[0], b[i] = b[0], now[i] = next[i] = 0;
    for (i = 0; i < width; i += TQ_LANES) {
        tq_lanes band[6], start = TQ_PACK(now + i), change = TQ_PACK(next + i) - start;
        tq_bands_of(TQ_PACK(f + i), TQ_PACK(b + i), band);
        for (row = 0; row < 5; row++)
            tq_store(tq_row(t, s, TQ_P + row) + from + i, band[row]);
        tq_store(tq_row(t, s, TQ_NOW) + from + i, start * band[5]);
        tq_store(tq_row(t, s, TQ_STEP) + from + i, change * s->per_sample * band[5]);
    }
}

/* Whether a hand that touches and moves is beyond the grid's highest speed or force, or else below
   its lowest. */
TQ_INLINE void tq_locate(const tq_texture *t, tq_followed *hand)
{
    tq_real speed = hand->speed, force = hand->force, size = speed < 0 ? -speed : speed;
    int strokes = (size > 0) & (force > 0);
    int above = (size > t->speed_mm_s[t->speeds - 1]) | (force > t->force_n[t->forces - 1]);
    int below = (size < t->speed_mm_s[0]) | (force < t->force_n[0]);
    hand->above_grid = strokes & above;
    hand->below_grid = strokes & below & !above;
}

/* Samples from `ago` before position `from` to position `to`; from 2^30 on no more. */
TQ_INLINE tq_real tq_age(uint64_t from, tq_real ago, uint64_t to)
{
    uint64_t samples = to - from, most = UINT64_C(1) << 30;
    return (tq_real)(int32_t)(samples < most ? samples : most) + ago;
}

/* Whether a reading without contact, `ago` samples ago, is still too short after the first of them to end
   the contact: sensors miss it for a moment. */
TQ_INLINE int tq_leaving(const tq_texture *t, tq_state *s, tq_real ago, tq_real since, tq_real force)
{
    tq_followed *hand = &s->hand;
    if (!hand->known || !(hand->force > 0) || force > 0)
        return 0;
    if (!hand->leaving)
        hand->leaving = 1, hand->off = s->position, hand->off_ago = ago;
    return tq_age(hand->off, hand->off_ago, s->position) - ago < t->release && since <= t->hold;
}

/* Takes in a reading of the hand that was made `ago` samples before the next one, at the model's rate. None
   counts that is not finite, as if it had not come, or no later than a thousandth of such a sample after the
   last one. */
TQ_INLINE void tq_take_in(const tq_texture *t, tq_state *s, tq_real ago, tq_real speed, tq_real force)
{
    tq_followed *hand = &s->hand;
    tq_real since, v = t->speed_mm_s[0], f = t->force_n[0];
    since = tq_age(hand->read, hand->ago, s->position) - ago;
    if (!(speed - speed == 0 && force - force == 0) || (hand->known && !(since > (tq_real)1e-3)))
        return;
    if (tq_leaving(t, s, ago, since, force))
        return;
    if (hand->known) {
        tq_real updates = since / (tq_real)t->update_samples, most = updates > 1 ? updates : 1;
        tq_real rate = 1 / updates;
        tq_real speed_change = t->speed_change * most, force_change = t->force_change * most;
        tq_real share = tq_within(t->slope_share * updates, 0, 1), more = tq_within(2 * share, 0, 1);
        tq_real v0 = hand->speed, f0 = hand->force;
        hand->speed_slope = tq_slope(hand->speed_slope, v0, speed, rate, speed_change, share, v);
        hand->force_slope = tq_slope(hand->force_slope, f0, force, rate, force_change, share, f);
        hand->speed_turn = tq_slope(hand->speed_turn, v0, speed, rate, speed_change, more, v);
        hand->force_turn = tq_slope(hand->force_turn, f0, force, rate, force_change, more, f);
    }
    hand->known = 1, hand->leaving = 0;
    hand->read = s->position, hand->ago = ago;
    hand->speed = tq_settled(speed, v);
    hand->force = tq_settled(force, f);
    tq_locate(t, hand);
}

/* The hand in the middle of the time to the next update, and just before it: linearly extrapolated, from
   when it was read to now and on from there. A reading that is too old counts no longer: lift-off. */
TQ_INLINE void tq_follow(const tq_texture *t, tq_state *s, tq_hand *amid, tq_hand *end)
{
    tq_followed *hand = &s->hand;
    tq_real age = tq_age(hand->read, hand->ago, s->position), to_end = s->to_end, past, speed, force;
    if (age > t->hold)
        TQ_FILL(hand, 0, sizeof *hand);
    past = age / (tq_real)t->update_samples;
    speed = hand->speed + hand->speed_turn * past;
    force = hand->force + hand->force_turn * past;
    *end = tq_hand_at(t, speed + hand->speed_slope * to_end, force + hand->force_slope * to_end);
    *amid = *end;
    if (to_end > 0)
        *amid = tq_hand_at(t, speed + hand->speed_slope * s->to_middle,
                           force + hand->force_slope * s->to_middle);
}

/* The ramp of the noise gain until the next update. */
TQ_INLINE void tq_update_floor(const tq_texture *t, tq_state *s, const tq_hand *end)
{
    int first = s->position == 0;
    tq_real wanted = tq_blend(end, 0), next;
    wanted = (wanted < 0 ? 0 : wanted) * end->ramp;
    next = first ? wanted : tq_towards(s->floor_gain, wanted, t->slews[0]);
    s->floor_now = first ? next : s->floor_gain;
    s->floor_step = (next - s->floor_now) * s->per_sample;
    s->floor_gain = next;
}

/* Parameters for the linearly extrapolated hand: those for the hand as it was read would be late.
   Frequencies and bandwidths are set for the middle of the time to the next update; gains ramp linearly
   to those for its last sample, so that nothing clicks. The first update sets all at once. */
static void tq_update(const tq_texture *t, tq_state *s)
{
    tq_hand amid, end;
    int i;
    tq_follow(t, s, &amid, &end);
    tq_update_floor(t, s, &end);
    for (i = 0; i + TQ_SIDE_BY_SIDE <= t->layers; i += TQ_SIDE_BY_SIDE)
        tq_update_layers(t, s, &amid, &end, i, TQ_SIDE_BY_SIDE);
    switch (t->layers - i) { /* a constant width lets the compiler unroll */
    case 3: tq_update_layers(t, s, &amid, &end, i, 3); break;
    case 2: tq_update_layers(t, s, &amid, &end, i, 2); break;
    case 1: tq_update_layers(t, s, &amid, &end, i, 1); break;
    default: break;
    }
}

/* --- Filtering --------------------------------------------------------------------------------- */

/* `width` layers from `first` on, added to `out`. */
TQ_INLINE void tq_layers(const tq_texture *t, tq_state *s, int first, int width, const tq_real *w,
                         tq_real *out, int count)
{
    enum { MOST = TQ_SIDE_BY_SIDE / TQ_LANES };
    tq_lanes s1[MOST], s2[MOST], now[MOST], step[MOST];
    tq_lanes p[MOST], q[MOST], r[MOST], b1[MOST], b2[MOST];
    int groups = (width + TQ_LANES - 1) / TQ_LANES, n, i;
    for (i = 0; i < groups; i++) {
        int at = first + i * TQ_LANES;
        s1[i] = tq_load(tq_row(t, s, TQ_S1) + at), s2[i] = tq_load(tq_row(t, s, TQ_S2) + at);
        p[i] = tq_load(tq_row(t, s, TQ_P) + at), q[i] = tq_load(tq_row(t, s, TQ_Q) + at);
        r[i] = tq_load(tq_row(t, s, TQ_R) + at);
        b1[i] = tq_load(tq_row(t, s, TQ_B1) + at), b2[i] = tq_load(tq_row(t, s, TQ_B2) + at);
        now[i] = tq_load(tq_row(t, s, TQ_NOW) + at), step[i] = tq_load(tq_row(t, s, TQ_STEP) + at);
    }
    for (n = 0; n < count; n++) {
        tq_real x = w[n], y = out[n], band[TQ_SIDE_BY_SIDE];
        for (i = 0; i < groups; i++) {
            tq_lanes turned1 = (s1[i] + b1[i] * x) + (p[i] * s1[i] - q[i] * s2[i]);
            tq_lanes turned2 = (s2[i] + b2[i] * x) + (r[i] * s2[i] + q[i] * s1[i]);
            now[i] += step[i];
            tq_store(band + i * TQ_LANES, now[i] * (s1[i] + turned1));
            s1[i] = turned1;
            s2[i] = turned2;
        }
        for (i = 0; i < width; i++)
            y += band[i];
        out[n] = y;
    }
    for (i = 0; i < groups; i++) {
        int at = first + i * TQ_LANES;
        tq_store(tq_row(t, s, TQ_S1) + at, s1[i]);
        tq_store(tq_row(t, s, TQ_S2) + at, s2[i]);
        tq_store(tq_row(t, s, TQ_NOW) + at, now[i]);
    }
}

/* All layers and the noise branch, between two updates. */
static void tq_filter(const tq_texture *t, tq_state *s, const tq_real *w, tq_real *out, int count)
{
    int i = 0, n;
    tq_real now = s->floor_now;
    for (n = 0; n < count; n++) {
        now += s->floor_step;
        out[n] = now * w[n];
    }
    s->floor_now = now;
    for (; i + TQ_SIDE_BY_SIDE <= t->layers; i += TQ_SIDE_BY_SIDE)
        tq_layers(t, s, i, TQ_SIDE_BY_SIDE, w, out, count);
    switch (t->layers - i) { /* a constant width lets the compiler unroll */
    case 3: tq_layers(t, s, i, 3, w, out, count); break;
    case 2: tq_layers(t, s, i, 2, w, out, count); break;
    case 1: tq_layers(t, s, i, 1, w, out, count); break;
    default: break;
    }
    s->since_update += count;
    s->position += (uint64_t)count;
}

/* --- Interpolation ----------------------------------------------------------------------------- */

/* Of the output, how many samples precede sample `samples` (from 0, at most a chunk) of those that are next
   at the model's rate: that one is made for the next of them, and by its hand. */
TQ_INLINE size_t tq_outputs_before(const tq_texture *t, int phase, int samples)
{
    if (!t->up)
        return (size_t)samples;
    return (size_t)((2 * (samples + 1) * t->up - phase + t->down - 1) / t->down);
}

/* How many samples at the model's rate the next `count` of the output need. */
TQ_INLINE int tq_samples_for(const tq_texture *t, int phase, size_t count)
{
    if (!t->up)
        return (int)count;
    return (phase + ((int)count - 1) * t->down) / (2 * t->up);
}

/* The phase after those. */
TQ_INLINE int tq_phase_after(const tq_texture *t, int phase, int samples, size_t count)
{
    return phase + (int)count * t->down - 2 * samples * t->up;
}

/* Two samples for each of `width` at x[TQ_DOUBLING - 1] and on. */
TQ_INLINE void tq_double(const tq_real *weights, const tq_real *x, tq_real *out, int width)
{
    enum { MOST = 4, PAIR = 2 / TQ_LANES };
    tq_lanes sum[MOST][PAIR];
    int tap, n, i;
    for (n = 0; n < width; n++)
        for (i = 0; i < PAIR; i++)
            sum[n][i] = tq_load(weights + i * TQ_LANES) * x[n];
    for (tap = 1; tap < TQ_DOUBLING; tap++)
        for (n = 0; n < width; n++)
            for (i = 0; i < PAIR; i++)
                sum[n][i] += tq_load(weights + 2 * tap + i * TQ_LANES) * x[tap + n];
    for (n = 0; n < width; n++)
        for (i = 0; i < PAIR; i++)
            tq_store(out + 2 * n + i * TQ_LANES, sum[n][i]);
}

/* One sample of the output: the sum of the even terms and that of the odd ones. */
TQ_INLINE tq_real tq_between(const tq_real *weights, const tq_real *x)
{
    enum { PAIR = 2 / TQ_LANES };
    tq_lanes sum[PAIR];
    tq_real each[2];
    int tap, i;
    for (i = 0; i < PAIR; i++)
        sum[i] = tq_load(weights + i * TQ_LANES) * tq_load(x + i * TQ_LANES);
    for (tap = 2; tap < TQ_PHASE; tap += 2)
        for (i = 0; i < PAIR; i++)
            sum[i] += tq_load(weights + tap + i * TQ_LANES) * tq_load(x + tap + i * TQ_LANES);
    for (i = 0; i < PAIR; i++)
        tq_store(each + i * TQ_LANES, sum[i]);
    return each[0] + each[1];
}

/* The next `count` samples of the output, for which `samples` at the model's rate were added to the past. */
static void tq_interpolate(const tq_texture *t, tq_state *s, int samples, tq_real *out, size_t count)
{
    enum { SIDE_BY_SIDE = 4 };
    tq_real *past = tq_past(t, s), *doubled = past + TQ_KEPT, *fresh = doubled + TQ_PHASE + 1;
    const tq_real *x = doubled + s->phase / t->up;
    int phase = s->phase % t->up, i = 0;
    size_t n;
    for (; i + SIDE_BY_SIDE <= samples; i += SIDE_BY_SIDE)
        tq_double(t->doubling, past + i, fresh + 2 * i, SIDE_BY_SIDE);
    for (; i < samples; i++)
        tq_double(t->doubling, past + i, fresh + 2 * i, 1);
    for (n = 0; n < count; n++) {
        out[n] = tq_between(t->phases + (size_t)phase * TQ_PHASE, x);
        for (phase += t->down; phase >= t->up; phase -= t->up)
            x++;
    }
    TQ_MOVE(past, past + samples, (TQ_DOUBLING - 1) * sizeof(tq_real));
    TQ_MOVE(doubled, doubled + 2 * samples, (TQ_PHASE + 1) * sizeof(tq_real));
    s->phase = tq_phase_after(t, s->phase, samples, count);
}

/* --- Compensation ------------------------------------------------------------------------------ */

/* Eq. 7: out - share * band-pass(out). Non-finite values would stay in the state and count as silence;
   decayed values are set to 0 instead of becoming subnormal. */
static void tq_compensate(const tq_texture *t, tq_state *s, tq_real *out, int count)
{
    tq_band b = s->notch;
    tq_real s1 = s->notch_s1, s2 = s->notch_s2, gain = t->notch_share * b.tap;
    int n;
    for (n = 0; n < count; n++) {
        tq_real x = out[n] - out[n] == 0 ? out[n] : 0;
        tq_real turned1 = (s1 + b.b1 * x) + (b.p * s1 - b.q * s2);
        tq_real turned2 = (s2 + b.b2 * x) + (b.r * s2 + b.q * s1);
        if (x == 0 && turned1 * turned1 + turned2 * turned2 < (tq_real)1e-30)
            turned1 = turned2 = 0;
        out[n] = x - gain * (s1 + turned1);
        s1 = turned1;
        s2 = turned2;
    }
    s->notch_s1 = s1;
    s->notch_s2 = s2;
}

/* --- Limits ------------------------------------------------------------------------------------ */

/* One sample within the limits. After `longest` samples of vibration without `pause` samples of
   silence the output is muted until such a pause. Then the peak; then the running mean square
   of the output, which never exceeds its limit. */
TQ_INLINE tq_real tq_limit(const tq_texture *t, tq_state *s, tq_real y)
{
    if (t->longest) {
        int quiet = y <= t->silence && y >= -t->silence;
        s->silent = quiet ? s->silent + 1 : 0;
        s->sounding = s->silent >= t->pause ? 0 : s->sounding + (s->sounding || !quiet);
        if (s->sounding > t->longest && y != 0) {
            y = 0;
            s->counters.duration++;
        }
    }
    if (t->peak > 0 && !(y <= t->peak && y >= -t->peak)) {
        y = y > 0 ? t->peak : y < 0 ? -t->peak : 0; /* 0: not a number */
        s->counters.peak++;
    }
    if (t->mean_square > 0) {
        tq_real kept = (1 - t->mean_share) * s->mean_square;
        tq_real room = (t->mean_square - kept) / t->mean_share;
        room = room > 0 ? room : 0; /* kept is rounded: of a long window perhaps above the limit */
        if (!(y * y <= room)) {
            y = y > 0 ? TQ_SQRT(room) : y < 0 ? -TQ_SQRT(room) : 0;
            s->counters.rms++;
        }
        s->mean_square = kept + t->mean_share * (y * y);
        if (s->mean_square < (tq_real)1e-20 * t->mean_square)
            s->mean_square = 0; /* instead of becoming subnormal */
    }
    return y;
}

/* --- The calls --------------------------------------------------------------------------------- */

/* Silence at position 0 of a noise stream. `memory` holds TQ_MEMORY(layers, up) reals and must live as
   long as the state. */
static void tq_start(const tq_texture *t, tq_state *s, tq_real *memory, uint64_t key)
{
    tq_real notch_angle = (tq_real)3.141592653589793 / t->rate_hz;
    int n;
    TQ_FILL(s, 0, sizeof *s);
    s->key = key;
    s->phase = 2 * t->up;
    s->angle = (tq_real)3.141592653589793 / t->model_rate_hz;
    s->per_sample = 1 / (tq_real)t->update_samples;
    s->to_end = (tq_real)(t->update_samples - 1) / (tq_real)t->update_samples;
    s->to_middle = s->to_end / 2 + t->lead;
    s->to_end += t->lead;
    s->memory = memory;
    for (n = 0; n < TQ_MEMORY(t->layers, t->up); n++)
        memory[n] = 0;
    if (t->notch_share != 0)
        s->notch = tq_band_of(notch_angle * t->notch_hz, notch_angle * t->notch_width_hz);
}

/* Of a hand that has `step` = 1 reading for each sample, or is held (0): samples without a finite one. */
TQ_INLINE uint64_t tq_lift_offs(const tq_real *speed, const tq_real *force, size_t step, int count)
{
    enum { SUMS = 4 };
    tq_real lost[SUMS] = {0, 0, 0, 0}; /* stay 0 while every reading is finite, else not a number */
    uint64_t lift_offs = 0;
    int samples = step ? count : 1, n = 0, i;
    for (; n + SUMS <= samples; n += SUMS)
        for (i = 0; i < SUMS; i++)
            lost[i] += (speed[n + i] - speed[n + i]) + (force[n + i] - force[n + i]);
    for (; n < samples; n++)
        lost[0] += (speed[n] - speed[n]) + (force[n] - force[n]);
    if ((lost[0] + lost[1]) + (lost[2] + lost[3]) == 0)
        return 0;
    for (n = 0; n < samples; n++)
        lift_offs += !(speed[n] - speed[n] == 0 && force[n] - force[n] == 0);
    return step ? lift_offs : lift_offs * (uint64_t)count;
}

/* The stages after the sum of all branches. */
TQ_INLINE void tq_restrain(const tq_texture *t, tq_state *s, tq_real *out, int count)
{
    int n;
    if (t->notch_share != 0)
        tq_compensate(t, s, out, count);
    if (t->peak > 0 || t->mean_square > 0 || t->longest > 0)
        for (n = 0; n < count; n++)
            out[n] = tq_limit(t, s, out[n]);
}

/* Of the output, samples with the hand beyond the grid, as last read, and where `reads` is 0 without one. */
TQ_INLINE void tq_count_hand(tq_state *s, int reads, size_t count)
{
    s->counters.lift_offs += (uint64_t)!(reads || s->hand.known) * count;
    s->counters.above_grid += (uint64_t)s->hand.above_grid * count;
    s->counters.below_grid += (uint64_t)s->hand.below_grid * count;
}

/* The next `samples` at the model's rate, at most a chunk, for `count` of the output. */
static void tq_render_model(const tq_texture *t, tq_state *s, const tq_real *speed,
                            const tq_real *force, size_t step, int reads, tq_real *out, int samples,
                            size_t count)
{
    tq_real w[TQ_CHUNK];
    size_t counted = 0;
    int done = 0, n;
    for (n = 0; n < samples; n++)
        w[n] = tq_noise(s->key, s->position + (uint64_t)n);
    while (done < samples) {
        int left = t->update_samples - s->since_update, piece;
        if (s->position == 0 || left == 0) {
            size_t now = tq_outputs_before(t, s->phase, done);
            tq_count_hand(s, reads, now - counted);
            counted = now;
            if (reads)
                tq_take_in(t, s, 0, speed[step * now], force[step * now]);
            tq_update(t, s);
            s->since_update = 0;
            left = t->update_samples;
        }
        piece = left < samples - done ? left : samples - done;
        tq_filter(t, s, w + done, out + done, piece);
        done += piece;
    }
    tq_count_hand(s, reads, count - counted);
}

/* The next `count` samples for a hand of `step` = 1 reading for each, or that is held (0); where `reads` is
   0, for the hand as last read. */
TQ_INLINE void tq_render_by(const tq_texture *t, tq_state *s, const tq_real *speed,
                            const tq_real *force, size_t step, int reads, tq_real *out, size_t count)
{
    while (count) {
        size_t most = tq_outputs_before(t, s->phase, TQ_CHUNK), chunk = count < most ? count : most;
        tq_real *made = t->up ? tq_past(t, s) + TQ_DOUBLING - 1 : out;
        int samples = tq_samples_for(t, s->phase, chunk);
        if (reads)
            s->counters.lift_offs += tq_lift_offs(speed, force, step, (int)chunk);
        tq_render_model(t, s, speed, force, step, reads, made, samples, chunk);
        if (t->up)
            tq_interpolate(t, s, samples, out, chunk);
        tq_restrain(t, s, out, (int)chunk);
        speed += step * chunk, force += step * chunk;
        out += chunk, count -= chunk;
    }
}

/* The next `count` samples for a hand whose speed (mm/s, signed: without its sign the hand would be
   extrapolated past its reversals) and force (N) are given at each of them. What is not finite counts as
   missing: the reading before it is held. */
static inline void tq_render(const tq_texture *t, tq_state *s, const tq_real *speed,
                             const tq_real *force, tq_real *out, size_t count)
{
    tq_render_by(t, s, speed, force, 1, 1, out, count);
}

/* The next `count` samples for a hand whose speed and force are held, as with one reading per block. */
static inline void tq_render_held(const tq_texture *t, tq_state *s, tq_real speed, tq_real force,
                                  tq_real *out, size_t count)
{
    tq_render_by(t, s, &speed, &force, 0, 1, out, count);
}

/* A reading of the hand, made `ago` samples of the output (fractions count) before the next one; below 0
   counts as 0. Readings come in the order of their times: one that is not later than the last is ignored. */
static inline void tq_read(const tq_texture *t, tq_state *s, tq_real ago, tq_real speed, tq_real force)
{
    ago = ago > 0 ? ago : 0;
    if (t->up) /* from samples of the output to those of the model, and to the next one of these */
        ago = 1 + (ago * (tq_real)t->down - (tq_real)s->phase) / (tq_real)(2 * t->up);
    tq_take_in(t, s, ago, speed, force);
}

/* The next `count` samples for the hand as it was read by tq_read, extrapolated from the time of the
   reading. */
static inline void tq_render_on(const tq_texture *t, tq_state *s, tq_real *out, size_t count)
{
    const tq_real none = 0;
    tq_render_by(t, s, &none, &none, 0, 0, out, count);
}

#endif
