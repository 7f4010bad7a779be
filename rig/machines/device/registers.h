/* Registers of tactileq-cables. Made from device.yml by `make docs-tables`; do not edit.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_REGISTERS_H
#define TQ_REGISTERS_H

#include <stddef.h>
#include <stdint.h>

#define TQD_WHO_AM_I_VALUE 29012
#define TQD_FIRMWARE_VERSION_VALUE 258
#define TQD_SCHEMA_HASH_VALUE UINT64_C(0x03a73ebbd8c88b2c)

/* Addresses. */
enum {
    TQD_WHO_AM_I = 0,
    TQD_FIRMWARE_VERSION = 1,
    TQD_SCHEMA_HASH = 2,
    TQD_TICK_RATE = 3,
    TQD_REAL_SIZE = 4,
    TQD_MODEL_CAPACITY = 5,
    TQD_MOST_LAYERS = 6,
    TQD_STATE = 8,
    TQD_CAUSE = 9,
    TQD_COMMAND = 10,
    TQD_HEARTBEAT = 11,
    TQD_WALL = 12,
    TQD_SOURCE = 13,
    TQD_SAMPLES = 14,
    TQD_SAMPLES_QUEUED = 15,
    TQD_EVENT_RATE = 16,
    TQD_SEED = 17,
    TQD_FROZEN_TIME = 18,
    TQD_RELEASE_TIME = 19,
    TQD_FORCE_LIMIT = 20,
    TQD_FORCE_SLEW = 21,
    TQD_POWER_LIMIT = 22,
    TQD_SPEED_LIMIT = 23,
    TQD_WORKSPACE = 24,
    TQD_CURRENT_LIMIT = 25,
    TQD_HEAT_LIMIT = 26,
    TQD_TENSION_RANGE = 27,
    TQD_CONTACT_FORCE = 28,
    TQD_STIFFNESS_LIMIT = 29,
    TQD_VIBRATION_LIMIT = 30,
    TQD_SPEED_DELAY = 31,
    TQD_POSITION = 32,
    TQD_DEPTH = 33,
    TQD_SPEED = 34,
    TQD_FORCE = 35,
    TQD_TENSION = 36,
    TQD_CURRENT = 37,
    TQD_HEAT = 38,
    TQD_VIBRATION = 39,
    TQD_BUTTON = 40,
    TQD_VIBRATION_SCALE = 41,
    TQD_VIBRATION_RANGE = 42,
    TQD_WEIGHTING = 43,
    TQD_PLAYED = 44,
    TQD_CORRECTIONS = 45,
    TQD_TICK = 48,
    TQD_HEARD_TICK = 49,
    TQD_FAULT_TICK = 50,
    TQD_ZERO_TICK = 51,
    TQD_MODEL_TICK = 52,
    TQD_MODEL_HASH = 53,
    TQD_FRAMES_GOOD = 54,
    TQD_FRAMES_BAD = 55,
    TQD_FRAMES_REFUSED = 56,
    TQD_RECORDS_LOST = 57,
    TQD_SAMPLES_MISSED = 58,
    TQD_SHUTDOWN_ERROR = 59,
    TQD_TICKS_LATE = 60,
    TQD_TICK_CLOCKS = 61,
    TQD_MODEL_FAULT = 62,
    TQD_SIMULATE = 64,
    TQD_STROKE = 65,
    TQD_SIMULATED = 66,
    TQD_HOMED = 67,
    TQD_EMERGED = 68,
};

/* States of rig/machines/force/force.h; there is force in ARMED (a wall ramps out), RUNNING and RELEASING only. */
enum {
    TQD_STATE_BOOT = 0,
    TQD_STATE_IDLE = 1,
    TQD_STATE_ARMED = 2,
    TQD_STATE_RUNNING = 3,
    TQD_STATE_RELEASING = 4,
    TQD_STATE_FAULT = 5,
};

/* What the host asks for; each is refused in a state where it means nothing. */
enum {
    TQD_COMMAND_NONE = 0,
    TQD_COMMAND_ARM = 1, /* allow force, in IDLE and once HOME was asked for since the device started */
    TQD_COMMAND_SHOW = 2, /* render the wall of the register Wall, in ARMED or RUNNING */
    TQD_COMMAND_HIDE = 3, /* ramp the wall out, in RUNNING */
    TQD_COMMAND_CLEAR = 4, /* leave FAULT, after whoever is there has seen the cause */
    TQD_COMMAND_STOP = 5, /* let go, in every state */
    TQD_COMMAND_HOME = 6, /* the tool stands in its rest now; in BOOT, IDLE or FAULT */
};

/* Why the device let go; the first one is kept until CLEAR. */
enum {
    TQD_CAUSE_NONE = 0,
    TQD_CAUSE_NOT_READ = 1, /* the encoders give a place where no tool can be */
    TQD_CAUSE_NOT_A_NUMBER = 2,
    TQD_CAUSE_LATE = 3,
    TQD_CAUSE_JUMP = 4, /* the place moved further in one tick than SpeedLimit allows */
    TQD_CAUSE_SPEED = 5, /* faster than SpeedLimit */
    TQD_CAUSE_WORKSPACE = 6, /* outside Workspace */
    TQD_CAUSE_FROZEN = 7, /* the same place to the bit for 0.25 s under force */
    TQD_CAUSE_HEARTBEAT = 8, /* no Heartbeat written for 1 s */
    TQD_CAUSE_SOUND = 9,
    TQD_CAUSE_WATCHDOG = 10,
    TQD_CAUSE_NOT_WRITTEN = 11, /* a motor or the vibrator did not take its value */
    TQD_CAUSE_STOPPED = 12, /* STOP was asked for */
    TQD_CAUSE_STOOD_STILL = 13,
    TQD_CAUSE_LINK = 14, /* no good frame for 100 ms */
    TQD_CAUSE_HOST = 15, /* another host, or the same one anew, said hello */
    TQD_CAUSE_STUCK = 16, /* one encoder stood still while the other one went on for 3 mm */
    TQD_CAUSE_SLACK = 17, /* a cable carried less than half of what it is to pull with for 20 ms, by the estimate from its motor */
    TQD_CAUSE_SLOW = 18, /* of a servo */
    TQD_CAUSE_UNANSWERED = 19, /* after ARM the tool did not give way to a small force, or moved against it */
    TQD_CAUSE_PRESSED_THROUGH = 20, /* deeper than where the wall's force is at ForceLimit, for 1 s */
    TQD_CAUSE_FORCES_OFF = 21, /* of a servo, as the next three */
    TQD_CAUSE_OFF_SWITCH = 22,
    TQD_CAUSE_OFF_SPEED = 23,
    TQD_CAUSE_OFF_WATCHDOG = 24,
};

/* What the vibrator plays. */
enum {
    TQD_SOURCE_NOTHING = 0,
    TQD_SOURCE_MODEL = 1, /* the model that was uploaded, under the tool; it fades out when another source is set */
    TQD_SOURCE_HOST = 2, /* samples that the host writes to Samples */
};

/* What goes wrong from now on, of a simulated board only. */
enum {
    TQD_SIMULATION_NONE = 0,
    TQD_SIMULATION_STUCK = 1, /* the left encoder stands still */
    TQD_SIMULATION_JUMP = 2, /* the left encoder jumps by 5 mm, once */
    TQD_SIMULATION_FLIPPED = 3, /* both encoders count backwards */
    TQD_SIMULATION_WRAPPED = 4, /* the processor starts anew, with both counters 100 counts before their end */
    TQD_SIMULATION_BROWN_OUT = 5, /* the processor starts anew */
    TQD_SIMULATION_MOTOR = 6, /* the left motor does not take its value */
    TQD_SIMULATION_UNPLUGGED = 7, /* the encoders read 0 */
    TQD_SIMULATION_SLACK = 8, /* the left cable is cut */
    TQD_SIMULATION_BUTTON = 9, /* the button is down, and the hand goes on to the real surface */
};

/* First byte of every reply. */
enum {
    TQD_STATUS_OK = 0,
    TQD_STATUS_ADDRESS = 1, /* there is no such register */
    TQD_STATUS_ACCESS = 2, /* this one is not to be read, or not to be written */
    TQD_STATUS_LENGTH = 3, /* the body has another length than this needs */
    TQD_STATUS_RANGE = 4, /* a value is outside its range, or not a number */
    TQD_STATUS_STATE = 5, /* not in this state */
    TQD_STATUS_NONCE = 6, /* the frame was meant for the time before the device started anew; say hello */
    TQD_STATUS_SEQUENCE = 7, /* neither the next number nor a repetition of the last frame; say hello */
    TQD_STATUS_KIND = 8, /* there is no such kind of frame */
    TQD_STATUS_TOO_LARGE = 9, /* the model does not fit */
    TQD_STATUS_MODEL = 10, /* what was uploaded is no model that this device can render */
    TQD_STATUS_BUSY = 11, /* the model before is still fading out; try again */
    TQD_STATUS_FULL = 12, /* there is no room for so many samples */
};

/* Why the last upload was refused with the status MODEL; the ranges stand in docs/device.md. */
enum {
    TQD_MODELFAULT_NONE = 0,
    TQD_MODELFAULT_HASH = 1, /* the hash is another one, or bytes are missing */
    TQD_MODELFAULT_HEAD = 2, /* it does not begin with TQM1, or the reals are of another size than RealSize */
    TQD_MODELFAULT_LAYERS = 3,
    TQD_MODELFAULT_GRID = 4, /* of less than two speeds or forces */
    TQD_MODELFAULT_SIZE = 5, /* not as many bytes as these counts give, or less than 24 */
    TQD_MODELFAULT_UPDATE_SAMPLES = 6,
    TQD_MODELFAULT_LONGEST = 7,
    TQD_MODELFAULT_PAUSE = 8,
    TQD_MODELFAULT_MODEL_RATE_HZ = 9,
    TQD_MODELFAULT_SPEED_CHANGE = 10,
    TQD_MODELFAULT_FORCE_CHANGE = 11,
    TQD_MODELFAULT_SLOPE_SHARE = 12,
    TQD_MODELFAULT_HOLD = 13,
    TQD_MODELFAULT_RELEASE = 14,
    TQD_MODELFAULT_PEAK = 15,
    TQD_MODELFAULT_MEAN_SQUARE = 16,
    TQD_MODELFAULT_MEAN_SHARE = 17,
    TQD_MODELFAULT_SILENCE = 18,
    TQD_MODELFAULT_NOTCH_HZ = 19,
    TQD_MODELFAULT_NOTCH_WIDTH_HZ = 20,
    TQD_MODELFAULT_NOTCH_SHARE = 21,
    TQD_MODELFAULT_SPEED_MM_S = 22, /* out of its range, or it does not rise */
    TQD_MODELFAULT_FORCE_N = 23, /* out of its range, or it does not rise */
    TQD_MODELFAULT_SIGNS = 24,
    TQD_MODELFAULT_SLEWS = 25,
    TQD_MODELFAULT_VALUES = 26,
};

/* Of a record in an event frame. */
enum {
    TQD_FLAGS_CONTACT = 1, /* the force is at least ContactForce */
    TQD_FLAGS_BUTTON = 2,
    TQD_FLAGS_CLIPPED = 4, /* the cables do not give the force: a tension beyond its limit or its motor's, below the least one, or outside the cone */
    TQD_FLAGS_BEYOND = 8, /* below the wall's height but not on it */
    TQD_FLAGS_EMPTY = 16, /* the host's samples had run out */
    TQD_FLAGS_SIMULATED = 32, /* the board is simulated */
    TQD_FLAGS_SLACK = 64, /* a cable carries less than half of what it is to pull with, by the estimate from its motor */
};

/* What they hold. */
typedef struct {
    uint64_t schema_hash;
    uint64_t seed;
    uint64_t played[6];
    uint64_t corrections[7];
    uint64_t model_hash;
    float tick_rate;
    uint32_t model_capacity;
    uint32_t heartbeat;
    float wall[5];
    float samples[25];
    float force_limit;
    float force_slew;
    float power_limit;
    float speed_limit;
    float workspace[4];
    float current_limit;
    float heat_limit;
    float tension_range[2];
    float contact_force;
    float frozen_time;
    float release_time;
    float vibration_limit;
    float stiffness_limit;
    float vibration_scale;
    float vibration_range;
    float weighting[20];
    float position[2];
    float depth;
    float speed;
    float force;
    float tension[2];
    float current[2];
    float heat[2];
    float vibration;
    uint32_t tick;
    uint32_t heard_tick;
    uint32_t fault_tick;
    uint32_t zero_tick;
    uint32_t model_tick;
    uint32_t frames_good;
    uint32_t frames_bad;
    uint32_t frames_refused;
    uint32_t records_lost;
    uint32_t samples_missed;
    uint32_t ticks_late;
    uint32_t tick_clocks[2];
    float emerged[10];
    float stroke[3];
    uint16_t who_am_i;
    uint16_t firmware_version;
    uint16_t samples_queued;
    uint16_t event_rate;
    uint8_t real_size;
    uint8_t most_layers;
    uint8_t state;
    uint8_t cause;
    uint8_t command;
    uint8_t source;
    uint8_t speed_delay;
    uint8_t button;
    uint8_t shutdown_error;
    uint8_t model_fault;
    uint8_t simulate;
    uint8_t simulated;
    uint8_t homed;
} tqd_values;

enum { TQD_INTEGER, TQD_FLOAT };
enum { TQD_READS = 1, TQD_WRITES = 2, TQD_IDLE_ONLY = 4 };

typedef struct {
    float low, high;
} tqd_range;

/* One register: bytes of an element, elements, its first range, whether each element has
   its own, and where its value begins. */
typedef struct {
    uint8_t address, kind, bytes, length, access, ranges, each;
    uint16_t offset;
} tqd_register;

/* Of those that can be written. */
static const tqd_range tqd_ranges[] = {
    { 0.0f, 6.0f }, /* Command */
    { 0.0f, 4294967295.0f }, /* Heartbeat */
    { -300.0f, 300.0f }, /* Wall */
    { 0.0f, 20.0f }, /* Wall */
    { 0.0f, 0.1f }, /* Wall */
    { 1.0f, 300.0f }, /* Wall */
    { 1.0f, 300.0f }, /* Wall */
    { 0.0f, 2.0f }, /* Source */
    { -50.0f, 50.0f }, /* Samples */
    { 0.0f, 5000.0f }, /* EventRate */
    { 0.0f, 1.8446744073709552e+19f }, /* Seed */
    { 0.005f, 5.0f }, /* FrozenTime */
    { 0.001f, 0.5f }, /* ReleaseTime */
    { 0.1f, 20.0f }, /* ForceLimit */
    { 1.0f, 100000.0f }, /* ForceSlew */
    { 0.01f, 100.0f }, /* PowerLimit */
    { 10.0f, 2000.0f }, /* SpeedLimit */
    { -300.0f, 300.0f }, /* Workspace */
    { 0.1f, 10.0f }, /* CurrentLimit */
    { 0.1f, 1000.0f }, /* HeatLimit */
    { 0.0f, 100.0f }, /* TensionRange */
    { 0.001f, 5.0f }, /* ContactForce */
    { 0.1f, 20.0f }, /* VibrationLimit */
    { 1.0f, 32.0f }, /* SpeedDelay */
    { 1e-06f, 1000000.0f }, /* VibrationScale */
    { -1000000.0f, 1000000.0f }, /* Weighting */
    { 0.0f, 9.0f }, /* Simulate */
    { 0.0f, 150.0f }, /* Stroke */
    { 0.0f, 5.0f }, /* Stroke */
    { 0.0f, 30.0f }, /* Stroke */
};

static const tqd_register tqd_registers[] = {
    { TQD_WHO_AM_I, TQD_INTEGER, 2, 1, TQD_READS, 0, 0, offsetof(tqd_values, who_am_i) },
    { TQD_FIRMWARE_VERSION, TQD_INTEGER, 2, 1, TQD_READS, 0, 0, offsetof(tqd_values, firmware_version) },
    { TQD_SCHEMA_HASH, TQD_INTEGER, 8, 1, TQD_READS, 0, 0, offsetof(tqd_values, schema_hash) },
    { TQD_TICK_RATE, TQD_FLOAT, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, tick_rate) },
    { TQD_REAL_SIZE, TQD_INTEGER, 1, 1, TQD_READS, 0, 0, offsetof(tqd_values, real_size) },
    { TQD_MODEL_CAPACITY, TQD_INTEGER, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, model_capacity) },
    { TQD_MOST_LAYERS, TQD_INTEGER, 1, 1, TQD_READS, 0, 0, offsetof(tqd_values, most_layers) },
    { TQD_STATE, TQD_INTEGER, 1, 1, TQD_READS, 0, 0, offsetof(tqd_values, state) },
    { TQD_CAUSE, TQD_INTEGER, 1, 1, TQD_READS, 0, 0, offsetof(tqd_values, cause) },
    { TQD_COMMAND, TQD_INTEGER, 1, 1, TQD_WRITES, 0, 0, offsetof(tqd_values, command) },
    { TQD_HEARTBEAT, TQD_INTEGER, 4, 1, TQD_WRITES, 1, 0, offsetof(tqd_values, heartbeat) },
    { TQD_WALL, TQD_FLOAT, 4, 5, TQD_READS | TQD_WRITES, 2, 1, offsetof(tqd_values, wall) },
    { TQD_SOURCE, TQD_INTEGER, 1, 1, TQD_READS | TQD_WRITES, 7, 0, offsetof(tqd_values, source) },
    { TQD_SAMPLES, TQD_FLOAT, 4, 25, TQD_WRITES, 8, 0, offsetof(tqd_values, samples) },
    { TQD_SAMPLES_QUEUED, TQD_INTEGER, 2, 1, TQD_READS, 0, 0, offsetof(tqd_values, samples_queued) },
    { TQD_EVENT_RATE, TQD_INTEGER, 2, 1, TQD_READS | TQD_WRITES, 9, 0, offsetof(tqd_values, event_rate) },
    { TQD_SEED, TQD_INTEGER, 8, 1, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 10, 0, offsetof(tqd_values, seed) },
    { TQD_FROZEN_TIME, TQD_FLOAT, 4, 1, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 11, 0, offsetof(tqd_values, frozen_time) },
    { TQD_RELEASE_TIME, TQD_FLOAT, 4, 1, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 12, 0, offsetof(tqd_values, release_time) },
    { TQD_FORCE_LIMIT, TQD_FLOAT, 4, 1, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 13, 0, offsetof(tqd_values, force_limit) },
    { TQD_FORCE_SLEW, TQD_FLOAT, 4, 1, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 14, 0, offsetof(tqd_values, force_slew) },
    { TQD_POWER_LIMIT, TQD_FLOAT, 4, 1, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 15, 0, offsetof(tqd_values, power_limit) },
    { TQD_SPEED_LIMIT, TQD_FLOAT, 4, 1, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 16, 0, offsetof(tqd_values, speed_limit) },
    { TQD_WORKSPACE, TQD_FLOAT, 4, 4, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 17, 0, offsetof(tqd_values, workspace) },
    { TQD_CURRENT_LIMIT, TQD_FLOAT, 4, 1, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 18, 0, offsetof(tqd_values, current_limit) },
    { TQD_HEAT_LIMIT, TQD_FLOAT, 4, 1, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 19, 0, offsetof(tqd_values, heat_limit) },
    { TQD_TENSION_RANGE, TQD_FLOAT, 4, 2, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 20, 0, offsetof(tqd_values, tension_range) },
    { TQD_CONTACT_FORCE, TQD_FLOAT, 4, 1, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 21, 0, offsetof(tqd_values, contact_force) },
    { TQD_STIFFNESS_LIMIT, TQD_FLOAT, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, stiffness_limit) },
    { TQD_VIBRATION_LIMIT, TQD_FLOAT, 4, 1, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 22, 0, offsetof(tqd_values, vibration_limit) },
    { TQD_SPEED_DELAY, TQD_INTEGER, 1, 1, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 23, 0, offsetof(tqd_values, speed_delay) },
    { TQD_POSITION, TQD_FLOAT, 4, 2, TQD_READS, 0, 0, offsetof(tqd_values, position) },
    { TQD_DEPTH, TQD_FLOAT, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, depth) },
    { TQD_SPEED, TQD_FLOAT, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, speed) },
    { TQD_FORCE, TQD_FLOAT, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, force) },
    { TQD_TENSION, TQD_FLOAT, 4, 2, TQD_READS, 0, 0, offsetof(tqd_values, tension) },
    { TQD_CURRENT, TQD_FLOAT, 4, 2, TQD_READS, 0, 0, offsetof(tqd_values, current) },
    { TQD_HEAT, TQD_FLOAT, 4, 2, TQD_READS, 0, 0, offsetof(tqd_values, heat) },
    { TQD_VIBRATION, TQD_FLOAT, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, vibration) },
    { TQD_BUTTON, TQD_INTEGER, 1, 1, TQD_READS, 0, 0, offsetof(tqd_values, button) },
    { TQD_VIBRATION_SCALE, TQD_FLOAT, 4, 1, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 24, 0, offsetof(tqd_values, vibration_scale) },
    { TQD_VIBRATION_RANGE, TQD_FLOAT, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, vibration_range) },
    { TQD_WEIGHTING, TQD_FLOAT, 4, 20, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 25, 0, offsetof(tqd_values, weighting) },
    { TQD_PLAYED, TQD_INTEGER, 8, 6, TQD_READS, 0, 0, offsetof(tqd_values, played) },
    { TQD_CORRECTIONS, TQD_INTEGER, 8, 7, TQD_READS, 0, 0, offsetof(tqd_values, corrections) },
    { TQD_TICK, TQD_INTEGER, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, tick) },
    { TQD_HEARD_TICK, TQD_INTEGER, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, heard_tick) },
    { TQD_FAULT_TICK, TQD_INTEGER, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, fault_tick) },
    { TQD_ZERO_TICK, TQD_INTEGER, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, zero_tick) },
    { TQD_MODEL_TICK, TQD_INTEGER, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, model_tick) },
    { TQD_MODEL_HASH, TQD_INTEGER, 8, 1, TQD_READS, 0, 0, offsetof(tqd_values, model_hash) },
    { TQD_FRAMES_GOOD, TQD_INTEGER, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, frames_good) },
    { TQD_FRAMES_BAD, TQD_INTEGER, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, frames_bad) },
    { TQD_FRAMES_REFUSED, TQD_INTEGER, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, frames_refused) },
    { TQD_RECORDS_LOST, TQD_INTEGER, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, records_lost) },
    { TQD_SAMPLES_MISSED, TQD_INTEGER, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, samples_missed) },
    { TQD_SHUTDOWN_ERROR, TQD_INTEGER, 1, 1, TQD_READS, 0, 0, offsetof(tqd_values, shutdown_error) },
    { TQD_TICKS_LATE, TQD_INTEGER, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, ticks_late) },
    { TQD_TICK_CLOCKS, TQD_INTEGER, 4, 2, TQD_READS, 0, 0, offsetof(tqd_values, tick_clocks) },
    { TQD_MODEL_FAULT, TQD_INTEGER, 1, 1, TQD_READS, 0, 0, offsetof(tqd_values, model_fault) },
    { TQD_SIMULATE, TQD_INTEGER, 1, 1, TQD_WRITES, 26, 0, offsetof(tqd_values, simulate) },
    { TQD_STROKE, TQD_FLOAT, 4, 3, TQD_READS | TQD_WRITES, 27, 1, offsetof(tqd_values, stroke) },
    { TQD_SIMULATED, TQD_INTEGER, 1, 1, TQD_READS, 0, 0, offsetof(tqd_values, simulated) },
    { TQD_HOMED, TQD_INTEGER, 1, 1, TQD_READS, 0, 0, offsetof(tqd_values, homed) },
    { TQD_EMERGED, TQD_FLOAT, 4, 10, TQD_READS, 0, 0, offsetof(tqd_values, emerged) },
};

enum { TQD_REGISTERS = 65 };

#endif
