/* The recorder's law: a turntable at a speed, a contactor at a force, both without a sensor of either.
   docs/recorder.md

   Every tick (5000 a second) takes in two counters and two marks and gives two currents. A record is one
   sequence of phases: the turntable spins up while the contactor is lifted, the contactor goes down until it
   touches, the force settles, speed and force are judged while the accelerometer records, the contactor goes
   up. What is judged are estimates: whether they are right is for a spring balance to say.

   C99, no allocation, no clock but its ticks.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_CONTROL_H
#define TQ_CONTROL_H

#include "observer.h"

#include <stdint.h>
#include <string.h>

enum { TQ_TABLE, TQ_ARM, TQ_AXES };
enum { /* phases, as the register State has them */
    TQ_RESTS, TQ_SPINS, TQ_LOWERS, TQ_SETTLES, TQ_RUNS_IN, TQ_RECORDS_NOW, TQ_LIFTS, TQ_RECORDED, TQ_FAILS
};
enum { /* why a record is refused, as the register Cause has it */
    TQ_NO_REASON, TQ_NO_SPEED, TQ_NO_TOUCH, TQ_NO_FORCE, TQ_OFF_SPEED, TQ_OFF_FORCE, TQ_ENCODER_STUCK, TQ_SLIPS,
    TQ_TOO_HOT, TQ_OVERSPEED, TQ_STOPPED_SHORT, TQ_LINK_GONE, TQ_BEAT_GONE, TQ_OTHER_HOST, TQ_NOT_TAKEN
};

#define TQ_STILL 100 /* ticks; at 10 mm/s a counter of 4096 moves three times as often */
#define TQ_SETTLED 3 /* tolerances: a sample that wobbles moves the force about its mean, which alone is judged */
#define TQ_MARKS 12 /* on the edge of the turntable, evenly; the first is the index, too */

typedef struct {
    tq_motor motor[TQ_AXES];
    tq_number counts[TQ_AXES];              /* in a turn */
    tq_number most_a[TQ_AXES], nominal_a;   /* of the drivers; what a motor bears for ever */
    tq_number heat_a2_s;                    /* integral of the square above the nominal one that it bears */
    tq_number arm_m, contact_n_per_m;       /* lever of the ball; stiffness that the force loop is made for */
    tq_number speed_loop, force_loop;       /* their band widths, rad/s */
    tq_number lower_rad_s, lift_rad_s, touch_n; /* of the contactor */
    tq_number hold_n_m;                     /* by which it is held at its upper stop */
    int32_t least_counts;                   /* that it moves at least before it touches */
    tq_number tolerance;                    /* of speed and force, a share */
    tq_number patience_s;                   /* for speed, touch and force each */
    tq_number fastest_rad_s;                /* of the turntable */
} tq_recorder_limits;

/* One record that is wanted. */
typedef struct {
    tq_number speed_mm_s, force_n, radius_mm, run_in_s, duration_s;
} tq_wanted;

/* What was found of it. */
typedef struct {
    tq_number speed_mm_s, force_n;      /* means of the estimates while recording */
    tq_number force_sd_n, speed_sd_mm_s;
    tq_number start_turn, end_turn;     /* place of the ball on the sample in turns since the index, 0 to 1 */
    tq_number hottest_a2_s, duration_s; /* the latter with all phases */
} tq_found;

typedef struct {
    tq_recorder_limits limits;
    tq_observer observer[TQ_AXES];
    tq_wanted wanted;
    tq_found found;
    int phase, reason, again; /* whether what was sensed does not count any more */
    int enough;               /* whether the sensor has what it needs */
    uint32_t marks_then;      /* when the record ended: the next mark says whether the turntable slipped at its end */
    uint32_t tick, began, since, steady; /* ticks: ever, at the begin, in this phase, within tolerance */
    /* Sensed. */
    int sensed;
    uint16_t counter[TQ_AXES];
    int32_t turned[TQ_AXES];            /* counts, since the start */
    tq_number speed_rad_s[TQ_AXES];
    uint32_t still[TQ_AXES];            /* ticks under a current that must turn it */
    int mark;                           /* whether one is seen */
    uint32_t marks;                     /* how many since the index */
    int32_t at_mark, at_index;          /* counts of the motor */
    int32_t from;                       /* counts of the contactor when it began to go down */
    int indexed;
    /* Given. */
    tq_number current_a[TQ_AXES], heat_a2_s[TQ_AXES];
    /* Sums while recording. */
    double sum_speed, sum_force, squares_speed, squares_force;
    tq_number mean_force, mean_speed;   /* smoothed over 50 ms, by which settling is judged */
} tq_recorder;

static inline tq_number tq_bound(tq_number x, tq_number most)
{
    return x > most ? most : x < -most ? -most : x;
}

static inline tq_number tq_share_off(tq_number x, tq_number wanted)
{
    tq_number off = x / wanted - 1;
    return off < 0 ? -off : off;
}

static inline void tq_recorder_start(tq_recorder *r, const tq_recorder_limits *limits)
{
    memset(r, 0, sizeof *r);
    r->limits = *limits;
    r->again = 1; /* somebody may turn the turntable by hand before the first record */
}

static inline void tq_recorder_phase(tq_recorder *r, int phase)
{
    r->phase = phase, r->since = r->steady = 0;
}

static inline void tq_recorder_fail(tq_recorder *r, int reason)
{
    if (r->phase != TQ_FAILS && r->phase != TQ_RESTS) {
        r->reason = reason;
        tq_recorder_phase(r, TQ_FAILS);
    }
}

/* Without currents from now on; a turntable runs down by itself. */
static inline void tq_recorder_rest_now(tq_recorder *r)
{
    r->again = 1;
    tq_recorder_phase(r, TQ_RESTS);
}

/* Begins a record. After a failure nothing that was sensed counts, and the index is looked for anew. */
static inline void tq_recorder_want(tq_recorder *r, const tq_wanted *wanted)
{
    if (r->phase == TQ_FAILS || r->again) {
        r->again = 0;
        r->sensed = r->indexed = r->marks = 0, r->at_mark = r->turned[TQ_TABLE];
        memset(r->observer, 0, sizeof r->observer);
        memset(r->speed_rad_s, 0, sizeof r->speed_rad_s);
    }
    r->wanted = *wanted, r->reason = TQ_NO_REASON, r->began = r->tick, r->enough = 0;
    memset(&r->found, 0, sizeof r->found);
    r->sum_speed = r->sum_force = r->squares_speed = r->squares_force = 0;
    tq_recorder_phase(r, TQ_SPINS);
}

/* --- A tick: sensing ---------------------------------------------------------------------------------- */

static inline void tq_recorder_count(tq_recorder *r, const uint16_t counter[TQ_AXES])
{
    const tq_number turn = (tq_number)6.283185307179586;
    int n;
    for (n = 0; n < TQ_AXES; n++) {
        const tq_motor *m = &r->limits.motor[n];
        uint16_t moved = r->sensed ? (uint16_t)(counter[n] - r->counter[n]) : 0;
        int32_t steps = tq_counts_on(0, moved);
        tq_number speed = (tq_number)steps / r->limits.counts[n] * turn / m->step_s;
        r->turned[n] = tq_counts_on(r->turned[n], moved), r->counter[n] = counter[n];
        r->speed_rad_s[n] += m->speed_cut * m->step_s * (speed - r->speed_rad_s[n]);
        r->still[n] = steps == 0 ? r->still[n] + 1 : 0;
        tq_observe(&r->observer[n], m, r->current_a[n], r->speed_rad_s[n]);
    }
    r->sensed = 1;
}

/* What is wrong where the marks do not come where the counter says. */
static inline int tq_recorder_marks(tq_recorder *r, int mark, int index)
{
    int rises = mark && !r->mark, wrong = TQ_NO_REASON;
    const tq_number between = r->limits.counts[TQ_TABLE] / TQ_MARKS;
    tq_number moved = (tq_number)tq_counts_since(r->turned[TQ_TABLE], r->at_mark);
    r->mark = mark;
    if (!rises) /* nor where none comes: the turntable stands */
        return moved > (tq_number)1.2 * between ? TQ_SLIPS : TQ_NO_REASON;
    if (r->marks++ > 0) {
        if (r->still[TQ_TABLE] > TQ_STILL) /* the turntable moves, the counter does not */
            wrong = TQ_ENCODER_STUCK;
        else if (moved > (tq_number)1.2 * between || moved < (tq_number)0.8 * between)
            wrong = TQ_SLIPS;
    }
    r->at_mark = r->turned[TQ_TABLE];
    if (index)
        r->at_index = r->turned[TQ_TABLE], r->indexed = 1;
    return wrong;
}

/* Where the ball is on the sample: turns since the index, 0 to 1. */
static inline tq_number tq_recorder_place(const tq_recorder *r)
{
    tq_number turns = (tq_number)tq_counts_since(r->turned[TQ_TABLE], r->at_index) / r->limits.counts[TQ_TABLE];
    turns -= (tq_number)tq_truncated(turns);
    return turns < 0 ? turns + 1 : turns;
}

static inline tq_number tq_recorder_force(const tq_recorder *r)
{
    return r->observer[TQ_ARM].reaction_n_m / r->limits.arm_m;
}

static inline tq_number tq_recorder_speed(const tq_recorder *r)
{
    return r->speed_rad_s[TQ_TABLE] * r->wanted.radius_mm;
}

/* --- A tick: what is judged ------------------------------------------------------------------------------- */

/* From the means of the squares and of the values. */
static inline tq_number tq_recorder_sd(double squares, double mean)
{
    double variance = squares - mean * mean;
    return variance > 0 ? TQ_ROOT((tq_number)variance) : 0;
}

static inline void tq_recorder_judge(tq_recorder *r)
{
    const tq_recorder_limits *l = &r->limits;
    const tq_number step_s = l->motor[TQ_ARM].step_s, smooth = step_s / (tq_number)0.05;
    tq_number force = tq_recorder_force(r), speed = tq_recorder_speed(r), count;
    int on_speed, on_force, late = (tq_number)r->since * step_s > l->patience_s;
    r->mean_force += smooth * (force - r->mean_force);
    r->mean_speed += smooth * (speed - r->mean_speed);
    on_speed = tq_share_off(r->mean_speed, r->wanted.speed_mm_s) <= l->tolerance;
    on_force = tq_share_off(r->mean_force, r->wanted.force_n) <= TQ_SETTLED * l->tolerance;
    switch (r->phase) {
    case TQ_SPINS:
        r->steady = on_speed ? r->steady + 1 : 0;
        if ((tq_number)r->steady * step_s > (tq_number)0.1 && r->indexed)
            tq_recorder_phase(r, TQ_LOWERS), r->from = r->turned[TQ_ARM], r->mean_force = 0;
        else if (late)
            tq_recorder_fail(r, TQ_NO_SPEED);
        break;
    case TQ_LOWERS:
        if (r->mean_force > l->touch_n) { /* a counter that stands still looks like a surface */
            tq_recorder_phase(r, TQ_SETTLES);
            if (tq_counts_since(r->turned[TQ_ARM], r->from) < l->least_counts)
                tq_recorder_fail(r, TQ_ENCODER_STUCK);
        }
        else if (late)
            tq_recorder_fail(r, TQ_NO_TOUCH);
        break;
    case TQ_SETTLES:
        r->steady = on_speed && on_force ? r->steady + 1 : 0;
        if ((tq_number)r->steady * step_s > (tq_number)0.1)
            tq_recorder_phase(r, TQ_RUNS_IN);
        else if (late)
            tq_recorder_fail(r, TQ_NO_FORCE);
        break;
    case TQ_RUNS_IN:
        if ((tq_number)r->since * step_s < r->wanted.run_in_s)
            break;
        tq_recorder_phase(r, TQ_RECORDS_NOW);
        r->found.start_turn = tq_recorder_place(r);
        break;
    case TQ_RECORDS_NOW:
        r->sum_speed += (double)speed, r->squares_speed += (double)speed * (double)speed;
        r->sum_force += (double)force, r->squares_force += (double)force * (double)force;
        count = (tq_number)(r->since + 1);
        if (count * step_s < r->wanted.duration_s && !r->enough)
            break;
        r->found.speed_mm_s = (tq_number)(r->sum_speed / (double)count);
        r->found.force_n = (tq_number)(r->sum_force / (double)count);
        r->found.speed_sd_mm_s = tq_recorder_sd(r->squares_speed / (double)count, r->sum_speed / (double)count);
        r->found.force_sd_n = tq_recorder_sd(r->squares_force / (double)count, r->sum_force / (double)count);
        r->found.end_turn = tq_recorder_place(r);
        r->reason = tq_share_off(r->found.speed_mm_s, r->wanted.speed_mm_s) > l->tolerance ? TQ_OFF_SPEED
                    : tq_share_off(r->found.force_n, r->wanted.force_n) > l->tolerance     ? TQ_OFF_FORCE
                                                                                           : TQ_NO_REASON;
        r->marks_then = r->marks;
        tq_recorder_phase(r, TQ_LIFTS);
        break;
    case TQ_LIFTS:
        r->steady = r->speed_rad_s[TQ_ARM] > -l->lift_rad_s / 8 ? r->steady + 1 : 0; /* at its stop */
        if (r->marks != r->marks_then
            && ((tq_number)r->steady * step_s > (tq_number)0.05 || (tq_number)r->since * step_s > 1))
            tq_recorder_phase(r, TQ_RECORDED), r->found.duration_s = (tq_number)(r->tick - r->began) * step_s;
        break;
    default:
        break;
    }
    r->since++;
}

/* --- A tick: what is given ------------------------------------------------------------------------------ */

static inline void tq_recorder_drive(tq_recorder *r)
{
    const tq_recorder_limits *l = &r->limits;
    const tq_motor *table = &l->motor[TQ_TABLE], *arm = &l->motor[TQ_ARM];
    tq_number goal = 0, lean, damping, wanted[TQ_AXES] = { 0, 0 };
    int n, moves = r->phase >= TQ_SPINS && r->phase <= TQ_LIFTS;
    if (moves) {
        goal = r->wanted.speed_mm_s / r->wanted.radius_mm;
        wanted[TQ_TABLE] = tq_accelerating_a(&r->observer[TQ_TABLE], table,
                                             l->speed_loop * (goal - r->speed_rad_s[TQ_TABLE]));
    }
    damping = 2 * l->force_loop;
    switch (r->phase) {
    case TQ_LOWERS:
        wanted[TQ_ARM] = tq_accelerating_a(&r->observer[TQ_ARM], arm,
                                           damping * (l->lower_rad_s - r->speed_rad_s[TQ_ARM]));
        break;
    case TQ_SETTLES:
    case TQ_RUNS_IN:
    case TQ_RECORDS_NOW: /* critically damped on the stiffness that it is made for */
        lean = l->force_loop * l->force_loop / (l->contact_n_per_m * l->arm_m * l->arm_m);
        wanted[TQ_ARM] = tq_accelerating_a(
            &r->observer[TQ_ARM], arm,
            lean * (r->wanted.force_n * l->arm_m - r->observer[TQ_ARM].reaction_n_m) - damping * r->speed_rad_s[TQ_ARM]);
        break;
    case TQ_LIFTS:
        wanted[TQ_ARM] = tq_accelerating_a(&r->observer[TQ_ARM], arm,
                                           damping * (-l->lift_rad_s - r->speed_rad_s[TQ_ARM]));
        break;
    case TQ_SPINS:
    case TQ_RECORDED:
        wanted[TQ_ARM] = -l->hold_n_m / arm->n_m_per_a;
        break;
    default:
        break;
    }
    for (n = 0; n < TQ_AXES; n++) {
        tq_number over;
        r->current_a[n] = tq_bound(wanted[n], l->most_a[n]);
        over = (r->current_a[n] * r->current_a[n] - l->nominal_a * l->nominal_a) * l->motor[n].step_s;
        r->heat_a2_s[n] = r->heat_a2_s[n] + over > 0 ? r->heat_a2_s[n] + over : 0;
        if (r->heat_a2_s[n] > r->found.hottest_a2_s)
            r->found.hottest_a2_s = r->heat_a2_s[n];
        if (r->heat_a2_s[n] > l->heat_a2_s)
            tq_recorder_fail(r, TQ_TOO_HOT);
    }
    if (r->phase == TQ_FAILS || r->phase == TQ_RESTS)
        r->current_a[TQ_TABLE] = r->current_a[TQ_ARM] = 0;
}

/* One tick: counters of both encoders modulo 2^16, whether a mark is seen, and the index. */
static inline void tq_recorder_tick(tq_recorder *r, const uint16_t counter[TQ_AXES], int mark, int index)
{
    int wrong, moves = r->phase >= TQ_SPINS && r->phase <= TQ_LIFTS;
    tq_number fast;
    tq_recorder_count(r, counter);
    wrong = tq_recorder_marks(r, mark, index);
    fast = r->speed_rad_s[TQ_TABLE];
    if (moves) {
        if (fast > r->limits.fastest_rad_s || -fast > r->limits.fastest_rad_s)
            tq_recorder_fail(r, TQ_OVERSPEED);
        else if (wrong != TQ_NO_REASON)
            tq_recorder_fail(r, wrong);
        else if (tq_bound(r->current_a[TQ_TABLE], r->limits.most_a[TQ_TABLE]) >= r->limits.most_a[TQ_TABLE]
                 && r->still[TQ_TABLE] > 1000)
            tq_recorder_fail(r, TQ_ENCODER_STUCK);
        else
            tq_recorder_judge(r);
    }
    tq_recorder_drive(r);
    r->tick++;
}

#endif
