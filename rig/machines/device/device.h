/* The device: what its firmware does at every tick, and with every byte that comes. docs/device.md

   Two places call it: an interrupt (or a loop) 5000 times a second calls tq_device_tick; whenever there
   are bytes, and else at leisure, the main loop calls tq_device_received and tq_device_poll. What both
   touch is touched between board->lock and board->unlock. No allocation, no clock but its ticks, no globals:
   the same file runs behind a pseudo-terminal, in virtual time and on a micro-controller. C99.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_DEVICE_H
#define TQ_DEVICE_H

#include "cables.h"
#include "force.h"
#include "model.h"
#include "registers.h"
#include "tension.h"
#include "weigh.h"
#include "wire.h"

#define TQ_TICK_HZ 5000
enum {
    TQ_READ_TICKS = 5,                   /* from one reading of the hand to the next: 1 ms */
    TQ_REST_TICKS = 10,                  /* of a device that has nothing to do, in one */
    TQ_LINK_TICKS = TQ_TICK_HZ / 10,     /* a host that says nothing for so long is gone */
    TQ_BEAT_TICKS = TQ_TICK_HZ,          /* and so is its control loop */
    TQ_FLUSH_TICKS = TQ_TICK_HZ / 500,   /* a record waits no longer for others of its frame */
    TQ_RECORDS = 64, TQ_PER_FRAME = 10, TQ_RECORD_BYTES = 21, TQ_EVENT_HEADER = 11,
    TQ_SAMPLES = 1024, TQ_MOST_QUEUED = 1000,
    TQ_SLACK_READINGS = 10,              /* in so many of its own a cable that carries too little is slack */
    TQ_TAPS = 64,                        /* of the tracking filter at most: twice its delay in ms */
    TQ_OUTPUTS = 3, TQ_VIBRATOR = 2
};

/* What is written for a board. docs/device.md#porting */
typedef struct {
    void *context;
    /* A motor's current (A) or the vibrator's acceleration (g) from now on; not 0 where that failed. */
    int (*write)(void *context, int output, tq_number value);
    /* Bytes that can be sent at once, and sending them. */
    size_t (*room)(void *context);
    void (*send)(void *context, const uint8_t *bytes, size_t count);
    /* Keep the tick from coming in between. */
    void (*lock)(void *context);
    void (*unlock)(void *context);
    tq_cables cables;
    float most_g;     /* what the vibrator's converter takes at most */
    uint32_t entropy; /* differs from one start to the next */
    uint32_t baud;    /* of the port; 0 where it has none */
    int simulated;    /* whether there is no hand */
} tq_board;

typedef struct {
    uint32_t number, tick;
    float x_mm, depth_mm, speed_mm_s, force_n, vibration_g;
    uint8_t flags;
} tq_record;

typedef struct {
    tq_board board;
    tqd_values values;
    tq_force force;
    /* The link. */
    tq_reader reader;
    uint32_t nonce, heard, beat;
    int greeted;
    uint16_t expected, replied;   /* sequence of the next frame, check of the last one */
    uint8_t reply[TQ_MOST_STUFFED];
    size_t reply_bytes;
    /* The encoders. */
    uint16_t counts[TQ_MOTORS];
    int32_t counted[TQ_MOTORS], still[TQ_MOTORS]; /* since home; at the last move of each encoder */
    uint32_t most_still; /* counts of the other one in the meantime: 3 mm */
    int counting, homed;
    tq_number rest_mm[TQ_MOTORS], length_mm[TQ_MOTORS]; /* of the cables, at home and now */
    /* Speed along x: the tracking filter on one position in a millisecond. */
    float track_mm[2 * TQ_TAPS], weights[TQ_TAPS]; /* twice in a row, from track_at on the oldest first */
    int tracked, taps, track_at;
    /* Currents and what they heat. */
    tq_number current_a[TQ_MOTORS], heat_a2_s[TQ_MOTORS];
    tq_number least_n, most_tension_n[2]; /* of a cable; the largest one of a cool and of a hot motor */
    int clipped, failing, releasing;
    /* What each cable carries, by its motor's movement. */
    tq_motor motor;
    tq_felt felt[TQ_MOTORS];
    tq_number m_s_per_count;
    int noted; /* the state at the end of the last tick; commands come in between */
    /* The vibration. */
    tq_upload uploads[2];
    tq_texture textures[2];
    uint64_t hashes[2];
    tq_scene scene;
    tq_scene_hand hand;
    tq_real memory[TQ_MEMORY(TQ_MOST_LAYERS + 1, 0)];
    int playing, slot; /* whether there is a model; which upload is being filled, -1 for none */
    uint32_t upload_bytes, upload_count;
    uint64_t switches;
    float samples[TQ_SAMPLES];
    uint32_t samples_in, samples_out;
    float block_g[TQ_READ_TICKS]; /* of the model, from one reading to the next */
    int block_at;
    uint32_t read_tick; /* readings so far */
    tq_number vibration_g;
    /* Sums over what was played: the samples since the last reading, and what is below 1e-6 g². */
    float recent_g[TQ_READ_TICKS], peak_g, square_left, weighted_left;
    tq_weighting weighting;
    int recent;
    uint32_t missed; /* before this source */
    /* Records, from the tick to the main loop. */
    tq_record records[TQ_RECORDS];
    volatile uint32_t records_in, records_out;
    uint32_t record_number, record_every;
    /* Clocks that ticks took. */
    uint32_t clocks_ticks, clocks_sum, clocks_most;
    int simulate; /* what a simulated board has to do next, -1 for nothing */
} tq_device;

#include "served.h"

/* --- Start ---------------------------------------------------------------------------------------- */

/* Integral of the tracking filter's weight up to here; rig/devices/hand/tracking.py. */
static inline float tq_smooth(float share)
{
    return share * share * (3 - 2 * share);
}

static inline void tq_device_defaults(tq_device *d)
{
    tqd_values *v = &d->values;
    v->who_am_i = TQD_WHO_AM_I_VALUE, v->firmware_version = TQD_FIRMWARE_VERSION_VALUE;
    v->schema_hash = TQD_SCHEMA_HASH_VALUE;
    v->tick_rate = TQ_TICK_HZ, v->real_size = sizeof(tq_real), v->most_layers = TQ_MOST_LAYERS;
    v->model_capacity = sizeof d->uploads[0].bytes;
    v->wall[0] = 0, v->wall[1] = 1, v->wall[2] = 0, v->wall[3] = 100, v->wall[4] = 300;
    v->frozen_time = 0.25f, v->release_time = 0.02f, v->speed_delay = 10, v->vibration_scale = 1;
    v->force_limit = 5, v->force_slew = 2000, v->power_limit = 5, v->speed_limit = 1000;
    v->workspace[0] = -210, v->workspace[1] = 210, v->workspace[2] = -60, v->workspace[3] = -5;
    v->current_limit = 6, v->heat_limit = 20, v->vibration_limit = 5;
    v->tension_range[0] = 0.2f, v->tension_range[1] = 16;
    v->contact_force = 0.05f;
    v->stroke[0] = 40, v->stroke[1] = 0.5f, v->stroke[2] = 4;
}

/* The limits of the law and of the cables, from the registers. */
static inline void tq_device_limit(tq_device *d)
{
    tq_force_limits *l = &d->force.limits;
    const tqd_values *v = &d->values;
    const tq_cables *c = &d->board.cables;
    int n;
    memset(l, 0, sizeof *l);
    l->late_s = 1, l->frozen_s = v->frozen_time, l->release_s = v->release_time, l->show_s = (tq_number)0.2;
    l->most_n = v->force_limit, l->most_n_per_s = v->force_slew, l->most_w = v->power_limit;
    l->most_mm_s = v->speed_limit, l->jump_mm = 1, l->velocity_hz = 100;
    l->low_mm[0] = v->workspace[0], l->high_mm[0] = v->workspace[1];
    l->low_mm[1] = -1, l->high_mm[1] = 1;
    l->low_mm[2] = v->workspace[2], l->high_mm[2] = v->workspace[3];
    l->origin_mm[2] = -50;
    for (n = 0; n < 3; n++)
        l->axes[4 * n] = 1;
    l->probe_n = v->force_limit > 1 ? 1 : v->force_limit < 0.5f ? 0 : v->force_limit; /* as rig/desk/parts.py */
    d->least_n = v->tension_range[0] > c->rewind_n ? v->tension_range[0] : c->rewind_n;
    if (d->least_n > v->current_limit * c->n_per_a + c->rewind_n)
        d->least_n = v->current_limit * c->n_per_a + c->rewind_n;
    for (n = 0; n < 2; n++) {
        tq_number current = n && v->current_limit > c->nominal_a ? c->nominal_a : v->current_limit;
        tq_number bound = current * c->n_per_a + c->rewind_n;
        d->most_tension_n[n] = bound < v->tension_range[1] ? bound : v->tension_range[1];
    }
}

/* The tracking filter with this delay, anew. */
static inline void tq_device_track(tq_device *d)
{
    int n, taps = 2 * d->values.speed_delay;
    for (n = 0; n < taps; n++)
        d->weights[n] = (tq_smooth((float)(n + 1) / (float)taps) - tq_smooth((float)n / (float)taps))
                        * (float)(TQ_TICK_HZ / TQ_READ_TICKS);
    d->taps = taps, d->tracked = d->track_at = 0;
}

/* The tool stands in its rest: the counters start from the lengths that the cables have there. */
static inline void tq_device_home(tq_device *d)
{
    int n;
    for (n = 0; n < TQ_MOTORS; n++)
        d->counted[n] = d->still[n] = 0;
    memset(d->felt, 0, sizeof d->felt);
    d->homed = 1, d->force.sensed = 0, d->tracked = 0;
}

/* Everything off, without force, and nothing greeted. */
static inline void tq_device_start(tq_device *d, const tq_board *board)
{
    const tq_number felt_s = (tq_number)(2 * TQ_READ_TICKS) / TQ_TICK_HZ;
    tq_force_limits none;
    int n;
    memset(d, 0, sizeof *d);
    d->board = *board;
    d->slot = d->simulate = -1, d->block_at = TQ_READ_TICKS;
    tq_device_defaults(d);
    memset(&none, 0, sizeof none);
    tq_force_start(&d->force, &none);
    tq_device_limit(d);
    tq_device_home(d);
    d->homed = 0;
    for (n = 0; n < TQ_MOTORS; n++)
        d->rest_mm[n] =
            tq_cable_length(&board->cables, n, board->cables.rest_x_mm, board->cables.rest_z_mm);
    d->most_still = (uint32_t)tq_truncated(3 / tq_force_size(board->cables.mm_per_count));
    d->motor = tq_cable_motor(&board->cables, felt_s);
    d->m_s_per_count = board->cables.mm_per_count / 1000 / felt_s;
    tq_device_track(d);
    d->values.vibration_range = board->most_g;
    d->values.stiffness_limit = (float)tq_largest_stiffness(
        board->cables.damping_n_s_per_mm, 0, (tq_number)1 / TQ_TICK_HZ, (tq_number)1 / TQ_TICK_HZ);
    d->values.state = (uint8_t)d->force.state;
}

/* --- The tick: force ------------------------------------------------------------------------------ */

/* Each output is told 0, whatever the ones before it said; the first that failed is reported. */
static inline void tq_device_shut(tq_device *d)
{
    int n, error = 0;
    for (n = 0; n < TQ_OUTPUTS; n++)
        if (d->board.write(d->board.context, n, 0) && !error)
            error = n + 1;
    d->values.shutdown_error = (uint8_t)error;
}

static inline void tq_device_count(tq_device *d, const uint16_t counts[TQ_MOTORS])
{
    int n;
    for (n = 0; n < TQ_MOTORS; n++) {
        uint16_t moved = d->counting ? (uint16_t)(counts[n] - d->counts[n]) : 0;
        d->counted[n] = tq_counts_on(d->counted[n], moved);
        d->counts[n] = counts[n];
        d->length_mm[n] = d->rest_mm[n] + (tq_number)d->counted[n] * d->board.cables.mm_per_count;
    }
    d->counting = 1;
}

/* Whether one encoder has stood still while the other one went on for 3 mm. */
static inline int tq_device_stuck(tq_device *d)
{
    uint32_t moved[TQ_MOTORS];
    int n;
    if (!d->force.engaged) { /* no wall can push; on the way to the real surface one encoder may well stand still */
        for (n = 0; n < TQ_MOTORS; n++)
            d->still[n] = d->counted[n];
        return 0;
    }
    for (n = 0; n < TQ_MOTORS; n++)
        moved[n] = tq_counts_apart(d->counted[n], d->still[n]);
    if ((moved[0] == 0 && moved[1] > d->most_still) || (moved[1] == 0 && moved[0] > d->most_still))
        return 1;
    if (moved[0] != 0 && moved[1] != 0)
        for (n = 0; n < TQ_MOTORS; n++)
            d->still[n] = d->counted[n];
    return 0;
}

/* Lets go where a cable is slack. One cable in each reading, in turn; none while a tick stands for several. */
static inline void tq_device_feel(tq_device *d, int ticks)
{
    const int n = (int)(d->read_tick & 1);
    if (ticks != 1)
        memset(d->felt, 0, sizeof d->felt);
    else
        tq_feel(&d->felt[n], &d->motor, d->current_a[n], d->counted[n], d->m_s_per_count);
    if (d->felt[n].slack >= TQ_SLACK_READINGS && (d->force.state == TQ_ARMED || d->force.state == TQ_RUNNING))
        tq_force_event(&d->force, TQ_FAILED, TQ_SLACK);
}

static inline void tq_device_sense(tq_device *d, int button, tq_sensed *sensed)
{
    tq_number x = 0, z = 0;
    memset(sensed, 0, sizeof *sensed);
    sensed->failed = !tq_cables_place(&d->board.cables, d->length_mm, &x, &z);
    sensed->position_mm[0] = x, sensed->position_mm[2] = z;
    sensed->button = button;
}

/* Lets go where the host is gone, or its control loop. */
static inline void tq_device_mind(tq_device *d)
{
    uint32_t now = d->values.tick;
    if (d->force.state != TQ_ARMED && d->force.state != TQ_RUNNING)
        return;
    if (now - d->heard > TQ_LINK_TICKS)
        tq_force_event(&d->force, TQ_FAILED, TQ_LINK_LOST);
    else if (now - d->beat > TQ_BEAT_TICKS)
        tq_force_event(&d->force, TQ_FAILED, TQ_HEARTBEAT_LOST);
    else if (d->failing)
        tq_force_event(&d->force, TQ_FAILED, TQ_NOT_WRITTEN);
}

/* Currents for the force that was decided; none in a state without force. Springs on the pulleys pull, whatever
   the current. */
static inline void tq_device_pull(tq_device *d)
{
    const tq_cables *c = &d->board.cables;
    const tqd_values *v = &d->values;
    const tq_number step_s = (tq_number)1 / TQ_TICK_HZ, rewind = c->rewind_n, n_per_a = c->n_per_a;
    const tq_number nominal = c->nominal_a, least = d->least_n;
    int state = d->force.state, n;
    int allowed = state == TQ_ARMED || state == TQ_RUNNING;
    tq_number tension[TQ_MOTORS] = { 0, 0 }, most = 1, force = d->force.normal_n > 0 ? d->force.normal_n : 0;
    if (allowed || state == TQ_RELEASING)
        if (d->force.position_mm[2] < 49) /* z = -1 mm: below the motors */
            tq_cables_tensions(c, d->length_mm, d->force.position_mm[0], d->force.position_mm[2] - 50, force,
                               tension);
    d->clipped = 0;
    for (n = 0; n < TQ_MOTORS; n++) { /* both by one factor: the force keeps its direction */
        tq_number bound = d->most_tension_n[d->heat_a2_s[n] >= (tq_number)v->heat_limit];
        if (tension[n] > bound) {
            d->clipped = 1;
            if (bound / tension[n] < most)
                most = bound / tension[n];
        }
    }
    for (n = 0; n < TQ_MOTORS; n++) {
        tq_number current, over, pulls = tension[n] * most;
        if (allowed && pulls < least) /* below 0: outside the cone */
            pulls = least, d->clipped |= force > 0;
        current = pulls > rewind ? (pulls - rewind) / n_per_a : 0;
        over = d->heat_a2_s[n] + (current * current - nominal * nominal) * step_s;
        over = over > 0 ? over : 0;
        d->heat_a2_s[n] = over, d->values.heat[n] = (float)over;
        d->current_a[n] = current;
        d->values.tension[n] = (float)(current * n_per_a + rewind);
        d->values.current[n] = (float)current;
    }
}

/* Notes when it let go, and when nothing pulled any more; shuts every output then. */
static inline void tq_device_note(tq_device *d)
{
    int state = d->force.state, before = d->noted;
    d->noted = state;
    if ((before == TQ_ARMED || before == TQ_RUNNING) && (state == TQ_RELEASING || state == TQ_FAULT)) {
        d->values.fault_tick = d->values.tick;
        d->values.heard_tick = d->heard;
        d->releasing = 1;
    }
    if (state == TQ_FAULT && d->releasing) {
        d->releasing = 0;
        d->values.zero_tick = d->values.tick;
        tq_device_shut(d);
    }
}

static inline void tq_device_act(tq_device *d)
{
    int failed = 0, n;
    for (n = 0; n < TQ_MOTORS; n++)
        failed |= d->board.write(d->board.context, n, d->current_a[n]);
    failed |= d->board.write(d->board.context, TQ_VIBRATOR, d->vibration_g * (tq_number)d->values.vibration_scale);
    d->failing = failed;
}

/* --- The tick: vibration --------------------------------------------------------------------------- */

/* Speed along x by the tracking filter, once in a millisecond. */
static inline float tq_device_speed(tq_device *d)
{
    float x = (float)d->force.position_mm[0], before, speed = 0;
    const float *past;
    int n, taps = d->taps;
    if (!d->tracked)
        for (n = 0; n < 2 * taps; n++)
            d->track_mm[n] = x;
    d->tracked = 1;
    past = d->track_mm + d->track_at, before = past[0];
    for (n = 1; n < taps; n++) {
        speed += (past[n] - before) * d->weights[n - 1];
        before = past[n];
    }
    d->track_mm[d->track_at] = d->track_mm[d->track_at + taps] = x;
    d->track_at = d->track_at + 1 < taps ? d->track_at + 1 : 0;
    return speed + (x - before) * d->weights[taps - 1];
}

/* Whether the model renders: while it is the source, and afterwards without a hand, until it has faded out,
   another one has taken its place and the limit of duration has seen a pause. Then it stands still. */
static inline int tq_device_renders(const tq_device *d)
{
    if (!d->playing || d->values.source == TQD_SOURCE_HOST)
        return 0;
    return d->values.source == TQD_SOURCE_MODEL || d->hand.now != d->hand.wanted || d->hand.state.sounding
           || !tq_scene_silent(&d->hand);
}

/* The model's samples from this reading to the next: as many bits as one by one, at half the cost. */
static inline void tq_device_model_block(tq_device *d)
{
    tq_real block[TQ_READ_TICKS];
    int n;
    tq_scene_read(&d->hand, 0, d->values.speed, d->values.source == TQD_SOURCE_MODEL ? d->values.force : 0);
    tq_scene_render_on(&d->hand, block, TQ_READ_TICKS);
    for (n = 0; n < TQ_READ_TICKS; n++)
        d->block_g[n] = (float)block[n];
    d->block_at = 0;
    if (d->hand.switches != d->switches) { /* in this block */
        d->switches = d->hand.switches;
        d->values.model_tick = d->values.tick + TQ_READ_TICKS - (uint32_t)d->hand.state.position;
        d->values.model_hash = d->hashes[d->hand.now];
    } else if (d->hand.state.position == TQ_READ_TICKS) {
        d->values.model_tick = d->values.tick;
    }
}

static inline float tq_device_host_sample(tq_device *d)
{
    if (d->samples_in != d->samples_out)
        return d->samples[d->samples_out++ % TQ_SAMPLES];
    if (d->values.source != TQD_SOURCE_HOST)
        return 0;
    d->values.samples_missed++;
    return 0.9f * d->values.vibration; /* a step to 0 would be felt */
}

/* Adds a rest and a sum to a whole number of 1e-6 g²; what is less stays for the next time. */
static inline void tq_device_add(uint64_t *sum, float *left, float square)
{
    uint32_t whole;
    *left += square < 4000 ? square : 4000; /* of five samples at most 2000 but with an odd weighting */
    whole = *left > 0 ? (uint32_t)(*left * 1e6f) : 0; /* rounding may leave a rest below 0 */
    *sum += whole, *left -= (float)whole * 1e-6f;
}

/* Takes the samples since the last reading into the sums. */
static inline void tq_device_sum(tq_device *d)
{
    float square = 0, weighted = 0;
    int n;
    for (n = 0; n < d->recent; n++) {
        float x = d->recent_g[n], y = (float)tq_weigh(&d->weighting, x), size = x < 0 ? -x : x;
        square += x * x, weighted += y * y;
        d->values.played[0] += x != 0 || d->values.source != TQD_SOURCE_NOTHING;
        if (size > d->peak_g)
            d->peak_g = size;
    }
    d->recent = 0;
    tq_device_add(&d->values.played[1], &d->square_left, square);
    tq_device_add(&d->values.played[2], &d->weighted_left, weighted);
}

/* The next sample. */
static inline void tq_device_vibrate(tq_device *d, int reads)
{
    float sample = 0, most = d->values.vibration_limit;
    if (reads) {
        float newton = (float)tq_force_felt(&d->force);
        d->values.speed = tq_device_speed(d);
        d->values.force = newton >= d->values.contact_force ? newton : 0;
        if (tq_device_renders(d))
            tq_device_model_block(d);
    }
    if (d->values.source == TQD_SOURCE_HOST)
        sample = tq_device_host_sample(d);
    else if (d->block_at < TQ_READ_TICKS)
        sample = d->block_g[d->block_at++];
    else if (d->values.vibration > 1e-4f || d->values.vibration < -1e-4f)
        sample = 0.9f * d->values.vibration; /* the host's samples ended in their midst */
    if (!(sample <= most && sample >= -most)) { /* not a number: never with a model that was checked */
        sample = sample > most ? most : sample < -most ? -most : 0;
        d->values.played[4]++;
    }
    d->recent_g[d->recent++] = sample;
    if (d->recent == TQ_READ_TICKS)
        tq_device_sum(d);
    d->values.vibration = sample, d->vibration_g = (tq_number)sample;
}

/* --- The tick: records ------------------------------------------------------------------------------ */

static inline void tq_device_record(tq_device *d, int button)
{
    const tqd_values *v = &d->values;
    tq_record *r;
    uint32_t number = d->record_number;
    if (!d->record_every || v->tick % d->record_every)
        return;
    d->record_number++;
    if (d->records_in - d->records_out >= TQ_RECORDS) {
        d->values.records_lost++;
        return;
    }
    r = &d->records[d->records_in % TQ_RECORDS];
    r->number = number, r->tick = v->tick;
    r->x_mm = v->position[0], r->depth_mm = v->depth, r->speed_mm_s = v->speed, r->force_n = v->force;
    r->vibration_g = v->vibration;
    r->flags = (uint8_t)((v->force > 0 ? TQD_FLAGS_CONTACT : 0) | (button ? TQD_FLAGS_BUTTON : 0)
                         | (d->clipped ? TQD_FLAGS_CLIPPED : 0) | (d->force.beyond ? TQD_FLAGS_BEYOND : 0)
                         | (v->source == TQD_SOURCE_HOST && d->samples_in == d->samples_out
                                ? TQD_FLAGS_EMPTY : 0)
                         | (d->board.simulated ? TQD_FLAGS_SIMULATED : 0)
                         | (d->felt[0].slack || d->felt[1].slack ? TQD_FLAGS_SLACK : 0));
    d->records_in++; /* after the record is whole: the main loop reads it then */
}

/* How many ticks the next one may stand for: several while there is neither force nor vibration nor anybody
   who wants records. */
static inline int tq_device_pace(const tq_device *d)
{
    int state = d->force.state, idle = state == TQ_BOOT || state == TQ_IDLE || state == TQ_FAULT;
    int quiet = d->values.source == TQD_SOURCE_NOTHING && d->values.vibration == 0 && !tq_device_renders(d);
    return idle && quiet && !d->record_every ? TQ_REST_TICKS : 1;
}

/* One tick, or `ticks` in one: the encoders' counters, modulo 2^16, and the button. */
static inline void tq_device_tick(tq_device *d, const uint16_t counts[TQ_MOTORS], int button, int ticks)
{
    tq_sensed sensed;
    tqd_values *v = &d->values;
    int reads = v->tick / TQ_READ_TICKS != d->read_tick;
    d->read_tick = v->tick / TQ_READ_TICKS;
    tq_device_count(d, counts);
    tq_device_sense(d, button, &sensed);
    tq_device_mind(d);
    d->force.off = button; /* the real surface is touched then */
    tq_force_tick(&d->force, &sensed, (tq_number)ticks / TQ_TICK_HZ);
    if (tq_device_stuck(d) && (d->force.state == TQ_ARMED || d->force.state == TQ_RUNNING))
        tq_force_event(&d->force, TQ_FAILED, TQ_STUCK); /* unless it jumped */
    if (reads)
        tq_device_feel(d, ticks);
    tq_device_pull(d);
    v->position[0] = (float)sensed.position_mm[0], v->position[1] = (float)sensed.position_mm[2];
    v->depth = (float)d->force.depth_mm, v->button = (uint8_t)button;
    tq_device_vibrate(d, reads);
    v->state = (uint8_t)d->force.state, v->cause = (uint8_t)d->force.cause;
    tq_device_act(d);
    tq_device_note(d);
    tq_device_record(d, button);
    v->tick += (uint32_t)ticks;
}

/* How many of the board's clocks the last tick took. */
static inline void tq_device_clocks(tq_device *d, uint32_t clocks)
{
    d->clocks_ticks++, d->clocks_sum += clocks;
    if (clocks > d->clocks_most)
        d->clocks_most = clocks;
}

/* --- Frames: commands -------------------------------------------------------------------------------- */

static inline int tq_device_command(tq_device *d, int command)
{
    tq_force *f = &d->force;
    int state = f->state, idle = state == TQ_BOOT || state == TQ_IDLE || state == TQ_FAULT;
    tq_wall wall;
    switch (command) {
    case TQD_COMMAND_ARM:
        if (state != TQ_IDLE || !d->homed)
            return TQD_STATUS_STATE;
        d->beat = d->values.tick;
        tq_force_event(f, TQ_ARM, 0);
        return TQD_STATUS_OK;
    case TQD_COMMAND_SHOW:
        if (state != TQ_ARMED && state != TQ_RUNNING)
            return TQD_STATUS_STATE;
        wall.height_mm = d->values.wall[0], wall.stiffness_n_per_mm = d->values.wall[1];
        wall.damping_n_s_per_mm = d->values.wall[2];
        wall.half_x_mm = d->values.wall[3], wall.half_y_mm = d->values.wall[4];
        if (memcmp(&wall, &f->wall, sizeof wall))
            tq_force_set_wall(f, &wall);
        tq_force_event(f, TQ_SHOW, 0);
        return TQD_STATUS_OK;
    case TQD_COMMAND_HIDE:
        if (state != TQ_RUNNING && state != TQ_ARMED)
            return TQD_STATUS_STATE;
        tq_force_event(f, TQ_HIDE, 0);
        return TQD_STATUS_OK;
    case TQD_COMMAND_CLEAR:
        if (state != TQ_FAULT)
            return TQD_STATUS_STATE;
        tq_force_event(f, TQ_CLEAR, 0);
        return TQD_STATUS_OK;
    case TQD_COMMAND_STOP:
        tq_force_event(f, TQ_FAILED, TQ_STOPPED);
        return TQD_STATUS_OK;
    case TQD_COMMAND_HOME:
        if (!idle)
            return TQD_STATUS_STATE;
        tq_device_home(d);
        return TQD_STATUS_OK;
    default:
        return TQD_STATUS_OK;
    }
}

/* Whether so many records in a second divide the ticks, and fit through the port with a fifth to spare. */
static inline int tq_device_carries(const tq_device *d, uint32_t rate)
{
    uint32_t frames = rate < TQ_TICK_HZ / TQ_FLUSH_TICKS ? rate : TQ_TICK_HZ / TQ_FLUSH_TICKS;
    uint32_t bytes = rate * TQ_RECORD_BYTES + frames * (TQ_EVENT_HEADER + TQ_HEADER + 5);
    if (rate && TQ_TICK_HZ % rate)
        return 0;
    return !d->board.baud || bytes <= d->board.baud / 10 / 5 * 4;
}

/* How many sections of a weighting are given, the others being 0; -1 where one of them is not stable. */
static inline int tq_device_sections(const uint8_t *value)
{
    float section[5];
    int n, count = 0;
    for (n = 0; n < TQ_WEIGHTS; n++) {
        float a1, a2;
        memcpy(section, value + sizeof section * (size_t)n, sizeof section);
        a1 = section[3] < 0 ? -section[3] : section[3], a2 = section[4];
        if (!(a2 < 1 && a1 < 1 + a2))
            return -1;
        if (section[0] != 0 || section[1] != 0 || section[2] != 0)
            count = n + 1;
    }
    return count;
}

/* A weighting from its beginning. */
static inline void tq_device_weighting(tq_device *d, const uint8_t *value)
{
    tq_weighting *w = &d->weighting;
    int n;
    memset(w, 0, sizeof *w);
    w->count = tq_device_sections(value);
    for (n = 0; n < 5 * TQ_WEIGHTS; n++)
        w->section[n / 5][n % 5] = d->values.weighting[n];
}

/* What a value must be beside its range. */
static inline int tq_device_accepts(const tq_device *d, uint8_t address, const uint8_t *value)
{
    float x[5] = { 0, 0, 0, 0, 0 };
    tq_number bound;
    switch (address) {
    case TQD_WALL:
        memcpy(x, value, sizeof x);
        bound = tq_largest_stiffness(d->board.cables.damping_n_s_per_mm, x[2], (tq_number)1 / TQ_TICK_HZ,
                                     (tq_number)1 / TQ_TICK_HZ);
        return x[1] > 0 && (tq_number)x[1] <= bound;
    case TQD_WORKSPACE:
        memcpy(x, value, 4 * sizeof x[0]);
        return x[0] < x[1] && x[2] < x[3];
    case TQD_TENSION_RANGE:
        memcpy(x, value, 2 * sizeof x[0]);
        return x[0] < x[1];
    case TQD_WEIGHTING:
        return tq_device_sections(value) >= 0;
    case TQD_EVENT_RATE:
        return tq_device_carries(d, (uint32_t)(value[0] | value[1] << 8));
    default:
        return 1;
    }
}

static inline int tq_device_queue(tq_device *d, const uint8_t *value, uint32_t count)
{
    uint32_t n;
    if (d->samples_in - d->samples_out + count > TQ_MOST_QUEUED)
        return TQD_STATUS_FULL;
    for (n = 0; n < count; n++)
        memcpy(&d->samples[(d->samples_in + n) % TQ_SAMPLES], value + 4 * n, 4);
    d->samples_in += count;
    return TQD_STATUS_OK;
}

/* Puts a checked value where it counts; under the lock. */
static inline int tq_device_apply(tq_device *d, const tqd_register *r, const uint8_t *value)
{
    tqd_values *v = &d->values;
    int state = d->force.state;
    if ((r->access & TQD_IDLE_ONLY) && (state == TQ_ARMED || state == TQ_RUNNING || state == TQ_RELEASING))
        return TQD_STATUS_STATE;
    if (r->address == TQD_COMMAND) {
        int status = tq_device_command(d, value[0]);
        v->state = (uint8_t)d->force.state, v->cause = (uint8_t)d->force.cause;
        return status;
    }
    if (r->address == TQD_SAMPLES)
        return tq_device_queue(d, value, r->length);
    if ((r->address == TQD_SIMULATE || r->address == TQD_STROKE) && !d->board.simulated)
        return TQD_STATUS_ACCESS;
    if (r->address == TQD_SOURCE && value[0] == TQD_SOURCE_MODEL && !d->playing)
        return TQD_STATUS_STATE; /* there is no model */
    memcpy((uint8_t *)v + r->offset, value, (size_t)r->bytes * r->length);
    switch (r->address) {
    case TQD_HEARTBEAT:
        d->beat = v->tick;
        break;
    case TQD_EVENT_RATE:
        d->record_every = v->event_rate ? TQ_TICK_HZ / (uint32_t)v->event_rate : 0;
        d->record_number = 0, d->records_out = d->records_in;
        break;
    case TQD_SOURCE:
        if (v->source != TQD_SOURCE_HOST)
            d->samples_out = d->samples_in;
        if (v->source != TQD_SOURCE_NOTHING) {
            d->block_at = v->source == TQD_SOURCE_HOST ? TQ_READ_TICKS : d->block_at, d->recent = 0;
            memset(v->played, 0, sizeof v->played);
            d->missed = v->samples_missed + v->ticks_late;
            d->peak_g = d->square_left = d->weighted_left = 0;
        }
        break;
    case TQD_WEIGHTING:
        tq_device_weighting(d, value);
        break;
    case TQD_SPEED_DELAY:
        tq_device_track(d);
        break;
    case TQD_SIMULATE:
        d->simulate = v->simulate;
        break;
    default:
        if (r->access & TQD_IDLE_ONLY)
            tq_device_limit(d);
        break;
    }
    return TQD_STATUS_OK;
}

/* The value of a register, as it is now; under the lock. */
static inline void tq_device_look(tq_device *d, const tqd_register *r, uint8_t *value)
{
    tqd_values *v = &d->values;
    v->homed = (uint8_t)d->homed, v->simulated = (uint8_t)d->board.simulated;
    if (r->address == TQD_SAMPLES_QUEUED)
        v->samples_queued = (uint16_t)(d->samples_in - d->samples_out);
    if (r->address == TQD_FRAMES_BAD)
        v->frames_bad = d->reader.bad;
    if (r->address == TQD_TICK_CLOCKS) {
        v->tick_clocks[0] = d->clocks_ticks ? d->clocks_sum / d->clocks_ticks : 0;
        v->tick_clocks[1] = d->clocks_most;
        d->clocks_ticks = d->clocks_sum = d->clocks_most = 0;
    }
    if (r->address == TQD_PLAYED) {
        v->played[3] = (uint64_t)(d->peak_g * 1e6f);
        v->played[5] = v->samples_missed + v->ticks_late - d->missed;
        d->peak_g = 0;
    }
    if (r->address == TQD_CORRECTIONS && d->playing) {
        const tq_counters *c = &d->hand.state.counters;
        v->corrections[0] = c->lift_offs, v->corrections[1] = c->above_grid, v->corrections[2] = c->below_grid;
        v->corrections[3] = c->clamped, v->corrections[4] = c->peak, v->corrections[5] = c->rms;
        v->corrections[6] = c->duration;
    }
    memcpy(value, (const uint8_t *)v + r->offset, (size_t)r->bytes * r->length);
}

/* --- Frames: uploads --------------------------------------------------------------------------------- */

static inline int tq_device_begin(tq_device *d, const tq_frame *f)
{
    uint32_t size;
    if (f->length != 5)
        return TQD_STATUS_LENGTH;
    memcpy(&size, f->body + 1, 4);
    d->slot = -1;
    if (size > sizeof d->uploads[0].bytes)
        return TQD_STATUS_TOO_LARGE;
    if (d->playing && d->hand.now != d->hand.wanted)
        return TQD_STATUS_BUSY;
    d->slot = d->playing ? 1 - d->hand.now : 0;
    d->upload_bytes = size, d->upload_count = 0;
    return TQD_STATUS_OK;
}

static inline int tq_device_data(tq_device *d, const tq_frame *f)
{
    uint32_t at, count = f->length - 5u;
    if (f->length < 6)
        return TQD_STATUS_LENGTH;
    memcpy(&at, f->body + 1, 4);
    if (d->slot < 0)
        return TQD_STATUS_STATE;
    if (at != d->upload_count)
        return TQD_STATUS_RANGE;
    if (count > d->upload_bytes - d->upload_count)
        return TQD_STATUS_TOO_LARGE;
    memcpy(d->uploads[d->slot].bytes + at, f->body + 5, count);
    d->upload_count += count;
    return TQD_STATUS_OK;
}

/* Checks the whole, and has the hand touch it from now on, the one before first fading out. */
static inline int tq_device_finish(tq_device *d, const tq_frame *f)
{
    uint64_t hash;
    int slot = d->slot, fault;
    if (f->length != 9)
        return TQD_STATUS_LENGTH;
    memcpy(&hash, f->body + 1, 8);
    if (slot < 0)
        return TQD_STATUS_STATE;
    d->slot = -1;
    if (d->upload_count != d->upload_bytes || hash != tq_hash(d->uploads[slot].bytes, d->upload_count))
        fault = TQD_MODELFAULT_HASH;
    else
        fault = tq_model_fault(&d->uploads[slot], d->upload_count, TQ_TICK_HZ, &d->textures[slot]);
    d->values.model_fault = (uint8_t)fault;
    if (fault)
        return TQD_STATUS_MODEL;
    d->hashes[slot] = hash;
    d->board.lock(d->board.context);
    if (d->playing) {
        tq_scene_switch(&d->hand, slot);
    } else {
        d->scene.textures = d->textures, d->scene.count = 2;
        d->scene.noise = tq_scene_mix(d->values.seed + UINT64_C(0x9E3779B97F4A7C15));
        tq_scene_start(&d->hand, &d->scene, d->memory, 0, slot);
        d->playing = 1, d->values.model_hash = hash;
    }
    d->board.unlock(d->board.context);
    return TQD_STATUS_OK;
}

static inline void tq_device_upload(tq_device *d, const tq_frame *f)
{
    uint8_t body[5];
    int status;
    switch (f->length ? f->body[0] : 255) {
    case 0: status = tq_device_begin(d, f); break;
    case 1: status = tq_device_data(d, f); break;
    case 2: status = tq_device_finish(d, f); break;
    default: status = TQD_STATUS_LENGTH; break;
    }
    body[0] = f->length ? f->body[0] : 0;
    memcpy(body + 1, &d->upload_count, 4);
    tq_device_reply(d, f, status, body, sizeof body);
}

/* --- The host ----------------------------------------------------------------------------------------- */

/* What was armed is let go, an upload ends, and nothing plays or is sent by itself. */
static inline void tq_device_greeted(tq_device *d)
{
    if (d->force.state == TQ_ARMED || d->force.state == TQ_RUNNING)
        tq_force_event(&d->force, TQ_FAILED, TQ_HOST_CHANGED);
    d->beat = d->values.tick;
    d->values.source = TQD_SOURCE_NOTHING, d->samples_out = d->samples_in;
    d->values.event_rate = 0, d->record_every = 0, d->records_out = d->records_in;
    d->slot = -1;
}

/* Sends records that are due, as long as there is room for a reply after them. */
static inline void tq_device_poll(tq_device *d)
{
    uint8_t body[TQ_MOST_BODY], stuffed[TQ_MOST_STUFFED];
    uint32_t waiting, n;
    while ((waiting = d->records_in - d->records_out) != 0) {
        const tq_record *first = &d->records[d->records_out % TQ_RECORDS];
        uint16_t every = (uint16_t)d->record_every;
        uint32_t count = 0;
        if (waiting < TQ_PER_FRAME && d->values.tick - first->tick < TQ_FLUSH_TICKS)
            return;
        if (d->board.room(d->board.context) < 2 * TQ_MOST_STUFFED)
            return;
        memcpy(body, &first->number, 4), memcpy(body + 4, &first->tick, 4), memcpy(body + 8, &every, 2);
        for (n = 0; n < waiting && count < TQ_PER_FRAME; n++) {
            const tq_record *r = &d->records[(d->records_out + n) % TQ_RECORDS];
            uint8_t *to = body + TQ_EVENT_HEADER + TQ_RECORD_BYTES * count;
            if (r->number != first->number + n) /* one was lost in between */
                break;
            memcpy(to, &r->x_mm, 4), memcpy(to + 4, &r->depth_mm, 4), memcpy(to + 8, &r->speed_mm_s, 4);
            memcpy(to + 12, &r->force_n, 4), memcpy(to + 16, &r->vibration_g, 4);
            to[20] = r->flags;
            count++;
        }
        body[10] = (uint8_t)count;
        n = (uint32_t)tq_stuffed(TQ_EVENT | TQ_REPLY, (uint16_t)first->number, d->nonce, body,
                                 (uint8_t)(TQ_EVENT_HEADER + TQ_RECORD_BYTES * count), stuffed);
        d->records_out += count;
        d->board.send(d->board.context, stuffed, n);
    }
}

#endif
