/* A model as it is uploaded: the members of a tq_texture as data, checked before they are used.
   docs/device.md#models

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_MODEL_H
#define TQ_MODEL_H

#include "registers.h"
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

/* Which of the reals before the arrays is out of its range, from MODEL_RATE_HZ on; 0 for none. */
static inline int tq_scalar_fault(const tq_real *r, tq_real rate_hz)
{
    const tq_real any = TQ_LARGEST_VALUE, peak = TQ_LARGEST_PEAK, band = rate_hz / 2 * (tq_real)0.9;
    const struct {
        tq_real low, high;
        int above, below; /* without its end */
    } range[TQ_MODEL_SCALARS] = {
        { rate_hz, rate_hz, 0, 0 }, { 0, any, 0, 0 }, { 0, any, 0, 0 }, { 0, 1, 1, 0 }, { 0, any, 0, 0 },
        { 0, any, 0, 0 }, { 0, peak, 1, 0 }, { 0, peak * peak, 1, 0 }, { 0, 1, 1, 0 }, { 0, 1, 1, 0 },
        { 1, band, 0, 0 }, { 1, band, 0, 0 }, { 0, 1, 0, 1 }
    };
    int n;
    for (n = 0; n < TQ_MODEL_SCALARS; n++) {
        if ((n == 10 || n == 11) && r[12] == 0) /* no notch */
            continue;
        if (!(r[n] >= range[n].low && r[n] <= range[n].high) || (range[n].above && r[n] <= range[n].low)
            || (range[n].below && r[n] >= range[n].high)) /* NaN is not within */
            return TQD_MODELFAULT_MODEL_RATE_HZ + n;
    }
    return 0;
}

/* The texture in an upload of `size` bytes, for an output at `rate_hz`; its arrays stay in the upload.
   0 where it is one that can be rendered, or what is wrong with it: nothing of another one may be used. */
static inline int tq_model_fault(tq_upload *upload, size_t size, tq_real rate_hz, tq_texture *t)
{
    const uint8_t *b = upload->bytes;
    const tq_real *r = upload->reals + TQ_MODEL_HEADER / sizeof(tq_real);
    uint32_t update, longest, pause;
    size_t layers, rows;
    int fault;
    if (size < TQ_MODEL_HEADER || size > sizeof upload->bytes)
        return TQD_MODELFAULT_SIZE;
    if (memcmp(b, "TQM1", 4) || b[4] != sizeof(tq_real))
        return TQD_MODELFAULT_HEAD;
    if (b[5] > TQ_MOST_LAYERS)
        return TQD_MODELFAULT_LAYERS;
    if (b[6] < 2 || b[7] < 2)
        return TQD_MODELFAULT_GRID;
    memset(t, 0, sizeof *t);
    layers = b[5], t->layers = b[5], t->speeds = b[6], t->forces = b[7];
    rows = (size_t)b[6] * b[7];
    if (size != TQ_MODEL_HEADER + sizeof(tq_real) * ((size_t)TQ_MODEL_SCALARS + b[6] + b[7] + layers + 1 + layers
                                                     + rows * (1 + 3 * layers)))
        return TQD_MODELFAULT_SIZE;
    memcpy(&update, b + 8, 4), memcpy(&longest, b + 12, 4), memcpy(&pause, b + 16, 4);
    if (update < 1 || update > 1000)
        return TQD_MODELFAULT_UPDATE_SAMPLES;
    if (longest < 1)
        return TQD_MODELFAULT_LONGEST;
    if (pause < 1)
        return TQD_MODELFAULT_PAUSE;
    t->rate_hz = t->model_rate_hz = r[0];
    t->speed_change = r[1], t->force_change = r[2], t->slope_share = r[3], t->hold = r[4], t->release = r[5];
    t->peak = r[6], t->mean_square = r[7], t->mean_share = r[8], t->silence = r[9];
    t->notch_hz = r[10], t->notch_width_hz = r[11], t->notch_share = r[12];
    t->update_samples = (int)update, t->longest = longest, t->pause = pause;
    t->speed_mm_s = r + TQ_MODEL_SCALARS, t->force_n = t->speed_mm_s + t->speeds;
    t->signs = t->force_n + t->forces, t->slews = t->signs + layers, t->values = t->slews + 1 + layers;
    if ((fault = tq_scalar_fault(r, rate_hz)) != 0)
        return fault;
    if (!tq_rises(t->speed_mm_s, t->speeds) || !(t->speed_mm_s[t->speeds - 1] <= TQ_LARGEST_VALUE))
        return TQD_MODELFAULT_SPEED_MM_S;
    if (!tq_rises(t->force_n, t->forces) || !(t->force_n[t->forces - 1] <= TQ_LARGEST_VALUE))
        return TQD_MODELFAULT_FORCE_N;
    if (!tq_all_within(t->signs, layers, -1, 1))
        return TQD_MODELFAULT_SIGNS;
    if (!tq_all_within(t->slews, layers + 1, 0, TQ_LARGEST_GAIN))
        return TQD_MODELFAULT_SLEWS;
    return tq_rows_hold(t) ? 0 : TQD_MODELFAULT_VALUES;
}

#endif
