/* Many streams side by side: what kernel.h does for one stream, for up to TQ_STREAMS of them in one go,
   one per lane of the processor's vectors. docs/method/rendering.md#many-streams

   Bits are those of tq_render: its own functions run in loops over the streams, which the compiler
   turns into vectors. For GCC and Clang. Compile with the kernel's flags and -fno-trapping-math, which
   changes no result but lets both ways of a choice be computed.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_MANY_H
#define TQ_MANY_H

#define TQ_LANES 1 /* of kernel.h: its functions work on single reals */
#include "kernel.h"

/* Vectors wider than every x86-64 has, chosen when it runs; TQ_BASELINE does without. */
#if defined __x86_64__ && !defined TQ_BASELINE
#include <immintrin.h>
#define TQ_WIDER
#endif

enum {
    TQ_STREAMS = 8,   /* in one call at most */
    TQ_MORE_ROWS = 3, /* than the kernel has: signs, slews, taps */
    TQ_BLOCK = 8      /* values of a table come in blocks of so many */
};

/* Where the gains begin in a row of a table, which holds f and B of every layer in turn, filled up to
   whole blocks; then noise gain and all gains, filled up likewise. */
static inline size_t tq_gains_at(int layers)
{
    return ((size_t)(2 * layers) + TQ_BLOCK - 1) / TQ_BLOCK * TQ_BLOCK;
}

/* The length of such a row. */
static inline size_t tq_table_row(int layers)
{
    return tq_gains_at(layers) + (size_t)(layers + TQ_BLOCK) / TQ_BLOCK * TQ_BLOCK;
}

/* Reals of memory that a call needs; the last ones are for alignment. */
static inline size_t tq_many_memory(int layers)
{
    size_t rows = (size_t)((TQ_ROWS + TQ_MORE_ROWS) * layers);
    size_t values = rows + TQ_KEPT + TQ_KEPT_DOUBLED + tq_table_row(layers);
    return TQ_STREAMS * values + 8;
}

/* One stream: what is rendered, with `values` in rows as above; by which hand, of how many samples,
   where to, and what was corrected. Layers, rates and update_samples are the same in one call;
   a count of 0 leaves a lane empty. */
typedef struct {
    tq_texture texture;
    uint64_t key;
    const tq_real *speed, *force;
    tq_real *out;
    size_t count;
    tq_counters counters;
} tq_stream;

/* For every width: the square roots, whether any of a mask's elements is set, and TQ_WIDE_LANES vectors
   turned from rows into columns. */
#define TQ_WIDE_NAME(name) name##_2
#define TQ_WIDE_LANES 2
#define TQ_WIDE_TARGET
#ifdef TQ_WIDER
#define TQ_WIDE_SQRT(x) ((tq_vector_2)_mm_sqrt_pd((__m128d)(x)))
#define TQ_WIDE_ANY(mask) (_mm_movemask_pd((__m128d)(mask)) != 0)
#else
#define TQ_WIDE_SQRT(x) ((tq_vector_2){TQ_SQRT((x)[0]), TQ_SQRT((x)[1])})
#define TQ_WIDE_ANY(mask) (((mask)[0] | (mask)[1]) != 0)
#endif
#include "many_lanes.h"

#ifdef TQ_WIDER
#define TQ_WIDE_NAME(name) name##_4
#define TQ_WIDE_LANES 4
#define TQ_WIDE_TARGET __attribute__((target("avx2")))
#define TQ_WIDE_SQRT(x) ((tq_vector_4)_mm256_sqrt_pd((__m256d)(x)))
#define TQ_WIDE_ANY(mask) (_mm256_movemask_pd((__m256d)(mask)) != 0)
#include "many_lanes.h"

#define TQ_WIDE_NAME(name) name##_8
#define TQ_WIDE_LANES 8
#define TQ_WIDE_TARGET __attribute__((target("avx2,avx512f,avx512dq,avx512vl")))
#define TQ_WIDE_SQRT(x) ((tq_vector_8)_mm512_sqrt_pd((__m512d)(x)))
#define TQ_WIDE_ANY(mask) (_mm512_movepi64_mask((__m512i)(mask)) != 0)
#include "many_lanes.h"
#endif

/* Streams in one vector: the most that this processor has instructions for. */
static int tq_widest(void)
{
#ifdef TQ_WIDER
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl"))
        return 8;
    if (__builtin_cpu_supports("avx2"))
        return 4;
#endif
    return 2;
}

/* Fresh streams, as many as there are lanes, from position 0 to their ends: 2, 4 or 8 lanes, at most
   tq_widest(). `memory` holds tq_many_memory(layers) reals. */
static void tq_render_many(tq_stream *streams, tq_real *memory, int lanes)
{
    tq_real *aligned = memory + (64 - (uintptr_t)memory % 64) % 64 / sizeof(tq_real);
#ifdef TQ_WIDER
    if (lanes == 8) {
        tq_together_8(streams, aligned);
        return;
    }
    if (lanes == 4) {
        tq_together_4(streams, aligned);
        return;
    }
#endif
    (void)lanes;
    tq_together_2(streams, aligned);
}

#endif
