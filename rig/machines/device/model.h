/* A model as it is uploaded: the members of a tq_texture as data, checked before they are used.
   docs/device.md#models

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_MODEL_H
#define TQ_MODEL_H

#include "scene.h"

#include <string.h>

enum { TQ_CAPACITY = 2048, TQ_MOST_LAYERS = 8, TQ_MODEL_HEADER = 24, TQ_MODEL_SCALARS = 13 };
#define TQ_LARGEST_GAIN 1000 /* g */
#define TQ_LARGEST_PEAK 20   /* g */
#define TQ_LARGEST_VALUE 1000000

/* The bytes as they came; the reals in them are aligned. */
typedef union {
    uint8_t bytes[TQ_CAPACITY * sizeof(tq_real)];
    tq_real reals[TQ_CAPACITY];
} tq_upload;

/* FNV-1a, 64 bits. */
static inline uint64_t tq_hash(const uint8_t *bytes, size_t count)
{
    uint64_t hash = UINT64_C(0xCBF29CE484222325);
    for (; count; count--, bytes++)
        hash = (hash ^ *bytes) * UINT64_C(0x100000001B3);
    return hash;
}

static inline int tq_rises(const tq_real *axis, int size)
{
    int n;
    for (n = 0; n < size; n++)
        if (!(axis[n] > (n ? axis[n - 1] : 0)))
            return 0;
    return 1;
}

static inline int tq_all_within(const tq_real *values, size_t count, tq_real low, tq_real high)
{
    size_t n;
    for (n = 0; n < count; n++)
        if (!(values[n] >= low && values[n] <= high)) /* NaN is not */
            return 0;
    return 1;
}

/* Whether every row of the grid holds a noise gain, frequencies, bandwidths and gains. */
static inline int tq_rows_hold(const tq_texture *t)
{
    size_t rows = (size_t)t->speeds * (size_t)t->forces, layers = (size_t)t->layers, n;
    for (n = 0; n < rows; n++) {
        const tq_real *row = t->values + n * (1 + 3 * layers);
        if (!(tq_all_within(row, 1, 0, TQ_LARGEST_GAIN)
              && tq_all_within(row + 1, 2 * layers, -TQ_LARGEST_VALUE, TQ_LARGEST_VALUE)
              && tq_all_within(row + 1 + 2 * layers, layers, -TQ_LARGEST_GAIN, TQ_LARGEST_GAIN)))
            return 0;
    }
    return 1;
}

/* The texture in an upload of `size` bytes, for an output at `rate_hz`; its arrays stay in the upload.
   Whether it is one that can be rendered: nothing of another one may be used. */
static inline int tq_model_of(tq_upload *upload, size_t size, tq_real rate_hz, tq_texture *t)
{
    const uint8_t *b = upload->bytes;
    const tq_real *r = upload->reals + TQ_MODEL_HEADER / sizeof(tq_real);
    uint32_t update, longest, pause;
    size_t layers, rows;
    if (size < TQ_MODEL_HEADER || size > sizeof upload->bytes || memcmp(b, "TQM1", 4)
        || b[4] != sizeof(tq_real) || b[5] > TQ_MOST_LAYERS || b[6] < 2 || b[7] < 2)
        return 0;
    memset(t, 0, sizeof *t);
    layers = b[5], t->layers = b[5], t->speeds = b[6], t->forces = b[7];
    rows = (size_t)b[6] * b[7];
    if (size != TQ_MODEL_HEADER + sizeof(tq_real) * ((size_t)TQ_MODEL_SCALARS + b[6] + b[7] + layers + 1 + layers
                                                     + rows * (1 + 3 * layers)))
        return 0;
    memcpy(&update, b + 8, 4), memcpy(&longest, b + 12, 4), memcpy(&pause, b + 16, 4);
    t->rate_hz = t->model_rate_hz = r[0];
    t->speed_change = r[1], t->force_change = r[2], t->slope_share = r[3], t->hold = r[4], t->release = r[5];
    t->peak = r[6], t->mean_square = r[7], t->mean_share = r[8], t->silence = r[9];
    t->notch_hz = r[10], t->notch_width_hz = r[11], t->notch_share = r[12];
    t->update_samples = (int)update, t->longest = longest, t->pause = pause;
    t->speed_mm_s = r + TQ_MODEL_SCALARS, t->force_n = t->speed_mm_s + t->speeds;
    t->signs = t->force_n + t->forces, t->slews = t->signs + layers, t->values = t->slews + 1 + layers;
    return r[0] == rate_hz && update >= 1 && update <= 1000 && longest >= 1 && pause >= 1
           && tq_all_within(r + 1, 5, 0, TQ_LARGEST_VALUE) && r[3] > 0 && r[3] <= 1
           && r[6] > 0 && r[6] <= TQ_LARGEST_PEAK && r[7] > 0 && r[7] <= TQ_LARGEST_PEAK * TQ_LARGEST_PEAK
           && r[8] > 0 && r[8] <= 1 && r[9] > 0 && r[9] <= 1
           && r[12] >= 0 && r[12] < 1 && (r[12] == 0 || (tq_all_within(r + 10, 2, 1, rate_hz / 2 * (tq_real)0.9)))
           && tq_rises(t->speed_mm_s, t->speeds) && tq_rises(t->force_n, t->forces)
           && t->speed_mm_s[t->speeds - 1] <= TQ_LARGEST_VALUE && t->force_n[t->forces - 1] <= TQ_LARGEST_VALUE
           && tq_all_within(t->signs, layers, -1, 1) && tq_all_within(t->slews, layers + 1, 0, TQ_LARGEST_GAIN)
           && tq_rows_hold(t);
}

#endif
