/* The tracking filter of rig/devices/hand/tracking.py for positions that come at equal times, in C: the same
   velocity, the same axis, the same sign. docs/method/hand.md#speed

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_STROKE_H
#define TQ_STROKE_H

#include <math.h>

#define TQ_TRACK 256        /* positions; those of the longest window at one in a millisecond */
#define TQ_AXIS_S 0.5       /* in which the axis forgets strokes of another direction */
#define TQ_NEW_STROKE_S 0.1 /* without a position for so long, the hand starts from rest */

typedef struct {
    double delay_s;
    double time_s[TQ_TRACK], x_mm[TQ_TRACK], y_mm[TQ_TRACK]; /* a ring */
    unsigned first, count;
    double xx, xy, yy, axis_x, axis_y;
} tq_stroke;

static inline void tq_stroke_start(tq_stroke *s, double delay_s)
{
    s->delay_s = delay_s, s->first = s->count = 0;
    s->xx = s->xy = s->yy = 0, s->axis_x = 1, s->axis_y = 0;
}

/* Integral of the weight 6 s (1 - s) up to here. */
static inline double tq_smoothstep(double share)
{
    double s = share < 0 ? 0 : share > 1 ? 1 : share;
    return s * s * (3 - 2 * s);
}

/* Turns the axis towards the direction in which most movement went lately. */
static inline void tq_stroke_turn(tq_stroke *s, double vx, double vy, double step_s)
{
    double keep = exp(-step_s / TQ_AXIS_S), half, middle, x, y, length;
    s->xx = keep * s->xx + vx * vx * step_s;
    s->xy = keep * s->xy + vx * vy * step_s;
    s->yy = keep * s->yy + vy * vy * step_s;
    half = (s->xx - s->yy) / 2, middle = hypot(half, s->xy);
    x = half >= 0 ? half + middle : s->xy;
    y = half >= 0 ? s->xy : middle - half;
    length = hypot(x, y);
    if (length == 0)
        return;
    if (x * s->axis_x + y * s->axis_y < 0)
        length = -length;
    s->axis_x = x / length, s->axis_y = y / length;
}

/* Signed speed (mm/s) as of a new position (mm) at a later moment. */
static inline double tq_stroke_speed(tq_stroke *s, double time_s, double x_mm, double y_mm)
{
    double window = 2 * s->delay_s, start = time_s - window, vx = 0, vy = 0, step_s = 0, along;
    unsigned n, last = (s->first + s->count - 1) % TQ_TRACK;
    if (s->count && time_s - s->time_s[last] > TQ_NEW_STROKE_S)
        s->count = 0;
    if (s->count)
        step_s = time_s - s->time_s[last];
    if (s->count == TQ_TRACK) /* never with a window that fits */
        s->first = (s->first + 1) % TQ_TRACK, s->count--;
    n = (s->first + s->count++) % TQ_TRACK;
    s->time_s[n] = time_s, s->x_mm[n] = x_mm, s->y_mm[n] = y_mm;
    /* One position before the window stays: the line from it reaches into the window. */
    while (s->count > 2 && s->time_s[(s->first + 1) % TQ_TRACK] <= start)
        s->first = (s->first + 1) % TQ_TRACK, s->count--;
    for (n = 1; n < s->count; n++) {
        unsigned a = (s->first + n - 1) % TQ_TRACK, b = (s->first + n) % TQ_TRACK;
        double share = (tq_smoothstep((s->time_s[b] - start) / window)
                        - tq_smoothstep((s->time_s[a] - start) / window))
                       / (s->time_s[b] - s->time_s[a]);
        vx += (s->x_mm[b] - s->x_mm[a]) * share;
        vy += (s->y_mm[b] - s->y_mm[a]) * share;
    }
    tq_stroke_turn(s, vx, vy, step_s);
    along = vx * s->axis_x + vy * s->axis_y;
    return along >= 0 ? hypot(vx, vy) : -hypot(vx, vy);
}

#endif
