/* The servo of a force device: reads, decides, pushes, 1000 to 4000 times a second; and what watches it.
   docs/force-device.md#processes

   No allocation, no lock and no Python in the loop. What it is asked for, what it reports and the readings
   that the sound process renders from stand in shared memory (live.h).

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_SERVO_H
#define TQ_SERVO_H

#include "dhd.h"
#include "force.h"
#include "live.h"
#include "stroke.h"

#define TQ_LOST_S 0.5      /* a device that has failed for so long is opened again */
#define TQ_READING_S 0.001 /* between two readings in shared memory */
#define TQ_ENABLING 8 /* ticks until a device that was enabled has to say that its forces are on */

/* What the host asks of the servo. */
enum { TQ_ASK_NOTHING, TQ_ASK_ARM, TQ_ASK_SHOW, TQ_ASK_HIDE, TQ_ASK_CLEAR, TQ_ASK_STOP };

typedef struct {
    double period_s;
    double delay_s;        /* of the tracking filter */
    double contact_n;      /* below this commanded force the hand does not touch */
    double heartbeat_s;    /* a wall that the session has not looked after for so long is released */
    double sound_s;        /* so is one whose sound process has played nothing for so long; 0: never */
    double watchdog_s;     /* so is one that nobody watches; 0: never */
    int simulated;
} tq_servo_settings;

struct tq_servo {
    tq_force force;
    tq_stroke stroke;
    tq_servo_settings settings;
    tq_backend backend;
    tq_live *live;
    uint64_t asked, blocks; /* what was asked last, and how much had been played */
    double shown_s, played_s, read_s, reported_s, failing_s;
    int button, stopping, enabling;
};
typedef struct tq_servo tq_servo;

static inline size_t tq_servo_size(void)
{
    return sizeof(tq_servo);
}

/* Prepares a servo for an open device: without force, and with nothing asked for. */
static inline void tq_servo_start(tq_servo *s, tq_live *live, tq_backend backend,
                                  const tq_servo_settings *settings, const tq_force_limits *limits)
{
    memset(s, 0, sizeof *s);
    tq_force_start(&s->force, limits);
    tq_stroke_start(&s->stroke, settings->delay_s);
    s->settings = *settings, s->live = live, s->backend = backend;
    s->asked = tq_word(live, TQ_WORD_ASKED); /* what was asked of an earlier servo is over */
    s->blocks = tq_blocks_written(live);
    s->read_s = -1;
    tq_put_figure(live, TQ_WORD_PERIOD, 0);
    tq_put_word(live, TQ_WORD_STATE, (s->asked << 16) | TQ_BOOT);
}

static inline void tq_servo_take_wall(tq_servo *s)
{
    tq_wall wall;
    wall.height_mm = tq_figure(s->live, TQ_WORD_WALL);
    wall.stiffness_n_per_mm = tq_figure(s->live, TQ_WORD_WALL + 1);
    wall.damping_n_s_per_mm = tq_figure(s->live, TQ_WORD_WALL + 2);
    wall.half_x_mm = tq_figure(s->live, TQ_WORD_WALL + 3);
    wall.half_y_mm = tq_figure(s->live, TQ_WORD_WALL + 4);
    if (memcmp(&wall, &s->force.wall, sizeof wall))
        tq_force_set_wall(&s->force, &wall);
}

/* Does what the host has asked for since the last tick. The host asks again only once this is done. */
static inline void tq_servo_obey(tq_servo *s, double now_s)
{
    uint64_t asked = tq_word(s->live, TQ_WORD_ASKED);
    s->force.press_n = tq_figure(s->live, TQ_WORD_PRESS);
    if (asked == s->asked)
        return;
    s->asked = asked;
    switch (asked & 255) {
    case TQ_ASK_ARM:
        if (s->force.state == TQ_IDLE)
            s->backend.enable(s->backend.device), s->enabling = TQ_ENABLING;
        tq_force_event(&s->force, TQ_ARM, 0);
        break;
    case TQ_ASK_SHOW:
        tq_servo_take_wall(s);
        s->shown_s = s->played_s = now_s;
        tq_force_event(&s->force, TQ_SHOW, 0);
        break;
    case TQ_ASK_HIDE:
        tq_force_event(&s->force, TQ_HIDE, 0);
        break;
    case TQ_ASK_CLEAR:
        tq_force_event(&s->force, TQ_CLEAR, 0);
        s->read_s = -1;
        break;
    case TQ_ASK_STOP:
        tq_force_event(&s->force, TQ_FAILED, TQ_STOPPED);
        s->stopping = 1;
        break;
    }
}

/* Whether all others that a wall needs are there: the session, the sound, the watchdog. */
static inline void tq_servo_mind(tq_servo *s, double now_s)
{
    const tq_servo_settings *w = &s->settings;
    uint64_t blocks = tq_blocks_written(s->live);
    double beat_s = tq_take_time(&s->live->heartbeat);
    if (blocks != s->blocks)
        s->blocks = blocks, s->played_s = now_s;
    if (s->force.state != TQ_ARMED && s->force.state != TQ_RUNNING)
        return;
    if (w->watchdog_s > 0 && !(now_s - tq_figure(s->live, TQ_WORD_WATCHDOG) <= w->watchdog_s))
        tq_force_event(&s->force, TQ_FAILED, TQ_WATCHDOG_LOST);
    if (s->force.state != TQ_RUNNING)
        return;
    if (beat_s < s->shown_s)
        beat_s = s->shown_s;
    if (!(now_s - beat_s <= w->heartbeat_s))
        tq_force_event(&s->force, TQ_FAILED, TQ_HEARTBEAT_LOST);
    else if (w->sound_s > 0 && blocks > 0 && !(now_s - s->played_s <= w->sound_s))
        tq_force_event(&s->force, TQ_FAILED, TQ_SOUND_LOST);
}

static inline void tq_servo_report(tq_servo *s, double now_s, int failed)
{
    const tq_force *f = &s->force;
    uint32_t flags = TQ_FORCE_COMMANDED | (s->settings.simulated ? TQ_SIMULATED : 0);
    double speed, newton = tq_force_felt(f);
    int n;
    tq_put_figure(s->live, TQ_WORD_TICK, now_s);
    for (n = 0; n < 3; n++)
        tq_put_figure(s->live, TQ_WORD_FORCE + n, f->command_n[n]);
    tq_put_figure(s->live, TQ_WORD_DEPTH, f->depth_mm);
    if (f->mean_s > tq_figure(s->live, TQ_WORD_PERIOD))
        tq_put_figure(s->live, TQ_WORD_PERIOD, f->mean_s);
    tq_put_word(s->live, TQ_WORD_TICKS, tq_word(s->live, TQ_WORD_TICKS) + 1);
    tq_put_word(s->live, TQ_WORD_STATE, (s->asked << 16) | (uint64_t)f->cause << 8 | (uint64_t)f->state);
    if (now_s < s->reported_s + TQ_READING_S * 0.9)
        return;
    s->reported_s = now_s;
    if (failed) {
        tq_write_reading(s->live, now_s, NAN, NAN, NAN, 0, 0, flags | TQ_GONE);
        return;
    }
    speed = tq_stroke_speed(&s->stroke, now_s, f->position_mm[0], f->position_mm[1]);
    if (newton >= s->settings.contact_n && newton > 0)
        flags |= TQ_CONTACT;
    flags |= (s->button ? TQ_BUTTON : 0) | (f->beyond ? TQ_BEYOND : 0);
    tq_write_reading(s->live, now_s, f->position_mm[0], f->position_mm[1], f->depth_mm, speed,
                  flags & TQ_CONTACT ? newton : 0, flags);
}

/* One tick; whether to go on: not when it was asked to stop, nor with a device that is gone. */
static inline int tq_servo_tick(tq_servo *s)
{
    tq_sensed sensed;
    double now_s, step_s;
    int before = s->force.state;
    memset(&sensed, 0, sizeof sensed);
    s->backend.read(s->backend.device, &sensed);
    now_s = tq_now(); /* after it: a reading that stalls is late */
    step_s = s->read_s < 0 ? 0 : now_s - s->read_s;
    if (sensed.stale && !sensed.failed && !sensed.off && step_s <= s->force.limits.late_s) {
        s->backend.push(s->backend.device, s->force.command_n); /* its own watchdog is to hear of one */
        tq_put_figure(s->live, TQ_WORD_TICK, now_s);
        return 1;
    }
    s->read_s = now_s;
    tq_servo_obey(s, now_s);
    tq_servo_mind(s, now_s);
    if (!sensed.off)
        s->enabling = 0;
    else if (s->enabling)
        s->enabling--, sensed.off = TQ_NO_CAUSE;
    tq_force_tick(&s->force, &sensed, step_s);
    if (s->backend.push(s->backend.device, s->force.command_n)
        && (s->force.state == TQ_ARMED || s->force.state == TQ_RUNNING))
        tq_force_event(&s->force, TQ_FAILED, TQ_NOT_WRITTEN);
    s->button = sensed.button;
    if (before == TQ_BOOT && s->force.state == TQ_IDLE)
        tq_stroke_start(&s->stroke, s->settings.delay_s);
    tq_servo_report(s, now_s, sensed.failed || s->force.cause == TQ_NOT_A_NUMBER);
    s->failing_s = sensed.failed ? s->failing_s + step_s : 0;
    return !((s->stopping || s->failing_s > TQ_LOST_S) && s->force.normal_n == 0);
}

/* The loop, until it is asked to stop or the device is gone, and the force is 0. */
static void tq_servo_run(tq_servo *s)
{
    double due_s = tq_now();
    tq_take_part(1);
    while (tq_servo_tick(s)) {
        due_s += s->settings.period_s;
        if (due_s < tq_now() - s->settings.period_s) /* held up: do not catch up in a burst */
            due_s = tq_now();
        tq_sleep_until(due_s);
    }
    tq_take_part(0);
}

/* --- The watchdog's process ---------------------------------------------------------------------- */

/* What the watchdog writes of a servo that it has ended. */
static inline void tq_stood_still(tq_live *live)
{
    tq_put_word(live, TQ_WORD_STATE, (tq_word(live, TQ_WORD_ASKED) << 16) | TQ_STOOD_STILL << 8 | TQ_FAULT);
}

/* What a watchdog knows of its own looks: when the last one was, and which tick of a servo it has spared. */
typedef struct {
    double looked_s, since_s, spared_s;
} tq_watchdog;

/* Watches for `look_s`; whether a servo that may push has missed its ticks for longer than `missed_s`,
   counted from `since_s` where that is later. Where this process was late itself, both may have stood still:
   then the servo gets the time to tick once more, but not a second time without a tick. */
static inline int tq_watch(
    tq_live *live, tq_watchdog *dog, double look_s, double missed_s, double since_s, double every_s)
{
    double now_s = tq_now(), end_s = now_s + look_s;
    for (; now_s < end_s; now_s = tq_now()) {
        double tick_s = tq_figure(live, TQ_WORD_TICK), last_s = tick_s;
        double late_s = dog->looked_s > 0 ? now_s - dog->looked_s : 0;
        int state = (int)(tq_word(live, TQ_WORD_STATE) & 255);
        tq_put_figure(live, TQ_WORD_WATCHDOG, now_s);
        last_s = last_s < since_s ? since_s : last_s;
        last_s = last_s < dog->since_s ? dog->since_s : last_s;
        dog->looked_s = now_s;
        if (late_s > missed_s / 2 && tick_s != dog->spared_s)
            dog->since_s = now_s, dog->spared_s = tick_s;
        else if (now_s - last_s > missed_s && state >= TQ_ARMED && state <= TQ_RELEASING)
            return 1;
        tq_sleep_until(now_s + every_s);
    }
    return 0;
}

#endif
