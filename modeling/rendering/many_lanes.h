/* TQ_WIDE_LANES streams in one vector; included by many.h once for every width of vectors.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#define TQ_W TQ_WIDE_LANES
#define TQ_(name) TQ_WIDE_NAME(name)
#define TQ_WIDE TQ_INLINE TQ_WIDE_TARGET
#define TQ_EACH(l) (l = 0; l < TQ_W; l++)

typedef tq_real TQ_(tq_vector) __attribute__((vector_size(TQ_W * sizeof(tq_real)), may_alias));
typedef tq_real TQ_(tq_unaligned)
    __attribute__((vector_size(TQ_W * sizeof(tq_real)), may_alias, aligned(sizeof(tq_real))));
typedef uint64_t TQ_(tq_bits) __attribute__((vector_size(TQ_W * sizeof(uint64_t)), may_alias));
typedef int64_t TQ_(tq_mask) __attribute__((vector_size(TQ_W * sizeof(int64_t)), may_alias));
#define V TQ_(tq_vector)
#define M TQ_(tq_mask)

/* One axis of a hand's place: the cell that it was in last, and the cell's bounds. */
typedef struct {
    V low, high, width;
    int cell[TQ_W];
} TQ_(tq_axis);

/* Where a hand is, for every stream: tq_hand. */
typedef struct {
    TQ_(tq_axis) speed, force;
    V x, y, ramp;
    const tq_real *corner[TQ_W];
} TQ_(tq_hands);

/* tq_state for every stream. */
typedef struct {
    V lowest_speed, highest_speed, lowest_force, highest_force;
    V speed, force, speed_slope, force_slope; /* tq_followed */
    M known, leaving;
    V speed_turn, force_turn;
    V age, off, updates_ago;
    TQ_(tq_hands) amid, end;
    V floor_gain, floor_now, floor_step, floor_slew;
    TQ_(tq_bits) keys;
    M above_grid, below_grid, samples_above, samples_below;
    tq_real angle, per_sample, to_middle, to_end;
    size_t position, reading, longest, shortest; /* at the model's rate; in the output, of the next update */
    int phase;
    tq_stream *streams;
    V *rows, *past, *doubled; /* the last two as of tq_past */
    V *blended; /* one row of a table */
    size_t beside[TQ_W]; /* from a node of a table to that of the next speed */
    tq_state limited[TQ_W]; /* what comes behind the sum, stream by stream */
} TQ_(tq_many);

/* Of one of the kernel's rows, or of those below, the values of a layer. */
#define TQ_AT(row, layer) (s->rows[(size_t)(row) * (size_t)s->streams->texture.layers + (layer)])
#define TQ_SIGN TQ_ROWS
#define TQ_SLEW (TQ_ROWS + 1)
#define TQ_TAP (TQ_ROWS + 2)
#define TQ_ALL_ROWS (TQ_ROWS + TQ_MORE_ROWS)

TQ_WIDE V TQ_(tq_either)(M mask, V yes, V no)
{
    return (V)((mask & (M)yes) | (~mask & (M)no));
}

TQ_WIDE V TQ_(tq_all)(tq_real x)
{
    return (V){0} + x;
}

/* Rows become columns. */
TQ_WIDE void TQ_(tq_turn)(V row[TQ_W])
{
#if TQ_W == 2
    V first = row[0];
    row[0] = (V){first[0], row[1][0]};
    row[1] = (V){first[1], row[1][1]};
#elif TQ_W == 4
    __m256d even[2], odd[2];
    int i;
    for (i = 0; i < 2; i++) {
        even[i] = _mm256_unpacklo_pd((__m256d)row[2 * i], (__m256d)row[2 * i + 1]);
        odd[i] = _mm256_unpackhi_pd((__m256d)row[2 * i], (__m256d)row[2 * i + 1]);
    }
    row[0] = (V)_mm256_permute2f128_pd(even[0], even[1], 0x20);
    row[1] = (V)_mm256_permute2f128_pd(odd[0], odd[1], 0x20);
    row[2] = (V)_mm256_permute2f128_pd(even[0], even[1], 0x31);
    row[3] = (V)_mm256_permute2f128_pd(odd[0], odd[1], 0x31);
#else
    __m512d pair[2][4], quad[2][4];
    int odd, i;
    for (i = 0; i < 4; i++) {
        pair[0][i] = _mm512_unpacklo_pd((__m512d)row[2 * i], (__m512d)row[2 * i + 1]);
        pair[1][i] = _mm512_unpackhi_pd((__m512d)row[2 * i], (__m512d)row[2 * i + 1]);
    }
    for (odd = 0; odd < 2; odd++) {
        for (i = 0; i < 2; i++) {
            quad[i][0] = _mm512_shuffle_f64x2(pair[odd][2 * i], pair[odd][2 * i + 1], 0x88);
            quad[i][1] = _mm512_shuffle_f64x2(pair[odd][2 * i], pair[odd][2 * i + 1], 0xDD);
        }
        row[odd] = (V)_mm512_shuffle_f64x2(quad[0][0], quad[1][0], 0x88);
        row[odd + 2] = (V)_mm512_shuffle_f64x2(quad[0][1], quad[1][1], 0x88);
        row[odd + 4] = (V)_mm512_shuffle_f64x2(quad[0][0], quad[1][0], 0xDD);
        row[odd + 6] = (V)_mm512_shuffle_f64x2(quad[0][1], quad[1][1], 0xDD);
    }
#endif
}

/* tq_within, tq_settled, tq_slope, tq_towards, tq_half_tangent and tq_bands_of for every stream. */
TQ_WIDE V TQ_(tq_all_within)(V x, V low, V high)
{
    return TQ_(tq_either)(x < low, low, TQ_(tq_either)(x > high, high, x));
}

/* Absolute values. */
TQ_WIDE V TQ_(tq_sizes)(V x)
{
    return (V)((M)x & INT64_MAX);
}

TQ_WIDE V TQ_(tq_all_settled)(V x, V lowest)
{
    return (V)(~(TQ_(tq_sizes)(x) < (tq_real)1e-9 * lowest) & (M)x);
}

TQ_WIDE V TQ_(tq_all_slopes)(V slope, V last, V now, V rate, V furthest, V share, V lowest)
{
    V change = now - last;
    M goes_on = (TQ_(tq_sizes)(change) <= furthest) & (now != 0);
    return (V)(goes_on & (M)TQ_(tq_all_settled)(slope + share * (change * rate - slope), lowest));
}

TQ_WIDE V TQ_(tq_all_towards)(V gain, V wanted, V slew)
{
    V change = wanted - gain;
    V down = TQ_(tq_either)(change < -slew, gain - slew, wanted);
    return TQ_(tq_either)(change > slew, gain + slew, down);
}

TQ_WIDE void TQ_(tq_all_half_tangents)(V angle, V *numerator, V *denominator)
{
    V half = angle * (tq_real)0.5, z = half * half;
    *numerator = TQ_TANGENT_NUMERATOR(half, z);
    *denominator = TQ_TANGENT_DENOMINATOR(z);
}

TQ_WIDE void TQ_(tq_all_bands)(V frequency, V bandwidth, V band[6])
{
    const tq_real one = 1, two = 2;
    V n, d, k_n, k_d, scale, cosine, sine, root, share;
    TQ_(tq_all_half_tangents)(frequency, &n, &d);
    scale = one / (d * d + n * n);
    cosine = (d - n) * (d + n) * scale;
    sine = two * n * d * scale;
    TQ_(tq_all_half_tangents)(bandwidth, &n, &d);
    k_n = two * n * d;
    k_d = (d - n) * (d + n);
    scale = one / (k_d + k_n);
    share = k_d * scale;
    root = TQ_WIDE_SQRT(k_n * k_d);
    band[2] = -two * sine * sine * share;
    band[0] = band[2] - two * k_n * scale;
    band[1] = two * sine * cosine * share;
    band[3] = two * root * scale * cosine;
    band[4] = two * root * scale * sine;
    band[5] = root / (two * k_d * cosine);
}

/* Moves on to the cell that holds x where it is another. */
TQ_WIDE void TQ_(tq_find)(TQ_(tq_axis) *at, const tq_real *axis, int size, tq_real x, int l)
{
    int i = at->cell[l];
    while (i < size - 2 && x >= axis[i + 1])
        i++;
    while (i > 0 && x < axis[i])
        i--;
    at->cell[l] = i;
    at->low[l] = axis[i];
    at->high[l] = i == size - 2 ? (tq_real)INFINITY : axis[i + 1];
    at->width[l] = axis[i + 1] - axis[i];
}

/* The cells of hands that left theirs. */
TQ_WIDE void TQ_(tq_find_all)(const TQ_(tq_many) *s, TQ_(tq_hands) *hands, V speed, V force, M outside)
{
    int l;
    for TQ_EACH(l)
        if (outside[l]) {
            const tq_texture *t = &s->streams[l].texture;
            size_t node;
            TQ_(tq_find)(&hands->speed, t->speed_mm_s, t->speeds, speed[l], l);
            TQ_(tq_find)(&hands->force, t->force_n, t->forces, force[l], l);
            node = (size_t)hands->speed.cell[l] * (size_t)t->forces + (size_t)hands->force.cell[l];
            hands->corner[l] = t->values + tq_table_row(t->layers) * node;
        }
}

/* tq_hand_at for every stream. */
TQ_WIDE void TQ_(tq_hands_at)(const TQ_(tq_many) *s, TQ_(tq_hands) *hands, V speed, V force)
{
    M finite = (speed - speed) + (force - force) == 0, slow, light, outside;
    speed = (V)(finite & (M)speed);
    force = (V)(finite & (M)force);
    speed = TQ_(tq_sizes)(speed);
    slow = speed < s->lowest_speed;
    light = force < s->lowest_force;
    hands->ramp = TQ_(tq_all)(1);
    if (TQ_WIDE_ANY(slow | light)) {
        V pressed = (V)((force > 0) & (M)(force / s->lowest_force));
        V ramp = TQ_(tq_either)(slow, speed / s->lowest_speed, hands->ramp);
        hands->ramp = TQ_(tq_either)(light, ramp * pressed, ramp);
    }
    speed = TQ_(tq_all_within)(speed, s->lowest_speed, s->highest_speed);
    force = TQ_(tq_all_within)(force, s->lowest_force, s->highest_force);
    outside = (speed < hands->speed.low) | (speed >= hands->speed.high) | (force < hands->force.low) |
              (force >= hands->force.high);
    if (TQ_WIDE_ANY(outside))
        TQ_(tq_find_all)(s, hands, speed, force, outside);
    hands->x = (speed - hands->speed.low) / hands->speed.width;
    hands->y = (force - hands->force.low) / hands->force.width;
}

/* tq_locate for every stream. */
TQ_WIDE void TQ_(tq_locate_all)(TQ_(tq_many) *s)
{
    V force = s->force, size = TQ_(tq_sizes)(s->speed);
    M strokes = (size > 0) & (force > 0);
    s->above_grid = strokes & ((size > s->highest_speed) | (force > s->highest_force));
    s->below_grid = strokes & ((size < s->lowest_speed) | (force < s->lowest_force)) & ~s->above_grid;
}

/* tq_take_in for every stream, of readings at the update. */
TQ_WIDE void TQ_(tq_take_in_all)(TQ_(tq_many) *s, V speed, V force)
{
    const tq_texture *t = &s->streams->texture;
    M taken = (speed - speed) + (force - force) == 0;
    M lifts = taken & s->known & (s->force > 0) & ~(force > 0), waits;
    V one = TQ_(tq_all)(1), updates = TQ_(tq_either)(s->known, s->age / (tq_real)t->update_samples, one);
    V most = TQ_(tq_either)(updates > 1, updates, one), share = t->slope_share * updates, more, rate = 1 / updates;
    share = TQ_(tq_either)(share < 1, share, one);
    more = TQ_(tq_either)(2 * share < 1, 2 * share, one);
    s->off = (V)(~(lifts & ~s->leaving) & (M)s->off);
    waits = lifts & (s->off < t->release) & (s->age <= t->hold);
    taken &= ~waits;
    s->leaving = (s->leaving | lifts) & ~taken;
#define TQ_TURNED(slope, now, change, by)                                                               \
    s->now##_##slope = TQ_(tq_either)(                                                                  \
        taken, (V)(s->known & (M)TQ_(tq_all_slopes)(s->now##_##slope, s->now, now, rate, change * most, by, \
                                                    s->lowest_##now)),                                  \
        s->now##_##slope)
    TQ_TURNED(slope, speed, t->speed_change, share);
    TQ_TURNED(slope, force, t->force_change, share);
    TQ_TURNED(turn, speed, t->speed_change, more);
    TQ_TURNED(turn, force, t->force_change, more);
#undef TQ_TURNED
    s->speed = TQ_(tq_either)(taken, TQ_(tq_all_settled)(speed, s->lowest_speed), s->speed);
    s->force = TQ_(tq_either)(taken, TQ_(tq_all_settled)(force, s->lowest_force), s->force);
    s->age = (V)(~taken & (M)s->age);
    s->known |= taken;
}

/* tq_follow for every stream, behind the reading of its hand; whether any hand is elsewhere than at the
   last update. */
TQ_WIDE int TQ_(tq_follow_all)(TQ_(tq_many) *s)
{
    const tq_texture *t = &s->streams->texture;
    tq_real to_end = s->to_end;
    tq_real read[2][TQ_W] = {{0}};
    V speed = s->speed, force = s->force, speed_slope = s->speed_slope, force_slope = s->force_slope;
    V read_speed, read_force, past = s->updates_ago;
    M held, kept;
    int l;
    for TQ_EACH(l)
        if (s->reading < s->streams[l].count) {
            read[0][l] = s->streams[l].speed[s->reading];
            read[1][l] = s->streams[l].force[s->reading];
        }
    TQ_COPY(&read_speed, read[0], sizeof read_speed);
    TQ_COPY(&read_force, read[1], sizeof read_force);
    if (s->position != 0) {
        s->age += (tq_real)t->update_samples;
        s->off += (tq_real)t->update_samples;
    }
    TQ_(tq_take_in_all)(s, read_speed, read_force);
    kept = ~(s->age > t->hold);
    s->known &= kept, s->leaving &= kept;
    s->speed = (V)(kept & (M)s->speed), s->force = (V)(kept & (M)s->force);
    s->speed_slope = (V)(kept & (M)s->speed_slope), s->force_slope = (V)(kept & (M)s->force_slope);
    s->age = (V)(kept & (M)s->age), s->off = (V)(kept & (M)s->off);
    s->speed_turn = (V)(kept & (M)s->speed_turn), s->force_turn = (V)(kept & (M)s->force_turn);
    s->updates_ago = s->age / (tq_real)t->update_samples;
    held = (speed == s->speed) & (force == s->force) & (speed_slope == s->speed_slope) &
           (force_slope == s->force_slope) & (past == s->updates_ago);
    if (s->position != 0 && !TQ_WIDE_ANY(~held))
        return 0;
    TQ_(tq_locate_all)(s);
    speed = s->speed + s->speed_turn * s->updates_ago;
    force = s->force + s->force_turn * s->updates_ago;
    TQ_(tq_hands_at)(s, &s->end, speed + s->speed_slope * to_end, force + s->force_slope * to_end);
    TQ_(tq_hands_at)(s, &s->amid, speed + s->speed_slope * s->to_middle,
                     force + s->force_slope * s->to_middle);
    return 1;
}

/* Values `from` to `to` at every stream's hand. */
TQ_WIDE void TQ_(tq_blend_rows)(TQ_(tq_many) *s, const TQ_(tq_hands) *hands, size_t from, size_t to)
{
    typedef TQ_(tq_unaligned) U;
    size_t row = tq_table_row(s->streams->texture.layers), i;
    V not_x = 1 - hands->x, not_y = 1 - hands->y;
    for (i = from; i < to; i += TQ_W) {
        V turned[TQ_W];
        int l;
        for TQ_EACH(l) {
            const tq_real *at = hands->corner[l] + i, *beside = at + s->beside[l];
            V low = *(const U *)at * not_x[l] + *(const U *)beside * hands->x[l];
            V high = *(const U *)(at + row) * not_x[l] + *(const U *)(beside + row) * hands->x[l];
            turned[l] = low * not_y[l] + high * hands->y[l];
        }
        TQ_(tq_turn)(turned);
        for TQ_EACH(l)
            s->blended[i + (size_t)l] = turned[l];
    }
}

/* tq_update_layers for every stream and one layer, but for the coefficients of hands that are where they
   were; where values were moved into the legal range. */
TQ_WIDE M TQ_(tq_update_layer)(TQ_(tq_many) *s, size_t i, int moving)
{
    const tq_texture *t = &s->streams->texture;
    size_t gains = tq_gains_at(t->layers);
    tq_real highest = (tq_real)0.49 * t->model_rate_hz, widest = (tq_real)0.45 * t->model_rate_hz;
    V f = s->blended[2 * i], b = s->blended[2 * i + 1];
    V wanted = s->blended[gains + 1 + i], now, next;
    V f_legal = TQ_(tq_all_within)(f, TQ_(tq_all)(1), TQ_(tq_all)(highest));
    V b_legal = TQ_(tq_all_within)(b, TQ_(tq_all)((tq_real)0.1), TQ_(tq_all)(widest));
    wanted = (V)(~(TQ_AT(TQ_SIGN, i) * wanted < 0) & (M)wanted) * s->end.ramp;
    now = s->position == 0 ? wanted : TQ_AT(TQ_GAIN, i);
    next = TQ_AT(TQ_GAIN, i) = TQ_(tq_all_towards)(now, wanted, TQ_AT(TQ_SLEW, i));
    if (moving) {
        V band[6];
        TQ_(tq_all_bands)(s->angle * f_legal, s->angle * b_legal, band);
        TQ_AT(TQ_P, i) = band[0], TQ_AT(TQ_Q, i) = band[1], TQ_AT(TQ_R, i) = band[2];
        TQ_AT(TQ_B1, i) = band[3], TQ_AT(TQ_B2, i) = band[4], TQ_AT(TQ_TAP, i) = band[5];
    }
    TQ_AT(TQ_NOW, i) = now * TQ_AT(TQ_TAP, i);
    TQ_AT(TQ_STEP, i) = (next - now) * s->per_sample * TQ_AT(TQ_TAP, i);
    return (f != f_legal) | (b != b_legal);
}

/* Counts values moved into the legal range. */
TQ_WIDE void TQ_(tq_count_moved)(TQ_(tq_many) *s)
{
    const tq_texture *t = &s->streams->texture;
    tq_real highest = (tq_real)0.49 * t->model_rate_hz, widest = (tq_real)0.45 * t->model_rate_hz;
    int l, i;
    for TQ_EACH(l)
        for (i = 0; i < t->layers && s->reading < s->streams[l].count; i++) {
            tq_real f = s->blended[2 * i][l], b = s->blended[2 * i + 1][l];
            s->streams[l].counters.clamped +=
                (uint64_t)(tq_moved(f, tq_within(f, 1, highest)) +
                           tq_moved(b, tq_within(b, (tq_real)0.1, widest)));
        }
}

/* tq_update_floor for every stream. */
TQ_WIDE void TQ_(tq_update_floors)(TQ_(tq_many) *s)
{
    V wanted = s->blended[tq_gains_at(s->streams->texture.layers)];
    wanted = (V)(~(wanted < 0) & (M)wanted) * s->end.ramp;
    s->floor_now = s->position == 0 ? wanted : s->floor_gain;
    s->floor_gain = TQ_(tq_all_towards)(s->floor_now, wanted, s->floor_slew);
    s->floor_step = (s->floor_gain - s->floor_now) * s->per_sample;
}

/* tq_update for every stream. */
TQ_WIDE void TQ_(tq_update_all)(TQ_(tq_many) *s)
{
    const tq_texture *t = &s->streams->texture;
    int moving = TQ_(tq_follow_all)(s);
    size_t i;
    M moved = {0};
    if (moving) {
        TQ_(tq_blend_rows)(s, &s->amid, 0, tq_gains_at(t->layers));
        TQ_(tq_blend_rows)(s, &s->end, tq_gains_at(t->layers), tq_table_row(t->layers));
    }
    TQ_(tq_update_floors)(s);
    for (i = 0; i < (size_t)t->layers; i++)
        moved |= TQ_(tq_update_layer)(s, i, moving);
    if (TQ_WIDE_ANY(moved))
        TQ_(tq_count_moved)(s);
}

/* tq_layers for every stream. */
TQ_WIDE void TQ_(tq_layers_all)(TQ_(tq_many) *s, size_t first, int width, const V *w,
                                V *out, int count)
{
    V s1[TQ_SIDE_BY_SIDE], s2[TQ_SIDE_BY_SIDE], now[TQ_SIDE_BY_SIDE];
    V step[TQ_SIDE_BY_SIDE], p[TQ_SIDE_BY_SIDE], q[TQ_SIDE_BY_SIDE], r[TQ_SIDE_BY_SIDE];
    V b1[TQ_SIDE_BY_SIDE], b2[TQ_SIDE_BY_SIDE];
    int n, i;
#define TQ_HERE(row) TQ_AT(row, first + (size_t)i)
    for (i = 0; i < width; i++) {
        s1[i] = TQ_HERE(TQ_S1), s2[i] = TQ_HERE(TQ_S2);
        p[i] = TQ_HERE(TQ_P), q[i] = TQ_HERE(TQ_Q), r[i] = TQ_HERE(TQ_R);
        b1[i] = TQ_HERE(TQ_B1), b2[i] = TQ_HERE(TQ_B2);
        now[i] = TQ_HERE(TQ_NOW), step[i] = TQ_HERE(TQ_STEP);
    }
    for (n = 0; n < count; n++) {
        V x = w[n], y = out[n];
        for (i = 0; i < width; i++) {
            V turned1 = (s1[i] + b1[i] * x) + (p[i] * s1[i] - q[i] * s2[i]);
            V turned2 = (s2[i] + b2[i] * x) + (r[i] * s2[i] + q[i] * s1[i]);
            now[i] += step[i];
            y += now[i] * (s1[i] + turned1);
            s1[i] = turned1;
            s2[i] = turned2;
        }
        out[n] = y;
    }
    for (i = 0; i < width; i++)
        TQ_HERE(TQ_S1) = s1[i], TQ_HERE(TQ_S2) = s2[i], TQ_HERE(TQ_NOW) = now[i];
#undef TQ_HERE
}

/* tq_filter for every stream. */
TQ_WIDE void TQ_(tq_filter_all)(TQ_(tq_many) *s, const V *w, V *out, int count)
{
    size_t layers = (size_t)s->streams->texture.layers, i = 0;
    V now = s->floor_now;
    int n;
    for (n = 0; n < count; n++) {
        now += s->floor_step;
        out[n] = now * w[n];
    }
    s->floor_now = now;
    for (; i + TQ_SIDE_BY_SIDE <= layers; i += TQ_SIDE_BY_SIDE)
        TQ_(tq_layers_all)(s, i, TQ_SIDE_BY_SIDE, w, out, count);
    switch (layers - i) {
    case 3: TQ_(tq_layers_all)(s, i, 3, w, out, count); break;
    case 2: TQ_(tq_layers_all)(s, i, 2, w, out, count); break;
    case 1: TQ_(tq_layers_all)(s, i, 1, w, out, count); break;
    default: break;
    }
}

/* tq_noise for every stream. The conversion from 53 bits, in two halves, is exact. */
TQ_WIDE V TQ_(tq_noise_all)(TQ_(tq_bits) key, uint64_t position)
{
    TQ_(tq_bits) z = key + (position + 1) * UINT64_C(0x9E3779B97F4A7C15), high, low;
    V upper, lower;
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    z ^= z >> 31;
    high = (z >> 43) | UINT64_C(0x4530000000000000);                            /* 2^84 + 2^32 high */
    low = ((z >> 11) & UINT64_C(0xFFFFFFFF)) | UINT64_C(0x4330000000000000);    /* 2^52 + low */
    upper = (V)high - ((tq_real)0x1p84 + (tq_real)0x1p52);
    lower = (V)low;
    return ((upper + lower) * (tq_real)0x1p-52 - 1) * (tq_real)1.7320508075688772;
}

/* tq_double for every stream. */
TQ_WIDE void TQ_(tq_double_all)(const tq_real *weights, const V *x, V *out, int width)
{
    V sum[2][2];
    int tap, n;
    for (n = 0; n < width; n++)
        sum[n][0] = weights[0] * x[n], sum[n][1] = weights[1] * x[n];
    for (tap = 1; tap < TQ_DOUBLING; tap++)
        for (n = 0; n < width; n++) {
            sum[n][0] += weights[2 * tap] * x[tap + n];
            sum[n][1] += weights[2 * tap + 1] * x[tap + n];
        }
    for (n = 0; n < width; n++)
        out[2 * n] = sum[n][0], out[2 * n + 1] = sum[n][1];
}

/* tq_between for every stream. */
TQ_WIDE V TQ_(tq_between_all)(const tq_real *weights, const V *x)
{
    V even = weights[0] * x[0], odd = weights[1] * x[1];
    int tap;
    for (tap = 2; tap < TQ_PHASE; tap += 2) {
        even += weights[tap] * x[tap];
        odd += weights[tap + 1] * x[tap + 1];
    }
    return even + odd;
}

/* tq_interpolate for every stream. */
TQ_WIDE void TQ_(tq_interpolate_all)(TQ_(tq_many) *s, int samples, V *out, size_t count)
{
    const tq_texture *t = &s->streams->texture;
    const V *x = s->doubled + s->phase / t->up;
    V *fresh = s->doubled + TQ_PHASE + 1;
    int phase = s->phase % t->up, i = 0;
    size_t n;
    for (; i + 2 <= samples; i += 2)
        TQ_(tq_double_all)(t->doubling, s->past + i, fresh + 2 * i, 2);
    if (i < samples)
        TQ_(tq_double_all)(t->doubling, s->past + i, fresh + 2 * i, 1);
    for (n = 0; n < count; n++) {
        out[n] = TQ_(tq_between_all)(t->phases + (size_t)phase * TQ_PHASE, x);
        for (phase += t->down; phase >= t->up; phase -= t->up)
            x++;
    }
    TQ_MOVE(s->past, s->past + samples, (TQ_DOUBLING - 1) * sizeof(V));
    TQ_MOVE(s->doubled, s->doubled + 2 * samples, (TQ_PHASE + 1) * sizeof(V));
    s->phase = tq_phase_after(t, s->phase, samples, count);
}

/* A chunk of every stream to where it belongs, but no further than to its end. */
TQ_WIDE void TQ_(tq_hand_out)(const TQ_(tq_many) *s, V *out, size_t from, size_t count)
{
    typedef TQ_(tq_unaligned) U;
    size_t n, k;
    int l;
    for (n = 0; n + TQ_W <= count; n += TQ_W) {
        TQ_(tq_turn)(out + n);
        for TQ_EACH(l) {
            const tq_stream *stream = s->streams + l;
            if (from + n + TQ_W <= stream->count)
                *(U *)(stream->out + from + n) = out[n + (size_t)l];
            else
                for (k = 0; from + n + k < stream->count; k++)
                    stream->out[from + n + k] = out[n + (size_t)l][k];
        }
    }
    for (; n < count; n++)
        for TQ_EACH(l)
            if (from + n < s->streams[l].count)
                s->streams[l].out[from + n] = out[n][l];
}

/* Hands every stream out, behind tq_restrain. */
TQ_WIDE void TQ_(tq_finish_all)(TQ_(tq_many) *s, V *out, size_t from, size_t count)
{
    const tq_texture *t = &s->streams->texture;
    int l;
    TQ_(tq_hand_out)(s, out, from, count);
    for TQ_EACH(l) {
        tq_stream *stream = s->streams + l;
        size_t left = stream->count < from ? 0 : stream->count - from;
        int mine = (int)(left < count ? left : count);
        if (!mine)
            continue;
        s->limited[l].counters.lift_offs +=
            tq_lift_offs(stream->speed + from, stream->force + from, 1, mine);
        tq_restrain(t, s->limited + l, stream->out + from, mine);
    }
}

/* Samples above and below the grid, as many as there are of each stream, of `piece` from `from` on. */
TQ_WIDE void TQ_(tq_count_grid)(TQ_(tq_many) *s, size_t from, size_t piece)
{
    M mine = (M){0} + (int64_t)piece;
    int l;
    if (from + piece > s->shortest)
        for TQ_EACH(l) {
            size_t count = s->streams[l].count, left = count < from ? 0 : count - from;
            mine[l] = (int64_t)(left < piece ? left : piece);
        }
    s->samples_above += s->above_grid & mine;
    s->samples_below += s->below_grid & mine;
}

/* tq_start for every stream. */
TQ_WIDE void TQ_(tq_start_all)(TQ_(tq_many) *s, tq_stream *streams, tq_real *memory)
{
    const tq_texture *t = &streams->texture;
    tq_real notch_angle = (tq_real)3.141592653589793 / t->rate_hz;
    size_t layers = (size_t)t->layers, i;
    int l;
    TQ_FILL(s, 0, sizeof *s);
    s->streams = streams;
    s->angle = (tq_real)3.141592653589793 / t->model_rate_hz;
    s->phase = 2 * t->up;
    s->per_sample = 1 / (tq_real)t->update_samples;
    s->to_end = (tq_real)(t->update_samples - 1) / (tq_real)t->update_samples;
    s->to_middle = s->to_end / 2 + t->lead;
    s->to_end += t->lead;
    s->shortest = s->longest = streams->count;
    s->rows = (V *)memory;
    s->past = s->rows + TQ_ALL_ROWS * layers;
    s->doubled = s->past + TQ_KEPT;
    s->blended = s->doubled + TQ_KEPT_DOUBLED;
    TQ_FILL(memory, 0, (TQ_ALL_ROWS * layers + TQ_KEPT + TQ_KEPT_DOUBLED) * sizeof(V));
    for TQ_EACH(l) {
        const tq_texture *mine = &streams[l].texture;
        size_t count = streams[l].count;
        s->shortest = count < s->shortest ? count : s->shortest;
        s->longest = count > s->longest ? count : s->longest;
        s->keys[l] = streams[l].key;
        s->lowest_speed[l] = mine->speed_mm_s[0];
        s->highest_speed[l] = mine->speed_mm_s[mine->speeds - 1];
        s->lowest_force[l] = mine->force_n[0];
        s->highest_force[l] = mine->force_n[mine->forces - 1];
        s->floor_slew[l] = mine->slews[0];
        s->beside[l] = (size_t)mine->forces * tq_table_row(t->layers);
        s->amid.speed.low[l] = s->end.speed.low[l] = (tq_real)INFINITY; /* no cell yet */
        for (i = 0; i < layers; i++)
            TQ_AT(TQ_SIGN, i)[l] = mine->signs[i], TQ_AT(TQ_SLEW, i)[l] = mine->slews[1 + i];
        if (t->notch_share != 0)
            s->limited[l].notch = tq_band_of(notch_angle * t->notch_hz, notch_angle * t->notch_width_hz);
    }
}

/* tq_render_model for every stream, from sample `from` of the output on; `left` is until the next update. */
TQ_WIDE void TQ_(tq_render_models)(TQ_(tq_many) *s, V *out, int samples, size_t from, size_t count,
                                   int *left)
{
    const tq_texture *t = &s->streams->texture;
    V w[TQ_CHUNK];
    size_t counted = 0;
    int done = 0, n;
    for (n = 0; n < samples; n++)
        w[n] = TQ_(tq_noise_all)(s->keys, s->position + (uint64_t)n);
    while (done < samples) {
        int piece;
        if (*left == 0) {
            size_t now = tq_outputs_before(t, s->phase, done);
            TQ_(tq_count_grid)(s, from + counted, now - counted);
            counted = now;
            s->reading = from + now;
            TQ_(tq_update_all)(s);
            *left = t->update_samples;
        }
        piece = *left < samples - done ? *left : samples - done;
        TQ_(tq_filter_all)(s, w + done, out + done, piece);
        s->position += (size_t)piece;
        done += piece;
        *left -= piece;
    }
    TQ_(tq_count_grid)(s, from + counted, count - counted);
}

/* What is rendered, for TQ_WIDE_LANES streams from start to end. */
static TQ_WIDE_TARGET void TQ_(tq_together)(tq_stream *streams, tq_real *memory)
{
    const tq_texture *t = &streams->texture;
    TQ_(tq_many) many, *s = &many;
    V out[TQ_CHUNK];
    size_t from = 0, chunk;
    int left = 0;
    int l;
    TQ_(tq_start_all)(s, streams, memory);
    for (; from < s->longest; from += chunk) {
        size_t rest = s->longest - from;
        int samples;
        chunk = rest < TQ_CHUNK ? rest : TQ_CHUNK;
        samples = tq_samples_for(t, s->phase, chunk);
        TQ_(tq_render_models)(s, t->up ? s->past + TQ_DOUBLING - 1 : out, samples, from, chunk, &left);
        if (t->up)
            TQ_(tq_interpolate_all)(s, samples, out, chunk);
        TQ_(tq_finish_all)(s, out, from, chunk);
    }
    for TQ_EACH(l) {
        tq_counters *counters = &streams[l].counters, *limited = &s->limited[l].counters;
        counters->lift_offs = limited->lift_offs;
        counters->above_grid = (uint64_t)s->samples_above[l];
        counters->below_grid = (uint64_t)s->samples_below[l];
        counters->peak = limited->peak, counters->rms = limited->rms;
        counters->duration = limited->duration;
    }
}

#undef V
#undef M
#undef TQ_AT
#undef TQ_SIGN
#undef TQ_SLEW
#undef TQ_TAP
#undef TQ_ALL_ROWS
#undef TQ_W
#undef TQ_
#undef TQ_WIDE
#undef TQ_EACH
#undef TQ_WIDE_NAME
#undef TQ_WIDE_SQRT
#undef TQ_WIDE_ANY
#undef TQ_WIDE_LANES
#undef TQ_WIDE_TARGET
