/* What the processes of a rig share: readings of the hand, what was played, the session's heartbeat.
   docs/method/live.md#shared-memory

   One process writes readings, the audio callback of another one writes blocks; any process reads. No
   process waits for another. Both are rings: the writer fills the next slot, then increments the count.
   A reader copies a slot and checks the count again, to detect a slot that was overwritten meanwhile.

   C11, or C99 with GCC or Clang; 64-bit words are read and written atomically.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_LIVE_H
#define TQ_LIVE_H

#include "clock.h"

#define TQ_LIVE_FORMAT 0x7471000000000004u /* changes with anything in this file */
#define TQ_RING 16384                      /* a power of 2; half a minute of readings or blocks */

/* Flags of a reading. */
enum {
    TQ_CONTACT = 1, TQ_BUTTON = 2, TQ_FORCE_ASSUMED = 4, TQ_SIMULATED = 8, TQ_GONE = 16,
    TQ_FORCE_COMMANDED = 32, /* what a force device was told to push with, not what a sensor says */
    TQ_BEYOND = 64           /* below the height of a wall that is shown, but not on it */
};
/* Flags of a block. */
enum { TQ_STALE = 1, TQ_UNDERFLOW = 2, TQ_NO_HEARTBEAT = 4 };

/* A reading of the hand; NaN where nothing measures. */
typedef struct {
    double time_s; /* of tq_now */
    double x_mm, y_mm, depth_mm, speed_mm_s, force_n; /* depth below the wall of a force device */
    uint32_t flags, spare;
} tq_reading;

/* One call of the audio callback. */
typedef struct {
    double time_s;                         /* of tq_now, when it was called */
    double dac_time_s;                     /* when its first sample leaves, as the driver states */
    double speed_mm_s, force_n;            /* the hand as read last; 0 where that is stale */
    double hand_s;                         /* the hand of its first sample is that of this time */
    double square_sum_g2;                  /* of all its samples */
    double weighted_square_sum_g2;         /* the same after the weighting of exposure */
    uint64_t position;                     /* samples since the stream began */
    uint64_t readings;                     /* how many were written up to the last that it took in */
    uint32_t frames, presentation;         /* what played in it last, 0 for nothing */
    float peak_g, seconds;                 /* largest absolute value; how long the call took */
    uint32_t flags, taken;                 /* how many of them it was the first to look at */
} tq_block;

/* Words of a force device: what is asked of its servo (by the host), what it reports, who watches it. */
enum {
    TQ_WORD_ASKED,               /* count << 8 | what */
    TQ_WORD_WALL,                /* 5: height, stiffness, damping, half of width and length */
    TQ_WORD_PRESS = TQ_WORD_WALL + 5, /* N into the surface */
    TQ_WORD_TICK,                /* time of the servo's last tick; from here on written by the servo */
    TQ_WORD_TICKS,
    TQ_WORD_STATE,               /* what was asked last << 16 | cause << 8 | state */
    TQ_WORD_FORCE,               /* 3: command in the device's frame */
    TQ_WORD_DEPTH = TQ_WORD_FORCE + 3,
    TQ_WORD_PERIOD,              /* largest running mean of the servo's period, s; force.h */
    TQ_WORD_WATCHDOG,            /* when the watchdog last looked */
    TQ_WORD_COUNT
};

#define TQ_WORDS(type) (sizeof(type) / sizeof(uint64_t))

struct tq_live {
    uint64_t format;
    uint64_t readings, blocks; /* how many were ever written */
    uint64_t heartbeat;        /* when the session last looked, by tq_put_time */
    uint64_t word[TQ_WORD_COUNT];
    uint64_t reading[TQ_RING][TQ_WORDS(tq_reading)];
    uint64_t block[TQ_RING][TQ_WORDS(tq_block)];
};
typedef struct tq_live tq_live;

static inline void tq_put(uint64_t *slot, const void *row, size_t words)
{
    size_t i;
    for (i = 0; i < words; i++) {
        uint64_t word;
        memcpy(&word, (const char *)row + 8 * i, 8);
        __atomic_store_n(&slot[i], word, __ATOMIC_RELAXED);
    }
}

static inline void tq_take(const uint64_t *slot, void *row, size_t words)
{
    size_t i;
    for (i = 0; i < words; i++) {
        uint64_t word = __atomic_load_n(&slot[i], __ATOMIC_RELAXED);
        memcpy((char *)row + 8 * i, &word, 8);
    }
}

/* Why a row that is copied is whole, though nobody waits. Row n goes into the slot of row n − TQ_RING.
   The writer has counted all rows before n when it begins to overwrite that slot, and its release fence
   stands before the first word of row n; the reader's acquire fence stands after the last word that it
   copied. So a reader that has copied even one word of row n sees a count of n or more when it looks
   again, and gives up row n − TQ_RING and all before it. Hence a reader can trust TQ_RING − 1 rows, not
   TQ_RING: of the oldest one the next row may be under way. What would break it: a fence behind the
   words, words that are not atomic (a torn double is a plausible hand), a second writer, and counting
   the row before it is whole. */

/* A word of a force device, written and read whole. */
static inline void tq_put_word(tq_live *live, int which, uint64_t word)
{
    __atomic_store_n(&live->word[which], word, __ATOMIC_RELEASE);
}

static inline uint64_t tq_word(const tq_live *live, int which)
{
    return __atomic_load_n(&live->word[which], __ATOMIC_ACQUIRE);
}

static inline void tq_put_figure(tq_live *live, int which, double figure)
{
    tq_put_time(&live->word[which], figure);
}

static inline double tq_figure(const tq_live *live, int which)
{
    return tq_take_time(&live->word[which]);
}

/* Writes the next row of a ring; one writer only. */
static inline void tq_append(uint64_t *ring, uint64_t *count, const void *row, size_t words)
{
    uint64_t n = __atomic_load_n(count, __ATOMIC_RELAXED);
    __atomic_thread_fence(__ATOMIC_RELEASE); /* a reader of this row's words sees the count before it */
    tq_put(ring + (n & (TQ_RING - 1)) * words, row, words);
    __atomic_store_n(count, n + 1, __ATOMIC_RELEASE);
}

/* Copies rows from number `from` on, at most `most`, to `rows`; how many. Rows that are no longer there
   are left out, and *first says which row the first copied one is. */
static inline size_t tq_copy(const uint64_t *ring, const uint64_t *count, size_t words, uint64_t from,
                             void *rows, size_t most, uint64_t *first)
{
    uint64_t end = __atomic_load_n(count, __ATOMIC_ACQUIRE), lost, n, i;
    if (from > end)
        from = end;
    if (end - from > TQ_RING - 1)
        from = end - (TQ_RING - 1);
    n = end - from < most ? end - from : most;
    for (i = 0; i < n; i++)
        tq_take(ring + ((from + i) & (TQ_RING - 1)) * words, (char *)rows + 8 * words * i, words);
    __atomic_thread_fence(__ATOMIC_ACQUIRE);
    /* Row r shares its slot with row r + TQ_RING, which may be under way once the count is that. */
    end = __atomic_load_n(count, __ATOMIC_RELAXED);
    lost = end >= from + TQ_RING ? end - TQ_RING - from + 1 : 0;
    if (lost > n)
        lost = n;
    if (lost)
        memmove(rows, (char *)rows + 8 * words * lost, 8 * words * (n - lost));
    *first = from + lost;
    return n - lost;
}

/* The size of the shared memory in bytes. */
static inline size_t tq_live_size(void)
{
    return sizeof(tq_live);
}

/* Fresh memory, all zeros before. */
static inline void tq_live_start(tq_live *live)
{
    __atomic_store_n(&live->format, TQ_LIVE_FORMAT, __ATOMIC_RELEASE);
}

static inline int tq_live_fits(const tq_live *live)
{
    return __atomic_load_n(&live->format, __ATOMIC_ACQUIRE) == TQ_LIVE_FORMAT;
}

/* The heartbeat: the session was there at this time. */
static inline void tq_heartbeat(tq_live *live, double time_s)
{
    tq_put_time(&live->heartbeat, time_s);
}

/* When that was. */
static inline double tq_heartbeat_s(const tq_live *live)
{
    return tq_take_time(&live->heartbeat);
}

static inline void tq_write_reading(tq_live *live, double time_s, double x_mm, double y_mm,
                                    double depth_mm, double speed_mm_s, double force_n, uint32_t flags)
{
    tq_reading row;
    row.time_s = time_s, row.x_mm = x_mm, row.y_mm = y_mm, row.depth_mm = depth_mm;
    row.speed_mm_s = speed_mm_s, row.force_n = force_n;
    row.flags = flags, row.spare = 0;
    tq_append(live->reading[0], &live->readings, &row, TQ_WORDS(tq_reading));
}

static inline void tq_write_block(tq_live *live, const tq_block *row)
{
    tq_append(live->block[0], &live->blocks, row, TQ_WORDS(tq_block));
}

static inline size_t tq_readings(const tq_live *live, uint64_t from, tq_reading *rows, size_t most,
                                 uint64_t *first)
{
    return tq_copy(live->reading[0], &live->readings, TQ_WORDS(tq_reading), from, rows, most, first);
}

static inline size_t tq_blocks(const tq_live *live, uint64_t from, tq_block *rows, size_t most,
                               uint64_t *first)
{
    return tq_copy(live->block[0], &live->blocks, TQ_WORDS(tq_block), from, rows, most, first);
}

/* How many readings and blocks were ever written. */
static inline uint64_t tq_readings_written(const tq_live *live)
{
    return __atomic_load_n(&live->readings, __ATOMIC_ACQUIRE);
}

static inline uint64_t tq_blocks_written(const tq_live *live)
{
    return __atomic_load_n(&live->blocks, __ATOMIC_ACQUIRE);
}

/* The latest reading; 0 where there is none yet. */
static inline int tq_latest(const tq_live *live, tq_reading *row)
{
    int tries;
    for (tries = 0; tries < 4; tries++) { /* overwritten only by a whole ring of readings meanwhile */
        uint64_t n = tq_readings_written(live), first;
        if (n == 0)
            return 0;
        if (tq_readings(live, n - 1, row, 1, &first) == 1)
            return 1;
    }
    return 0;
}

#endif
