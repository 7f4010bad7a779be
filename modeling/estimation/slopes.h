/* Misfit, Fisher information and score of many spectra at once: what coherent.slopes and
   coherent.response of the same folder calculate; the bins of likelihood.bins_near; what
   fitting.blending asks of the middles of cells. docs/method/estimation.md#engines

   Places (bins, then the layers' own frequencies) are innermost everywhere, so that loops become vectors
   without -ffast-math. Sums run in TQ_SUMS parts, whatever the width of the processor's vectors: the bits
   are the same with any. For GCC and Clang.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_SLOPES_H
#define TQ_SLOPES_H

#include <math.h>
#include <stddef.h>
#include <string.h>

/* cffi binds no function that is marked so. */
#define TQ_INLINE static inline __attribute__((always_inline))

/* Vectors wider than every x86-64 has, chosen when it runs; TQ_BASELINE does without. */
#if defined __x86_64__ && !defined TQ_BASELINE
#define TQ_WIDER
#endif

enum {
    TQ_SUMS = 4,     /* parts of every sum over places */
    TQ_CONSTANTS = 7, /* per layer */
    TQ_CORNERS = 4
};

typedef double tq_part __attribute__((vector_size(TQ_SUMS * sizeof(double)), aligned(8), may_alias));

/* K spectra as in coherent.Observed, rows of `bins`; of `layers` layers each, without signs independent.
   What keeps layers from cancelling costs ½·cancelling·x², where x is how far a layer's log amplitude is
   beyond that of the response at its own frequency (up to highest_hz) and `log_share`; per_hz is π/fs. */
typedef struct {
    size_t rows, bins;
    int layers;
    double per_hz, highest_hz, least_power, cancelling, log_share;
    const double *power, *weight, *tangent, *cotangent, *line_hz;
} tq_spectra;

/* Places of one row, and what is expected there: `slope` has a row of `stride` for each parameter. */
typedef struct {
    size_t count, stride;
    double *tangent, *cotangent, *power, *slope, *constants, *along, *across;
} tq_places;

TQ_INLINE size_t tq_whole(size_t count)
{
    return (count + TQ_SUMS - 1) / TQ_SUMS * TQ_SUMS;
}

/* Doubles of memory that a call needs. */
static size_t tq_slopes_memory(int layers, size_t bins)
{
    size_t m = (size_t)layers;
    return (3 * m + 12) * tq_whole(bins + m) + TQ_CONSTANTS * m;
}

/* NaN stays NaN, as in NumPy. */
TQ_INLINE double tq_within(double x, double low, double high)
{
    double above = x < low ? low : x;
    return above > high ? high : above;
}

/* Divides up the memory for places; returns what is left of it. */
TQ_INLINE double *tq_divided(tq_places *at, int layers, size_t count, double *memory)
{
    size_t n = tq_whole(count);
    at->count = count;
    at->stride = n;
    at->tangent = memory;
    at->cotangent = memory + n;
    at->power = memory + 2 * n;
    at->along = memory + 3 * n;
    at->across = memory + 4 * n;
    at->slope = memory + 5 * n;
    at->constants = at->slope + (3 * (size_t)layers + 2) * n;
    return at->constants + TQ_CONSTANTS * (size_t)layers;
}

/* Of one layer: u = c[0]·cotangent − c[1]·tangent, its derivative by log frequency c[2]·cotangent −
   c[3]·u, by log bandwidth c[4]·u; d ln seen by d ln B c[5]; amplitude c[6]. coherent.response has the
   equations. */
TQ_INLINE void tq_layer(const double *theta, int m, double line_hz, double per_hz, double *c)
{
    double centre = exp(theta[0]), width = exp(theta[m]);
    double seen = hypot(width, line_hz), share = width / seen;
    double g = tan(per_hz * centre), k = tan(per_hz * seen);
    double scale = 1 / (k * (1 + g * g)), growth = 2 * g * per_hz * centre;
    c[0] = g * g * scale;
    c[1] = scale;
    c[2] = growth * (1 + g * g) * scale;
    c[3] = growth;
    c[4] = -per_hz * seen * (1 + k * k) / k;
    c[5] = share * share;
    c[6] = exp(theta[2 * m]) * sqrt(share);
}

/* Where a band is 1/(1 − ju): u, and 1/(1 + u²). */
TQ_INLINE void tq_band(const tq_places *at, const double *c, double *restrict u, double *restrict real)
{
    const double *restrict tangent = at->tangent, *restrict cotangent = at->cotangent;
    for (size_t n = 0; n < at->stride; n++) {
        u[n] = c[0] * cotangent[n] - c[1] * tangent[n];
        real[n] = 1 / (1 + u[n] * u[n]);
    }
}

/* From derivatives by u and by log amplitude to those by a layer's three parameters. Each place of u and
   real is read before it is written. */
TQ_INLINE void tq_chained(double by_u, double by_gain, double u, double cotangent, const double *c,
                          double *frequency, double *width, double *gain)
{
    *frequency = by_u * (c[2] * cotangent - c[3] * u);
    *width = c[5] * (by_u * (u * c[4])) + 0.5 * (1 - c[5]) * by_gain;
    *gain = by_gain;
}

/* Adds what one layer contributes to the derivative by the tangent of each place. */
TQ_INLINE double tq_beside(double by_u, double cotangent, const double *c)
{
    return -by_u * (c[0] * cotangent * cotangent + c[1]);
}

/* Power of one noise through all bands, and its relative derivatives; with `moved` those by the tangents
   of the places, too, in the row after the last parameter's. */
TQ_INLINE void tq_coherent(const tq_places *at, int m, double floor, const double *signs, double least,
                           int moved)
{
    size_t stride = at->stride;
    double *restrict in_phase = at->along, *restrict quadrature = at->across;
    double *restrict power = at->power, *restrict noise = at->slope;
    double *restrict beside = at->slope + (1 + 3 * m) * stride;
    const double *restrict cotangent = at->cotangent;
    if (moved)
        memset(beside, 0, stride * sizeof(double));
    for (size_t n = 0; n < stride; n++) {
        in_phase[n] = floor;
        quadrature[n] = 0;
    }
    for (int i = 0; i < m; i++) {
        double *c = at->constants + TQ_CONSTANTS * i, signed_gain = c[6] *= signs[i];
        double *restrict u = at->slope + (1 + i) * stride;
        double *restrict real = at->slope + (1 + 2 * m + i) * stride;
        tq_band(at, c, u, real);
        for (size_t n = 0; n < stride; n++) {
            in_phase[n] += signed_gain * real[n];
            quadrature[n] += signed_gain * (u[n] * real[n]);
        }
    }
    for (size_t n = 0; n < stride; n++) {
        double sum = in_phase[n] * in_phase[n] + quadrature[n] * quadrature[n];
        power[n] = sum <= least ? least : sum;
        in_phase[n] /= power[n];
        quadrature[n] /= power[n];
        noise[n] = 2 * floor * in_phase[n];
    }
    for (int i = 0; i < m; i++) {
        const double *c = at->constants + TQ_CONSTANTS * i;
        double *restrict frequency = at->slope + (1 + i) * stride;
        double *restrict width = at->slope + (1 + m + i) * stride;
        double *restrict gain = at->slope + (1 + 2 * m + i) * stride;
        double c0 = c[0], c1 = c[1], c2 = c[2], c3 = c[3], c4 = c[4], c5 = c[5], twice = 2 * c[6];
        const double own[TQ_CONSTANTS] = {c0, c1, c2, c3, c4, c5, 0};
        for (size_t n = 0; n < stride; n++) {
            double u = frequency[n], real = gain[n], along = in_phase[n], across = quadrature[n];
            double by_gain = twice * (real * along + (u * real) * across);
            double by_u = twice * (real * real) * ((1 - u * u) * across - 2 * u * along);
            if (moved)
                beside[n] += tq_beside(by_u, cotangent[n], own);
            tq_chained(by_u, by_gain, u, cotangent[n], own, frequency + n, width + n, gain + n);
        }
    }
}

/* The same for layers each with a noise of its own: powers add. */
TQ_INLINE void tq_independent(const tq_places *at, int m, double floor, double least, int moved)
{
    size_t stride = at->stride;
    double *restrict power = at->power, *restrict noise = at->slope;
    double *restrict beside = at->slope + (1 + 3 * m) * stride;
    const double *restrict cotangent = at->cotangent;
    if (moved)
        memset(beside, 0, stride * sizeof(double));
    for (size_t n = 0; n < stride; n++)
        power[n] = 0;
    for (int i = 0; i < m; i++) {
        const double *c = at->constants + TQ_CONSTANTS * i;
        double *restrict real = at->slope + (1 + 2 * m + i) * stride, square = c[6] * c[6];
        tq_band(at, c, at->slope + (1 + i) * stride, real);
        for (size_t n = 0; n < stride; n++)
            power[n] += square * real[n];
    }
    for (size_t n = 0; n < stride; n++) {
        double sum = floor * floor + power[n];
        power[n] = sum <= least ? least : sum;
        noise[n] = 2 * floor * floor / power[n];
    }
    for (int i = 0; i < m; i++) {
        const double *c = at->constants + TQ_CONSTANTS * i;
        double *restrict frequency = at->slope + (1 + i) * stride;
        double *restrict width = at->slope + (1 + m + i) * stride;
        double *restrict gain = at->slope + (1 + 2 * m + i) * stride;
        double c0 = c[0], c1 = c[1], c2 = c[2], c3 = c[3], c4 = c[4], c5 = c[5], twice = 2 * (c[6] * c[6]);
        const double own[TQ_CONSTANTS] = {c0, c1, c2, c3, c4, c5, 0};
        for (size_t n = 0; n < stride; n++) {
            double u = frequency[n], real = gain[n], share = twice * real / power[n];
            if (moved)
                beside[n] += tq_beside(-share * u * real, cotangent[n], own);
            tq_chained(-share * u * real, share, u, cotangent[n], own, frequency + n, width + n, gain + n);
        }
    }
}

/* What is expected at all places of one row. */
TQ_INLINE void tq_expected(const tq_places *at, int m, const double *theta, const double *signs,
                           double line_hz, double per_hz, double least, int moved)
{
    double floor = exp(theta[0]);
    for (size_t n = at->count; n < at->stride; n++) /* any that are finite; they have no weight */
        at->tangent[n] = at->cotangent[n] = 1;
    for (int i = 0; i < m; i++)
        tq_layer(theta + 1 + i, m, line_hz, per_hz, at->constants + TQ_CONSTANTS * i);
    if (signs)
        tq_coherent(at, m, floor, signs, least, moved);
    else
        tq_independent(at, m, floor, least, moved);
}

/* The sum of a part's lanes. */
TQ_INLINE double tq_sum(const tq_part *part)
{
    return ((*part)[0] + (*part)[1]) + ((*part)[2] + (*part)[3]);
}

/* Scalar products of two rows of a with two of b: a0·b0, a0·b1, a1·b0, a1·b1. */
TQ_INLINE void tq_products(const double *a, const double *b, size_t stride, double *out)
{
    tq_part sums[4] = {{0}, {0}, {0}, {0}};
    for (size_t n = 0; n < stride; n += TQ_SUMS) {
        const tq_part a0 = *(const tq_part *)(a + n), a1 = *(const tq_part *)(a + stride + n);
        const tq_part b0 = *(const tq_part *)(b + n), b1 = *(const tq_part *)(b + stride + n);
        sums[0] += a0 * b0;
        sums[1] += a0 * b1;
        sums[2] += a1 * b0;
        sums[3] += a1 * b1;
    }
    for (int i = 0; i < 4; i++)
        out[i] = tq_sum(&sums[i]);
}

/* Information Σ weight·slope·slope' and score Σ error·slope; `pair` holds two rows of places. */
TQ_INLINE void tq_gathered(const tq_places *at, int p, const double *weight, const double *error,
                           double *pair, double *information, double *score)
{
    size_t stride = at->stride;
    double found[4];
    memset(at->slope + (size_t)p * stride, 0, stride * sizeof(double)); /* beside the last one */
    for (int q = 0; q <= p; q += 2) { /* the errors come as one more row of weighted slopes */
        for (int own = 0; own < 2; own++) {
            const double *restrict slope = at->slope + (size_t)(q + own) * stride;
            double *restrict out = pair + (size_t)own * stride;
            if (q + own < p)
                for (size_t n = 0; n < stride; n++)
                    out[n] = weight[n] * slope[n];
            else
                memcpy(out, error, stride * sizeof(double));
        }
        for (int r = 0; r < p && r <= q + 1; r += 2) {
            tq_products(pair, at->slope + (size_t)r * stride, stride, found);
            for (int i = 0; i < 4; i++) {
                int a = q + i / 2, b = r + i % 2;
                if (b >= p || a > p)
                    continue;
                if (a == p)
                    score[b] = found[i];
                else if (b <= a)
                    information[a * p + b] = information[b * p + a] = found[i];
            }
        }
    }
}

/* Weights and errors of bins; returns their misfit. */
TQ_INLINE double tq_misfit(const tq_places *at, size_t bins, const double *power, double *weight,
                           double *error, double *ratio)
{
    double misfit = 0;
    for (size_t n = 0; n < bins; n++) {
        ratio[n] = weight[n] > 0 ? power[n] / at->power[n] : 1;
        error[n] = weight[n] * (ratio[n] - 1);
    }
    for (size_t n = 0; n < bins; n++)
        misfit += error[n] - weight[n] * log(ratio[n]);
    for (size_t n = bins; n < at->stride; n++)
        weight[n] = error[n] = 0;
    return misfit;
}

/* What cancelling layers cost. Their places become bins of the information and of the score. */
TQ_INLINE double tq_cancelling(const tq_spectra *of, const tq_places *at, size_t bins, const double *theta,
                               double *weight, double *error)
{
    int m = of->layers, p = 1 + 3 * m;
    double squares = 0;
    for (int i = 0; i < m; i++) {
        size_t n = bins + (size_t)i;
        double beyond = theta[1 + 2 * m + i] - 0.5 * log(at->power[n]) - of->log_share;
        if (beyond <= 0)
            continue;
        for (int q = 0; q < p; q++)
            at->slope[(size_t)q * at->stride + n] *= -0.5;
        at->slope[(size_t)(1 + 2 * m + i) * at->stride + n] += 1;
        weight[n] = of->cancelling;
        error[n] = -of->cancelling * beyond;
        squares += beyond * beyond;
    }
    return 0.5 * of->cancelling * squares;
}

TQ_INLINE void tq_all_slopes(const tq_spectra *of, const double *theta, const double *signs, double *memory,
                             double *misfit, double *objective, double *information, double *score)
{
    int m = of->layers, p = 1 + 3 * m;
    for (size_t row = 0; row < of->rows; row++) {
        size_t bins = of->bins, from = row * of->bins;
        const double *own = theta + row * (size_t)p, *up = signs ? signs + row * (size_t)m : NULL;
        while (bins && !(of->weight[from + bins - 1] > 0)) /* rows of fewer bins end in some without */
            bins--;
        tq_places at;
        double *weight = tq_divided(&at, m, up ? bins + (size_t)m : bins, memory);
        double *error = weight + at.stride, *pair = error + at.stride;
        memcpy(weight, of->weight + from, bins * sizeof(double));
        memcpy(at.tangent, of->tangent + from, bins * sizeof(double));
        memcpy(at.cotangent, of->cotangent + from, bins * sizeof(double));
        for (size_t n = bins; n < at.count; n++) {
            double centre = tq_within(exp(own[1 + n - bins]), 1, of->highest_hz);
            at.tangent[n] = tan(of->per_hz * centre);
            at.cotangent[n] = 1 / at.tangent[n];
        }
        tq_expected(&at, m, own, up, of->line_hz[row], of->per_hz, of->least_power, 0);
        misfit[row] = objective[row] = tq_misfit(&at, bins, of->power + from, weight, error, pair);
        if (up)
            objective[row] += tq_cancelling(of, &at, bins, own, weight, error);
        tq_gathered(&at, p, weight, error, pair, information + row * (size_t)(p * p),
                    score + row * (size_t)p);
    }
}

TQ_INLINE void tq_all_responses(const tq_spectra *of, const double *theta, const double *signs,
                                double *memory, double *power, double *slope, double *beside)
{
    int m = of->layers;
    size_t p = 1 + 3 * (size_t)m, bins = of->bins;
    for (size_t row = 0; row < of->rows; row++) {
        tq_places at;
        tq_divided(&at, m, bins, memory);
        memcpy(at.tangent, of->tangent + row * bins, bins * sizeof(double));
        memcpy(at.cotangent, of->cotangent + row * bins, bins * sizeof(double));
        tq_expected(&at, m, theta + row * p, signs ? signs + row * (size_t)m : NULL, of->line_hz[row],
                    of->per_hz, of->least_power, 1);
        memcpy(power + row * bins, at.power, bins * sizeof(double));
        for (size_t q = 0; q < p; q++)
            memcpy(slope + (row * p + q) * bins, at.slope + q * at.stride, bins * sizeof(double));
        memcpy(beside + row * bins, at.slope + p * at.stride, bins * sizeof(double));
    }
}

/* M cells with four corners each among N nodes; `steps` (4, 4) says which array of blocks
   couples two corners. `slope` (M + N, p, places) are relative derivatives of powers in the middles, then
   at the nodes; `off` (M, places) is what is held, 0 where nothing is: against the corner `lowest` (M,
   places), or where that is negative against the mean of all. */
typedef struct {
    size_t cells, nodes, places;
    int p;
    double held;
    const double *slope, *off, *shares;
    const ptrdiff_t *corners, *steps, *lowest;
} tq_cells;

/* Doubles of memory that tq_held needs. */
static size_t tq_held_memory(int p, size_t places)
{
    size_t all = TQ_CORNERS * (size_t)p;
    return (all + 5) * tq_whole(places) + all * all + all;
}

/* Slopes of what is off in one cell, by the parameters of its corners; 0 where nothing is held. */
TQ_INLINE void tq_pulls(const tq_cells *of, size_t cell, const tq_places *at, double *weight, double *error)
{
    size_t places = of->places, size = (size_t)of->p * places;
    const double *restrict off = of->off + cell * places, *middle = of->slope + cell * size;
    for (size_t n = 0; n < at->stride; n++) {
        double here = n < places ? off[n] : 0;
        weight[n] = here != 0 ? of->held : 0;
        error[n] = -of->held * here;
    }
    for (size_t a = 0; a < TQ_CORNERS; a++) {
        size_t node = (size_t)of->corners[TQ_CORNERS * cell + a];
        const double *corner = of->slope + (of->cells + node) * size;
        double share = of->shares[a];
        const ptrdiff_t *restrict lowest = of->lowest + cell * places;
        for (size_t q = 0; q < (size_t)of->p; q++) {
            double *restrict pull = at->slope + (a * (size_t)of->p + q) * at->stride;
            const double *restrict here = middle + q * places, *restrict there = corner + q * places;
            for (size_t n = 0; n < places; n++) { /* the level is half the logarithm of the power */
                double less = lowest[n] < 0 ? share : lowest[n] == (ptrdiff_t)a ? 1 : 0;
                pull[n] = 0.5 * (share * here[n] - less * there[n]);
            }
            for (size_t n = places; n < at->stride; n++)
                pull[n] = 0;
        }
    }
}

/* Adds one cell's information and score to those of its corners. */
TQ_INLINE void tq_added(const tq_cells *of, size_t cell, const double *from, const double *along,
                        double *blocks, double *score)
{
    size_t p = (size_t)of->p;
    for (size_t a = 0; a < TQ_CORNERS; a++) {
        size_t node = (size_t)of->corners[TQ_CORNERS * cell + a];
        for (size_t q = 0; q < p; q++)
            score[node * p + q] += along[a * p + q];
        for (size_t b = a; b < TQ_CORNERS; b++) {
            size_t step = (size_t)of->steps[TQ_CORNERS * a + b];
            double *restrict to = blocks + (step * of->nodes + node) * p * p;
            for (size_t q = 0; q < p; q++)
                for (size_t r = 0; r < p; r++)
                    to[q * p + r] += from[(a * p + q) * TQ_CORNERS * p + b * p + r];
        }
    }
}

TQ_INLINE void tq_all_held(const tq_cells *of, double *memory, double *blocks, double *score)
{
    size_t all = TQ_CORNERS * (size_t)of->p, n = tq_whole(of->places);
    tq_places at = {.count = of->places, .stride = n, .slope = memory};
    double *weight = memory + (all + 1) * n, *error = weight + n, *pair = error + n;
    double *information = pair + 2 * n, *along = information + all * all;
    for (size_t cell = 0; cell < of->cells; cell++) {
        const double *off = of->off + cell * of->places;
        size_t first = 0;
        while (first < of->places && off[first] == 0)
            first++;
        if (first == of->places)
            continue;
        tq_pulls(of, cell, &at, weight, error);
        tq_gathered(&at, (int)all, weight, error, pair, information, along);
        tq_added(of, cell, information, along, blocks, score);
    }
}

/* How a periodogram is binned, see likelihood.bins_near. */
typedef struct {
    size_t lines, peaks;
    double step_hz, per_hz, records, bin_share, peak_share, distance_share, forgiven;
    const double *frequency_hz, *power, *weight, *centres_hz, *widths_hz;
} tq_lines;

/* The widths of bins at each line. */
TQ_INLINE void tq_widths(const tq_lines *of, double *restrict width)
{
    const double *restrict frequency = of->frequency_hz;
    for (size_t n = 0; n < of->lines; n++)
        width[n] = fmax(of->bin_share * frequency[n], 2 * of->step_hz);
    for (size_t i = 0; i < of->peaks; i++) {
        double centre = of->centres_hz[i], least = of->peak_share * of->widths_hz[i];
        for (size_t n = 0; n < of->lines; n++) {
            double near = least + of->distance_share * fabs(frequency[n] - centre);
            width[n] = near < width[n] ? near : width[n];
        }
    }
    for (size_t n = 0; n < of->lines; n++)
        width[n] = of->step_hz / (width[n] < of->step_hz ? of->step_hz : width[n]);
}

/* Number of bins; `out` (6, lines) has in its first rows their power, weight, count, tangent and
   cotangent. */
static size_t tq_bins(const tq_lines *of, double *out)
{
    size_t lines = of->lines, bins = 0;
    double *width = out + 5 * lines, number = 0;
    tq_widths(of, width);
    for (size_t n = 0; n < lines;) {
        size_t start = n;
        double heard = 0, sum = 0, bin = 0;
        for (; n < lines; n++) {
            double next = number + width[n];
            if (n == start)
                bin = floor(next);
            else if (floor(next) != bin)
                break;
            number = next;
            heard += of->weight[n];
            sum += of->power[n] * of->weight[n];
        }
        if (!(heard > 0)) /* lines that the sensor's floor took whole say nothing */
            continue;
        double middle = of->frequency_hz[start] + (double)(n - start - 1) * of->step_hz / 2;
        double count = heard * of->records, tangent = tan(of->per_hz * middle);
        out[bins] = sum / heard;
        out[lines + bins] = count / (1 + count * of->forgiven);
        out[2 * lines + bins] = count;
        out[3 * lines + bins] = tangent;
        out[4 * lines + bins] = 1 / tangent;
        bins++;
    }
    return bins;
}

#ifdef TQ_WIDER
__attribute__((target("avx2"))) static inline void tq_wider_held(const tq_cells *of, double *memory,
                                                                 double *blocks, double *score)
{
    tq_all_held(of, memory, blocks, score);
}

__attribute__((target("avx2"))) static inline void tq_wider_slopes(
    const tq_spectra *of, const double *theta, const double *signs, double *memory, double *misfit,
    double *objective, double *information, double *score)
{
    tq_all_slopes(of, theta, signs, memory, misfit, objective, information, score);
}

__attribute__((target("avx2"))) static inline void tq_wider_responses(
    const tq_spectra *of, const double *theta, const double *signs, double *memory, double *power,
    double *slope, double *beside)
{
    tq_all_responses(of, theta, signs, memory, power, slope, beside);
}
#endif

/* Misfit and objective (K,), information (K, p, p) and score (K, p) at theta (K, p), p = 1 + 3·layers.
   `signs` (K, layers) may be NULL; `memory` has tq_slopes_memory(layers, bins). */
static void tq_slopes(const tq_spectra *of, const double *theta, const double *signs, double *memory,
                      double *misfit, double *objective, double *information, double *score)
{
#ifdef TQ_WIDER
    if (__builtin_cpu_supports("avx2")) {
        tq_wider_slopes(of, theta, signs, memory, misfit, objective, information, score);
        return;
    }
#endif
    tq_all_slopes(of, theta, signs, memory, misfit, objective, information, score);
}

/* Expected power (K, bins) and its relative derivatives, by parameters (K, p, bins) and by the tangents of
   the places (K, bins). */
static void tq_responses(const tq_spectra *of, const double *theta, const double *signs, double *memory,
                         double *power, double *slope, double *beside)
{
#ifdef TQ_WIDER
    if (__builtin_cpu_supports("avx2")) {
        tq_wider_responses(of, theta, signs, memory, power, slope, beside);
        return;
    }
#endif
    tq_all_responses(of, theta, signs, memory, power, slope, beside);
}

/* Adds information (arrays of blocks, N, p, p) and score (N, p) of all cells to what is there. */
static void tq_held(const tq_cells *of, double *memory, double *blocks, double *score)
{
#ifdef TQ_WIDER
    if (__builtin_cpu_supports("avx2")) {
        tq_wider_held(of, memory, blocks, score);
        return;
    }
#endif
    tq_all_held(of, memory, blocks, score);
}

#endif
