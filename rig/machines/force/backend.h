/* A back end: all that the servo of tactileq needs of a force device. docs/force-device.md#another-device

   Write these three functions for another device, and a Python class that opens it, as dhd.py has one.
   They are called by one thread, one to four thousand times a second, and must neither allocate nor wait
   for longer than the device's own communication takes.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_BACKEND_H
#define TQ_BACKEND_H

#include <stdint.h>

/* The numbers of the law: double in the servo; a micro-controller without such a unit defines float. */
#ifndef TQ_NUMBER
#define TQ_NUMBER double
#endif
typedef TQ_NUMBER tq_number;

#ifdef TQ_FREESTANDING
#define TQ_ROOT_SINGLE __builtin_sqrtf
#define TQ_ROOT_DOUBLE __builtin_sqrt
#else
#include <math.h>
#define TQ_ROOT_SINGLE sqrtf
#define TQ_ROOT_DOUBLE sqrt
#endif
#define TQ_ROOT(x)                                                                     \
    (sizeof(tq_number) == sizeof(float) ? (tq_number)TQ_ROOT_SINGLE((float)(x))          \
                                        : (tq_number)TQ_ROOT_DOUBLE((double)(x)))

/* The whole part of a number, whatever it is: beyond what an int32_t holds its end, of no number 0. */
static inline int32_t tq_truncated(tq_number x)
{
    const tq_number past = (tq_number)2147483648.0; /* both precisions have it */
    return x >= past ? INT32_MAX : x >= -past ? (int32_t)x : x < -past ? INT32_MIN : 0;
}

/* Counts of an encoder since other ones: both go on from the largest to the smallest. */
static inline int32_t tq_counts_since(int32_t now, int32_t then)
{
    return (int32_t)((uint32_t)now - (uint32_t)then);
}

/* How many lie between, whichever was first. */
static inline uint32_t tq_counts_apart(int32_t one, int32_t other)
{
    uint32_t since = (uint32_t)one - (uint32_t)other;
    return since <= INT32_MAX ? since : 0u - since;
}

/* Counts after so many steps of a counter modulo 2^16, which went the shorter way. */
static inline int32_t tq_counts_on(int32_t counts, uint16_t moved)
{
    return (int32_t)((uint32_t)counts + moved - (moved < 0x8000 ? 0u : 0x10000u));
}

/* One reading. A device that cannot say where it is sets `failed`; the servo then ramps its force to 0 and
   stays there. What the position is worth (NaN, a jump, the same for too long) is the servo's to judge. */
typedef struct {
    tq_number position_mm[3]; /* of the tool, in the device's own right-handed frame */
    int failed;
    int stale;  /* the same reading once more: the device has no newer one */
    int button; /* whether its button is down */
    int off;    /* why the device itself has switched its forces off: a cause of force.h; 0 while they are on */
} tq_sensed;

typedef struct {
    void *device; /* the back end's own; given to all functions */
    void (*read)(void *device, tq_sensed *sensed);
    /* Push with this force (N, device's frame) from now on; not 0 where that failed. */
    int (*push)(void *device, const tq_number force_n[3]);
    /* Let it push from now on, also after it has switched its forces off; `off` says whether it does. */
    void (*enable)(void *device);
} tq_backend;

#endif
