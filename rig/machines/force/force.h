/* What a force device is told to do: a wall, limits, and the states that decide whether it may push.
   docs/force-device.md

   A function of readings and time steps alone: no clock, no device, no allocation, no globals, so that the
   same file runs in the servo process, in virtual time and on a micro-controller. Lengths in mm, forces in
   N, times in s. C99.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_FORCE_H
#define TQ_FORCE_H

#include "backend.h"

/* States. Force is exactly 0 in all but ARMED (a wall that was hidden ramps out), RUNNING and RELEASING. */
enum { TQ_BOOT, TQ_IDLE, TQ_ARMED, TQ_RUNNING, TQ_RELEASING, TQ_FAULT, TQ_STATES };
/* Events. SENSED is a good reading, ZERO the end of a release. */
enum { TQ_SENSED, TQ_ARM, TQ_SHOW, TQ_HIDE, TQ_CLEAR, TQ_FAILED, TQ_ZERO, TQ_EVENTS };
/* Why it failed. */
enum {
    TQ_NO_CAUSE, TQ_NOT_READ, TQ_NOT_A_NUMBER, TQ_LATE, TQ_JUMP, TQ_SPEED, TQ_WORKSPACE, TQ_FROZEN,
    TQ_HEARTBEAT_LOST, TQ_SOUND_LOST, TQ_WATCHDOG_LOST, TQ_NOT_WRITTEN, TQ_STOPPED,
    TQ_STOOD_STILL, /* by the watchdog: the servo itself */
    TQ_LINK_LOST, TQ_HOST_CHANGED, TQ_STUCK, TQ_SLACK, /* by a device that renders by itself */
    TQ_SLOW, /* the running mean of the period is above what walls are passive for */
    TQ_UNANSWERED, TQ_PRESSED_THROUGH,
    TQ_OFF, TQ_OFF_SWITCH, TQ_OFF_SPEED, TQ_OFF_WATCHDOG, /* by the device itself, which has switched its forces off */
    TQ_CAUSES
};

/* The next state. Of the ways to RUNNING each begins with ARM and SHOW, which are asked for; nothing
   else leaves FAULT than CLEAR, which is asked for, too. */
static inline int tq_force_next(int state, int event)
{
    static const unsigned char next[TQ_STATES][TQ_EVENTS] = {
        /* sensed, arm, show, hide, clear, failed, zero */
        { TQ_IDLE, TQ_BOOT, TQ_BOOT, TQ_BOOT, TQ_BOOT, TQ_FAULT, TQ_BOOT },                      /* BOOT */
        { TQ_IDLE, TQ_ARMED, TQ_IDLE, TQ_IDLE, TQ_IDLE, TQ_FAULT, TQ_IDLE },                     /* IDLE */
        { TQ_ARMED, TQ_ARMED, TQ_RUNNING, TQ_ARMED, TQ_ARMED, TQ_RELEASING, TQ_ARMED },          /* ARMED */
        { TQ_RUNNING, TQ_RUNNING, TQ_RUNNING, TQ_ARMED, TQ_RUNNING, TQ_RELEASING, TQ_RUNNING },  /* RUNNING */
        { TQ_RELEASING, TQ_RELEASING, TQ_RELEASING, TQ_RELEASING, TQ_RELEASING, TQ_RELEASING,
          TQ_FAULT },                                                                            /* RELEASING */
        { TQ_FAULT, TQ_FAULT, TQ_FAULT, TQ_FAULT, TQ_BOOT, TQ_FAULT, TQ_FAULT },                 /* FAULT */
    };
    return next[state][event];
}

/* In nominal periods: a running mean above the first one is a fault; walls have to be passive for the second one.
   A tool that swings is twice as fast at its best as on average (v^2), and long periods may come just then. */
#define TQ_SLOW_FROM ((tq_number)1.5)
#define TQ_SLOWEST 2
/* After ARM a small force tells whether the tool gives way to it: below the wall's limits, at a frequency that
   is above what a hand does by itself and below what encoders do not resolve. docs/force-device.md#does-it-give-way */
#define TQ_PROBE_S ((tq_number)0.4)
#define TQ_PROBE_HZ ((tq_number)12.5)
#define TQ_LEAST_MM_PER_N ((tq_number)0.03)
/* A wall that is pressed deeper than where its force is at the limit, for so long, is none any more. */
#define TQ_THROUGH_S ((tq_number)1)

/* Limits of one device, and where its wall's frame lies. */
typedef struct {
    tq_number late_s;       /* two readings further apart than this are a fault */
    tq_number frozen_s;     /* so are bit-identical ones for this long under force */
    tq_number release_s;    /* from the force at a fault to 0 */
    tq_number show_s;       /* from no wall to all of it where it is switched on while it is penetrated */
    tq_number most_n;       /* force */
    tq_number most_n_per_s; /* its change */
    tq_number most_w;       /* its power, into the hand or out of it */
    tq_number most_mm_s;    /* speed of the tool; above, a fault */
    tq_number jump_mm;      /* a step of readings longer than speed allows by this much is a fault */
    tq_number velocity_hz;  /* corner of the low-pass on the velocity of the wall's damping */
    tq_number low_mm[3], high_mm[3]; /* workspace, in the device's frame */
    tq_number origin_mm[3];          /* of the wall's frame, in the device's */
    tq_number axes[9];               /* its unit vectors x, y and z (away from the surface) there */
    tq_number period_s;              /* nominal, from one tick to the next; 0: nobody asks for their mean */
    tq_number probe_n;               /* of the small force after ARM; 0: none */
    tq_number answer_s;              /* from a reading to the force that answers it, about */
} tq_force_limits;

/* A spring-damper wall: a rectangle about the origin of its frame, felt from above. */
typedef struct {
    tq_number height_mm, stiffness_n_per_mm, damping_n_s_per_mm;
    tq_number half_x_mm, half_y_mm;
} tq_wall;

/* All of it between two ticks; what is read from outside stands first. */
typedef struct {
    tq_number command_n[3];   /* what the device shall push with, in its frame */
    tq_number normal_n;       /* the same along the wall's z */
    tq_number position_mm[3]; /* in the wall's frame */
    tq_number velocity_mm_s[3];
    tq_number depth_mm;       /* below the wall's height; negative above */
    int state, cause;
    int beyond;            /* the wall is shown, and the tool below its height but not on it */
    /* Its own. */
    tq_force_limits limits;
    tq_wall wall;
    tq_number scale;     /* how much of the wall is there, 0 to 1 */
    tq_number press_n;   /* pushes into the surface, to measure it */
    tq_number frozen_s, fell_n, through_s;
    tq_number mean_s;    /* running mean of the period, each counted by how long it is */
    tq_number probe_s;   /* for how long the small force has gone; at its end the wall may come */
    tq_number from_mm[3], sine[3], cosine[3], weight; /* where it began, and what answered it along each axis */
    tq_number raw_mm[3]; /* the last reading */
    int sensed;       /* whether there is one */
    int engaged;      /* whether the tool came onto the wall from above */
    int proven;       /* whether the tool has given way to the small force */
    int off;          /* whoever holds the tool has switched the wall off */
} tq_force;

static inline tq_number tq_force_size(tq_number x)
{
    return x < 0 ? -x : x;
}

static inline tq_number tq_force_limited(tq_number x, tq_number most)
{
    return x > most ? most : x < -most ? -most : x;
}

/* No force, nothing sensed yet. */
static inline void tq_force_start(tq_force *f, const tq_force_limits *limits)
{
    static const tq_force nothing;
    *f = nothing;
    f->limits = *limits;
}

/* A wall comes at once where that is not felt, else as a ramp; not from deep below. */
static inline void tq_force_enter(tq_force *f)
{
    f->engaged = f->depth_mm * f->wall.stiffness_n_per_mm <= f->limits.most_n, f->frozen_s = 0;
    f->scale = f->depth_mm <= 0 ? 1 : f->scale;
}

/* Takes an event; a cause counts with TQ_FAILED, and the first one is kept. */
static inline void tq_force_event(tq_force *f, int event, int cause)
{
    int before = f->state;
    f->state = tq_force_next(before, event);
    if (event == TQ_FAILED && before != TQ_RELEASING && before != TQ_FAULT)
        f->cause = cause, f->fell_n = f->normal_n;
    if (f->state == before)
        return;
    if (f->state == TQ_BOOT)
        f->cause = TQ_NO_CAUSE, f->sensed = 0;
    if (before == TQ_IDLE)
        f->probe_s = 0, f->proven = f->limits.probe_n <= 0;
    if (f->state == TQ_RUNNING && f->proven)
        tq_force_enter(f);
}

/* The wall from now on. Another one than before begins to be shown from nothing. */
static inline void tq_force_set_wall(tq_force *f, const tq_wall *wall)
{
    f->wall = *wall, f->scale = 0;
    f->depth_mm = wall->height_mm - f->position_mm[2];
}

/* The running mean of the period, over as long as lets one reading of `late_s` pass, and 20 ms at least: a wall
   that is held for a period T gives up to K v^2 T^2 / 2 to a hand of speed v, which b v^2 T takes away. With
   periods that differ it is their mean, each weighted by v^2 and its own length, that may not be above 2 b / K;
   without v^2 it is M, with it at most 2 M - T of a tool that swings. */
static inline void tq_force_average(tq_force *f, tq_number step_s)
{
    const tq_number period_s = f->limits.period_s, late_s = f->limits.late_s, shortest_s = (tq_number)0.02;
    tq_number window_s;
    if (period_s <= 0)
        return;
    if (!f->sensed) {
        f->mean_s = period_s;
    } else if (step_s > 0 && step_s <= late_s) {
        window_s = late_s * (late_s - period_s) / ((TQ_SLOW_FROM - 1) * period_s);
        window_s = window_s > shortest_s ? window_s : shortest_s;
        f->mean_s += step_s / (window_s + step_s) * (step_s - f->mean_s);
    }
}

/* What is wrong with a reading that comes `step_s` after the one before; TQ_NO_CAUSE for nothing. */
static inline int tq_force_wrong(tq_force *f, const tq_sensed *sensed, tq_number step_s)
{
    const tq_force_limits *l = &f->limits;
    tq_number moved = 0, allowed;
    int n, same = f->sensed;
    if (sensed->failed)
        return TQ_NOT_READ;
    for (n = 0; n < 3; n++) {
        tq_number x = sensed->position_mm[n];
        if (!(x - x == 0)) /* neither a number nor finite */
            return TQ_NOT_A_NUMBER;
        moved += (x - f->raw_mm[n]) * (x - f->raw_mm[n]);
        same = same && x == f->raw_mm[n];
    }
    if (f->sensed) {
        if (!(step_s >= 0 && step_s <= l->late_s))
            return TQ_LATE;
        allowed = l->most_mm_s * step_s + l->jump_mm;
        if (moved > allowed * allowed)
            return TQ_JUMP;
    }
    for (n = 0; n < 3; n++)
        if (sensed->position_mm[n] < l->low_mm[n] || sensed->position_mm[n] > l->high_mm[n])
            return TQ_WORKSPACE;
    f->frozen_s = same && f->normal_n != 0 ? f->frozen_s + step_s : 0;
    return f->frozen_s > l->frozen_s ? TQ_FROZEN : TQ_NO_CAUSE;
}

/* Where the tool is in the wall's frame, and how fast. */
static inline void tq_force_follow(tq_force *f, const tq_sensed *sensed, tq_number step_s)
{
    const tq_force_limits *l = &f->limits;
    tq_number tau_s = (tq_number)0.15915494309189535 / l->velocity_hz;
    tq_number share = step_s > 0 ? step_s / (tau_s + step_s) : 0;
    int n, k;
    for (n = 0; n < 3; n++) {
        tq_number x = 0;
        for (k = 0; k < 3; k++)
            x += l->axes[3 * n + k] * (sensed->position_mm[k] - l->origin_mm[k]);
        if (f->sensed && step_s > 0)
            f->velocity_mm_s[n] += share * ((x - f->position_mm[n]) / step_s - f->velocity_mm_s[n]);
        else if (!f->sensed)
            f->velocity_mm_s[n] = 0;
        f->position_mm[n] = x;
    }
    for (n = 0; n < 3; n++)
        f->raw_mm[n] = sensed->position_mm[n];
    f->depth_mm = f->wall.height_mm - f->position_mm[2];
    f->sensed = 1;
}

/* A wave of size 1 that goes through 0 upwards at whole turns: parabolas, which need no library. */
static inline tq_number tq_force_wave(tq_number turns)
{
    tq_number part = turns - (tq_number)tq_truncated(turns), half = (tq_number)0.5;
    tq_number up = part < half ? part : part - half, size = 16 * up * (half - up);
    return part < half ? size : -size;
}

/* Whether the tool moved as what has mass, damping and a soft hand does: along the force, behind it by 35 to 185
   degrees. One whose encoders count backwards is ahead of that by half a turn; one that stands still, or goes
   sideways, tells nothing. */
static inline int tq_force_answered(const tq_force *f)
{
    tq_number along = f->sine[2] * f->sine[2] + f->cosine[2] * f->cosine[2], aside = 0, gives;
    int n;
    for (n = 0; n < 2; n++)
        aside += f->sine[n] * f->sine[n] + f->cosine[n] * f->cosine[n];
    gives = (tq_number)-0.34 * f->sine[2] - (tq_number)0.94 * f->cosine[2];
    return gives >= TQ_LEAST_MM_PER_N * f->limits.probe_n * f->weight && 16 * gives * gives >= along && aside <= along;
}

/* The small force after ARM: fades in and out, and sums what answers it. */
static inline tq_number tq_force_probe(tq_force *f, tq_number step_s)
{
    const tq_number share = f->probe_s / TQ_PROBE_S, turns = TQ_PROBE_HZ * f->probe_s;
    const tq_number fade = 16 * share * share * (1 - share) * (1 - share);
    const tq_number came = turns + 1 - TQ_PROBE_HZ * f->limits.answer_s; /* the force comes that much later */
    const tq_number sine = fade * tq_force_wave(came), cosine = fade * tq_force_wave(came + (tq_number)0.25);
    int n;
    if (f->probe_s == 0)
        f->weight = 0;
    for (n = 0; n < 3; n++) {
        if (f->probe_s == 0)
            f->from_mm[n] = f->position_mm[n], f->sine[n] = f->cosine[n] = 0;
        f->sine[n] += sine * step_s * (f->position_mm[n] - f->from_mm[n]);
        f->cosine[n] += cosine * step_s * (f->position_mm[n] - f->from_mm[n]);
    }
    f->weight += sine * sine * step_s;
    f->probe_s += step_s;
    return f->limits.probe_n * fade * tq_force_wave(turns);
}

/* At the end of the small force: whether it is unanswered. */
static inline int tq_force_unanswered(tq_force *f)
{
    if (f->proven || f->probe_s < TQ_PROBE_S)
        return 0;
    f->proven = tq_force_answered(f);
    if (f->proven && f->state == TQ_RUNNING) /* asked for meanwhile */
        tq_force_enter(f);
    return !f->proven;
}

/* Whether the hand, or an encoder that counts backwards, has gone through the wall. */
static inline int tq_force_through(tq_force *f, tq_number step_s)
{
    int through = f->state == TQ_RUNNING && f->engaged && f->scale >= 1
                  && f->depth_mm * f->wall.stiffness_n_per_mm > f->limits.most_n;
    f->through_s = through ? f->through_s + step_s : 0;
    return f->through_s > TQ_THROUGH_S;
}

/* What of a device that pushes is wrong, though its reading is good; TQ_NO_CAUSE for nothing. */
static inline int tq_force_pushes_wrong(tq_force *f, const tq_sensed *sensed, tq_number step_s)
{
    if (sensed->off)
        return sensed->off;
    if (f->mean_s > TQ_SLOW_FROM * f->limits.period_s)
        return TQ_SLOW;
    if (tq_force_unanswered(f))
        return TQ_UNANSWERED;
    return tq_force_through(f, step_s) ? TQ_PRESSED_THROUGH : TQ_NO_CAUSE;
}

/* Force of the wall, along z: never adhesive, none beyond its edge, and none for who came under it from
   beside it before having been above it. */
static inline tq_number tq_wall_force(tq_force *f, tq_number step_s)
{
    int inside = tq_force_size(f->position_mm[0]) <= f->wall.half_x_mm
                 && tq_force_size(f->position_mm[1]) <= f->wall.half_y_mm;
    tq_number wanted = f->state == TQ_RUNNING && !f->off && f->proven ? 1 : 0, most = step_s / f->limits.show_s, force;
    f->scale += tq_force_limited(wanted - f->scale, most);
    f->engaged = f->depth_mm <= 0 || (f->engaged && inside && !(f->off && f->scale <= 0));
    f->beyond = f->state == TQ_RUNNING && !f->off && f->depth_mm > 0 && !f->engaged;
    if (!f->engaged || f->depth_mm <= 0 || f->scale <= 0)
        return 0;
    force = f->scale * (f->wall.stiffness_n_per_mm * f->depth_mm
                        - f->wall.damping_n_s_per_mm * f->velocity_mm_s[2]);
    return force > 0 ? force : 0;
}

/* Within the limits of force, its change and its power, of which the last one comes first. */
static inline tq_number tq_force_clamped(const tq_force *f, tq_number force, tq_number step_s)
{
    const tq_force_limits *l = &f->limits;
    tq_number speed = tq_force_size(f->velocity_mm_s[2]);
    force = tq_force_limited(force, l->most_n);
    force = f->normal_n + tq_force_limited(force - f->normal_n, l->most_n_per_s * step_s);
    if (tq_force_size(force) * speed > (tq_number)1e3 * l->most_w)
        force = tq_force_limited(force, (tq_number)1e3 * l->most_w / speed);
    return force;
}

/* One tick: takes in a reading that was made `step_s` after the one before, and sets the command. */
static inline void tq_force_tick(tq_force *f, const tq_sensed *sensed, tq_number step_s)
{
    const tq_force_limits *l = &f->limits;
    int wrong, n;
    tq_number least_s = step_s > 0 ? (step_s < l->late_s ? step_s : l->late_s) : 0, force = 0, speed = 0;
    tq_force_average(f, step_s);
    wrong = tq_force_wrong(f, sensed, step_s);
    if (wrong == TQ_NO_CAUSE) {
        tq_force_follow(f, sensed, step_s);
        for (n = 0; n < 3; n++)
            speed += f->velocity_mm_s[n] * f->velocity_mm_s[n];
        if (speed > l->most_mm_s * l->most_mm_s)
            wrong = TQ_SPEED;
        else if (f->state == TQ_ARMED || f->state == TQ_RUNNING)
            wrong = tq_force_pushes_wrong(f, sensed, least_s);
    }
    tq_force_event(f, wrong == TQ_NO_CAUSE ? TQ_SENSED : TQ_FAILED, wrong);
    f->beyond = 0;
    if (f->state == TQ_ARMED || f->state == TQ_RUNNING) {
        force = tq_wall_force(f, least_s);
        if (f->state == TQ_RUNNING)
            force -= f->press_n;
        if (!f->proven && f->probe_s < TQ_PROBE_S)
            force += tq_force_probe(f, least_s);
        force = tq_force_clamped(f, force, least_s);
    } else if (f->state == TQ_RELEASING) { /* also without a reading: linearly to 0 */
        const tq_number shortest_s = (tq_number)1e-4;
        tq_number part = tq_force_size(f->fell_n) * (least_s > shortest_s ? least_s : shortest_s) / l->release_s;
        force = f->normal_n - tq_force_limited(f->normal_n, part);
    }
    f->normal_n = force;
    if (f->state == TQ_RELEASING && force == 0)
        tq_force_event(f, TQ_ZERO, 0);
    if (f->state != TQ_ARMED && f->state != TQ_RUNNING)
        f->scale = f->press_n = 0, f->engaged = 0;
    for (n = 0; n < 3; n++)
        f->command_n[n] = force * l->axes[6 + n];
}

/* What the hand feels of a surface: the small force after ARM is none. */
static inline tq_number tq_force_felt(const tq_force *f)
{
    return f->proven && f->normal_n > 0 ? f->normal_n : 0;
}

/* Up to which stiffness (N/mm) a wall that is sampled every `period_s` and answered `delay_s` later cannot
   give energy to the hand; `tactileq.rig.machines.force.wall` has the source. */
static inline tq_number tq_largest_stiffness(tq_number device_n_s_per_mm, tq_number wall_n_s_per_mm,
                                             tq_number period_s, tq_number delay_s)
{
    return (device_n_s_per_mm - tq_force_size(wall_n_s_per_mm)) / (period_s / 2 + delay_s);
}

#endif
