/* The recorder as a device: its law behind the wire. docs/recorder.md

   As rig/machines/device/device.h: an interrupt calls tq_device_tick 5000 times a second, the main loop
   tq_device_received with what comes. No current flows without a record that was asked for, and none where the
   host falls silent (100 ms) or its control loop does (1 s).

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_RECORDER_H
#define TQ_RECORDER_H

#include "control.h"
#include "registers.h"

#include "wire.h"

#define TQ_TICK_HZ 5000
enum { TQ_LINK_TICKS = TQ_TICK_HZ / 10, TQ_BEAT_TICKS = TQ_TICK_HZ };
enum { TQ_MOTORS = TQ_AXES, TQ_OUTPUTS = TQ_AXES }; /* as boards call them, whatever the device is */

/* What is written for a board: rig/machines/device/device.h says more of each. */
typedef struct {
    void *context;
    int (*write)(void *context, int axis, tq_number current_a); /* not 0 where that failed */
    size_t (*room)(void *context);
    void (*send)(void *context, const uint8_t *bytes, size_t count);
    void (*lock)(void *context);
    void (*unlock)(void *context);
    uint32_t entropy, baud;
    int simulated;
    float most_a; /* what the motor drivers give at most: with more the observers would reckon with what does not flow */
} tq_board;

typedef struct {
    tq_board board;
    tqd_values values;
    tq_recorder recorder;
    tq_reader reader;
    uint32_t nonce, heard, beat;
    int greeted;
    uint16_t expected, replied;
    uint8_t reply[TQ_MOST_STUFFED];
    size_t reply_bytes;
    int failing, letting_go, began_failed; /* a motor that takes nothing; motors that were not told 0 yet */
    uint32_t began;                        /* tick of the present record */
    uint32_t clocks_ticks, clocks_most;    /* of the board, that ticks took */
    uint64_t clocks_sum;                   /* nobody may ask for hours */
    int simulate;
} tq_device;

#include "served.h"

/* --- Start ----------------------------------------------------------------------------------------- */

static inline void tq_device_motor(tq_motor *m, const float law[8], float gravity)
{
    m->step_s = (tq_number)1 / TQ_TICK_HZ;
    m->inertia_kg_m2 = law[0], m->n_m_per_a = law[1], m->cut = law[2], m->reaction_cut = law[3];
    m->speed_cut = law[4], m->friction_n_m = law[5], m->slow_rad_s = law[6], m->viscous_n_m_s = law[7];
    m->gravity_n_m = gravity;
}

/* The law's numbers, from the registers. */
static inline void tq_device_limit(tq_device *d)
{
    const tqd_values *v = &d->values;
    tq_recorder_limits *l = &d->recorder.limits;
    int n;
    tq_device_motor(&l->motor[TQ_TABLE], v->table_law, 0);
    tq_device_motor(&l->motor[TQ_ARM], v->arm_law, -v->gravity); /* it drives, as a negative load */
    for (n = 0; n < TQ_AXES; n++)
        l->counts[n] = v->counts[0], l->most_a[n] = v->current_limits[0];
    l->nominal_a = v->current_limits[1], l->heat_a2_s = v->current_limits[2];
    l->arm_m = v->contact[0], l->contact_n_per_m = v->contact[1];
    l->speed_loop = v->loops[0], l->force_loop = v->loops[1];
    l->lower_rad_s = v->moves[0], l->lift_rad_s = v->moves[1], l->hold_n_m = v->moves[2];
    l->touch_n = v->bounds[0], l->tolerance = v->bounds[1], l->patience_s = v->bounds[2];
    l->fastest_rad_s = v->bounds[3], l->least_counts = v->counts[1];
}

static inline void tq_device_start(tq_device *d, const tq_board *board)
{
    static const float table[8] = { 2.82e-4f, 0.0273f, 60, 60, 500, 3e-4f, 0.2f, 1e-6f };
    static const float arm[8] = { 1.6e-5f, 0.0273f, 400, 400, 500, 3e-4f, 0.2f, 1e-6f };
    tq_recorder_limits none;
    tqd_values *v = &d->values;
    memset(d, 0, sizeof *d), memset(&none, 0, sizeof none);
    d->board = *board, d->simulate = -1;
    v->who_am_i = TQD_WHO_AM_I_VALUE, v->firmware_version = TQD_FIRMWARE_VERSION_VALUE;
    v->schema_hash = TQD_SCHEMA_HASH_VALUE, v->tick_rate = TQ_TICK_HZ, v->real_size = sizeof(tq_number);
    memcpy(v->table_law, table, sizeof table), memcpy(v->arm_law, arm, sizeof arm);
    v->wanted[0] = 100, v->wanted[1] = 1, v->wanted[2] = 40, v->wanted[3] = 1, v->wanted[4] = 1;
    v->current_limits[0] = board->most_a < 6 ? board->most_a : 6, v->current_limits[2] = 60;
    v->current_limits[1] = v->current_limits[0] < 4.12f ? v->current_limits[0] : 4.12f;
    v->contact[0] = 0.03f, v->contact[1] = 5000, v->loops[0] = 20, v->loops[1] = 60;
    v->moves[0] = 0.3f, v->moves[1] = 0.5f, v->moves[2] = 0.004f;
    v->bounds[0] = 0.15f, v->bounds[1] = 0.02f, v->bounds[2] = 12, v->bounds[3] = 20;
    v->counts[0] = 4096, v->counts[1] = 10;
    tq_recorder_start(&d->recorder, &none);
    tq_device_limit(d);
}

/* --- The tick --------------------------------------------------------------------------------------- */

/* Each motor is told 0, whatever the one before it said. */
static inline void tq_device_shut(tq_device *d)
{
    int n, failed = 0;
    for (n = 0; n < TQ_AXES; n++)
        failed |= d->board.write(d->board.context, n, 0);
    if (d->letting_go && !failed)
        d->letting_go = 0, d->values.zero_tick = d->values.tick;
}

static inline void tq_device_mind(tq_device *d)
{
    uint32_t now = d->values.tick;
    if (d->recorder.phase == TQ_RESTS || d->recorder.phase == TQ_FAILS)
        return;
    if (now - d->heard > TQ_LINK_TICKS)
        tq_recorder_fail(&d->recorder, TQ_LINK_GONE);
    else if (now - d->beat > TQ_BEAT_TICKS)
        tq_recorder_fail(&d->recorder, TQ_BEAT_GONE);
    else if (d->failing)
        tq_recorder_fail(&d->recorder, TQ_NOT_TAKEN);
}

/* Notes when it failed, and when nothing pulled any more. */
static inline void tq_device_note(tq_device *d)
{
    int fails = d->recorder.phase == TQ_FAILS;
    if (fails && !d->began_failed) {
        d->values.fault_tick = d->values.tick, d->letting_go = 1;
        d->values.heard_tick = d->heard;
        tq_device_shut(d);
    }
    else if (d->letting_go)
        tq_device_shut(d);
    d->began_failed = fails;
}

static inline void tq_device_show(tq_device *d)
{
    const tq_recorder *r = &d->recorder;
    tqd_values *v = &d->values;
    v->state = (uint8_t)r->phase, v->cause = (uint8_t)r->reason;
    v->now[0] = (float)tq_recorder_speed(r), v->now[1] = (float)tq_recorder_force(r);
    v->now[2] = (float)tq_recorder_place(r);
    v->now[3] = (float)r->current_a[TQ_TABLE], v->now[4] = (float)r->current_a[TQ_ARM];
    v->found[0] = (float)r->found.speed_mm_s, v->found[1] = (float)r->found.force_n;
    v->found[2] = (float)r->found.speed_sd_mm_s, v->found[3] = (float)r->found.force_sd_n;
    v->found[4] = (float)r->found.start_turn, v->found[5] = (float)r->found.end_turn;
    v->found[6] = (float)r->found.hottest_a2_s, v->found[7] = (float)r->found.duration_s;
}

/* One tick: counters of both encoders modulo 2^16, and 1 while a mark is seen, 2 more where it is the index. */
static inline void tq_device_tick(tq_device *d, const uint16_t counts[TQ_AXES], int marks, int ticks)
{
    int failed = 0, n;
    (void)ticks; /* always one: tq_device_pace */
    tq_device_mind(d);
    tq_recorder_tick(&d->recorder, counts, marks & 1, marks >> 1);
    for (n = 0; n < TQ_AXES; n++)
        failed |= d->board.write(d->board.context, n, d->recorder.current_a[n]);
    d->failing = failed;
    tq_device_note(d);
    d->values.tick++;
}

/* Never several ticks in one: a turntable runs down for seconds, and its counter is followed meanwhile. */
static inline int tq_device_pace(const tq_device *d)
{
    (void)d;
    return 1;
}

/* How many of the board's clocks the last tick took. */
static inline void tq_device_clocks(tq_device *d, uint32_t clocks)
{
    d->clocks_ticks++, d->clocks_sum += clocks;
    if (clocks > d->clocks_most)
        d->clocks_most = clocks;
}

/* --- The host ---------------------------------------------------------------------------------------- */

static inline int tq_device_idle(const tq_device *d)
{
    int phase = d->recorder.phase;
    return phase == TQ_RESTS || phase == TQ_RECORDED || phase == TQ_FAILS;
}

static inline int tq_device_command(tq_device *d, int command)
{
    tq_recorder *r = &d->recorder;
    tq_wanted wanted;
    const float *w = d->values.wanted;
    switch (command) {
    case TQD_COMMAND_START:
        if (!tq_device_idle(d) || r->phase == TQ_FAILS)
            return TQD_STATUS_STATE;
        wanted.speed_mm_s = w[0], wanted.force_n = w[1], wanted.radius_mm = w[2];
        wanted.run_in_s = w[3], wanted.duration_s = w[4];
        d->beat = d->values.tick, d->values.number++;
        tq_recorder_want(r, &wanted);
        return TQD_STATUS_OK;
    case TQD_COMMAND_STOP:
        tq_recorder_fail(r, TQ_STOPPED_SHORT);
        r->current_a[TQ_TABLE] = r->current_a[TQ_ARM] = 0;
        tq_device_shut(d);
        return TQD_STATUS_OK;
    case TQD_COMMAND_CLEAR:
        if (r->phase != TQ_FAILS && r->phase != TQ_RECORDED)
            return TQD_STATUS_STATE;
        tq_recorder_rest_now(r);
        return TQD_STATUS_OK;
    case TQD_COMMAND_FINISH:
        if (r->phase != TQ_RECORDS_NOW)
            return TQD_STATUS_STATE;
        r->enough = 1;
        return TQD_STATUS_OK;
    default:
        return TQD_STATUS_OK;
    }
}

static inline int tq_device_accepts(const tq_device *d, uint8_t address, const uint8_t *value)
{
    float x[3];
    if (address != TQD_CURRENT_LIMITS)
        return 1;
    memcpy(x, value, sizeof x);
    return x[1] <= x[0] && x[0] <= d->board.most_a;
}

static inline int tq_device_apply(tq_device *d, const tqd_register *r, const uint8_t *value)
{
    tqd_values *v = &d->values;
    if ((r->access & TQD_IDLE_ONLY) && !tq_device_idle(d))
        return TQD_STATUS_STATE;
    if (r->address == TQD_COMMAND) {
        int status = tq_device_command(d, value[0]);
        tq_device_show(d);
        return status;
    }
    if (r->address == TQD_SIMULATE && !d->board.simulated)
        return TQD_STATUS_ACCESS;
    memcpy((uint8_t *)v + r->offset, value, (size_t)r->bytes * r->length);
    if (r->address == TQD_HEARTBEAT)
        d->beat = v->tick;
    else if (r->address == TQD_SIMULATE)
        d->simulate = v->simulate;
    else if (r->access & TQD_IDLE_ONLY)
        tq_device_limit(d);
    return TQD_STATUS_OK;
}

static inline void tq_device_look(tq_device *d, const tqd_register *r, uint8_t *value)
{
    tq_device_show(d);
    d->values.simulated = (uint8_t)d->board.simulated, d->values.frames_bad = d->reader.bad;
    if (r->address == TQD_TICK_CLOCKS) {
        d->values.tick_clocks[0] = d->clocks_ticks ? (uint32_t)(d->clocks_sum / d->clocks_ticks) : 0;
        d->values.tick_clocks[1] = d->clocks_most;
        d->clocks_ticks = d->clocks_most = 0, d->clocks_sum = 0;
    }
    memcpy(value, (const uint8_t *)&d->values + r->offset, (size_t)r->bytes * r->length);
}

static inline void tq_device_upload(tq_device *d, const tq_frame *f)
{
    tq_device_reply(d, f, TQD_STATUS_KIND, NULL, 0);
}

static inline void tq_device_greeted(tq_device *d)
{
    if (d->recorder.phase != TQ_RESTS)
        tq_recorder_fail(&d->recorder, TQ_OTHER_HOST);
    d->beat = d->values.tick;
}

/* It sends nothing by itself. */
static inline void tq_device_poll(tq_device *d)
{
    (void)d;
}

#endif
