/* Registers of tactileq-recorder. Made from device.yml by `make docs-tables`; do not edit.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_REGISTERS_H
#define TQ_REGISTERS_H

#include <stddef.h>
#include <stdint.h>

#define TQD_WHO_AM_I_VALUE 29013
#define TQD_FIRMWARE_VERSION_VALUE 256
#define TQD_SCHEMA_HASH_VALUE UINT64_C(0x1b1789610f35618d)

/* Addresses. */
enum {
    TQD_WHO_AM_I = 0,
    TQD_FIRMWARE_VERSION = 1,
    TQD_SCHEMA_HASH = 2,
    TQD_TICK_RATE = 3,
    TQD_REAL_SIZE = 4,
    TQD_STATE = 8,
    TQD_CAUSE = 9,
    TQD_COMMAND = 10,
    TQD_HEARTBEAT = 11,
    TQD_WANTED = 12,
    TQD_NUMBER = 13,
    TQD_FOUND = 14,
    TQD_NOW = 15,
    TQD_CURRENT_LIMITS = 20,
    TQD_TABLE_LAW = 21,
    TQD_ARM_LAW = 22,
    TQD_GRAVITY = 23,
    TQD_CONTACT = 24,
    TQD_LOOPS = 25,
    TQD_MOVES = 26,
    TQD_BOUNDS = 27,
    TQD_COUNTS = 28,
    TQD_TICK = 48,
    TQD_HEARD_TICK = 49,
    TQD_FAULT_TICK = 50,
    TQD_ZERO_TICK = 51,
    TQD_FRAMES_GOOD = 54,
    TQD_FRAMES_BAD = 55,
    TQD_FRAMES_REFUSED = 56,
    TQD_TICKS_LATE = 60,
    TQD_TICK_CLOCKS = 61,
    TQD_SIMULATE = 64,
    TQD_EMERGED = 65,
    TQD_SIMULATED = 66,
};

/* Phases of a record; currents flow in all but RESTS and FAILS. */
enum {
    TQD_STATE_RESTS = 0,
    TQD_STATE_SPINS = 1, /* the turntable comes up to its speed, the contactor is lifted */
    TQD_STATE_LOWERS = 2, /* the contactor goes down until it touches */
    TQD_STATE_SETTLES = 3, /* the force settles */
    TQD_STATE_RUNS_IN = 4, /* on the sample, before the record */
    TQD_STATE_RECORDS = 5, /* speed and force are judged; the accelerometer is to record */
    TQD_STATE_LIFTS = 6,
    TQD_STATE_RECORDED = 7, /* the turntable goes on, the contactor is lifted */
    TQD_STATE_FAILS = 8, /* latched, without currents; Cause says why */
};

/* Why a record is refused. */
enum {
    TQD_CAUSE_NONE = 0,
    TQD_CAUSE_NO_SPEED = 1, /* the turntable did not reach its speed in time */
    TQD_CAUSE_NO_TOUCH = 2, /* the contactor met nothing */
    TQD_CAUSE_NO_FORCE = 3, /* the force did not settle in time */
    TQD_CAUSE_OFF_SPEED = 4, /* the speed was out of tolerance while recording */
    TQD_CAUSE_OFF_FORCE = 5, /* the force was out of tolerance while recording */
    TQD_CAUSE_STUCK = 6, /* an encoder stands still although its motor is driven, or the ball was lifted less than 0.5 mm */
    TQD_CAUSE_SLIPS = 7, /* the turntable slips, its marks do not come where its motor turns */
    TQD_CAUSE_TOO_HOT = 8, /* a motor is too hot */
    TQD_CAUSE_OVERSPEED = 9, /* the turntable was faster than its limit */
    TQD_CAUSE_STOPPED = 10, /* STOP was asked for */
    TQD_CAUSE_LINK = 11, /* no good frame for 100 ms */
    TQD_CAUSE_HEARTBEAT = 12, /* no Heartbeat written for 1 s */
    TQD_CAUSE_HOST = 13, /* another host, or the same one anew, said hello */
    TQD_CAUSE_NOT_WRITTEN = 14, /* a motor did not take its current */
};

/* What the host asks for. */
enum {
    TQD_COMMAND_NONE = 0,
    TQD_COMMAND_START = 1, /* a record of what the register Wanted says, in RESTS or RECORDED */
    TQD_COMMAND_STOP = 2, /* no current from now on, in every state */
    TQD_COMMAND_CLEAR = 3, /* leave FAILS, or have the turntable run down, to RESTS */
    TQD_COMMAND_FINISH = 4, /* the sensor has enough: judge the record now, in RECORDS */
};

/* What goes wrong from now on, of a simulated recorder only. */
enum {
    TQD_SIMULATION_NONE = 0,
    TQD_SIMULATION_TABLE_STUCK = 1, /* the turntable's encoder stands still */
    TQD_SIMULATION_ARM_STUCK = 2, /* the contactor's encoder stands still */
    TQD_SIMULATION_SLIPPING = 3, /* the magnets let go */
    TQD_SIMULATION_BROWN_OUT = 4, /* the processor starts anew */
    TQD_SIMULATION_MOTOR = 5, /* the contactor's motor does not take its current */
    TQD_SIMULATION_NO_SAMPLE = 6, /* there is nothing to be touched */
};

/* First byte of every reply; as of the cable device. */
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
    TQD_STATUS_TOO_LARGE = 9,
    TQD_STATUS_MODEL = 10,
    TQD_STATUS_BUSY = 11,
    TQD_STATUS_FULL = 12,
};

/* What they hold. */
typedef struct {
    uint64_t schema_hash;
    float tick_rate;
    uint32_t heartbeat;
    float wanted[5];
    uint32_t number;
    float found[8];
    float now[5];
    float current_limits[3];
    float table_law[8];
    float arm_law[8];
    float gravity;
    float contact[2];
    float loops[2];
    float moves[3];
    float bounds[4];
    uint32_t tick;
    uint32_t heard_tick;
    uint32_t fault_tick;
    uint32_t zero_tick;
    uint32_t frames_good;
    uint32_t frames_bad;
    uint32_t frames_refused;
    uint32_t ticks_late;
    uint32_t tick_clocks[2];
    float emerged[2];
    uint16_t who_am_i;
    uint16_t firmware_version;
    uint16_t counts[2];
    uint8_t real_size;
    uint8_t state;
    uint8_t cause;
    uint8_t command;
    uint8_t simulate;
    uint8_t simulated;
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
    { 0.0f, 4.0f }, /* Command */
    { 0.0f, 4294967295.0f }, /* Heartbeat */
    { 1.0f, 2000.0f }, /* Wanted */
    { 0.05f, 10.0f }, /* Wanted */
    { 5.0f, 100.0f }, /* Wanted */
    { 0.05f, 60.0f }, /* Wanted */
    { 0.05f, 60.0f }, /* Wanted */
    { 0.1f, 20.0f }, /* CurrentLimits */
    { 0.1f, 20.0f }, /* CurrentLimits */
    { 0.1f, 10000.0f }, /* CurrentLimits */
    { 1e-09f, 1.0f }, /* TableLaw */
    { 0.0001f, 10.0f }, /* TableLaw */
    { 0.1f, 5000.0f }, /* TableLaw */
    { 0.1f, 5000.0f }, /* TableLaw */
    { 0.1f, 5000.0f }, /* TableLaw */
    { 0.0f, 1.0f }, /* TableLaw */
    { 0.0f, 100.0f }, /* TableLaw */
    { 0.0f, 1.0f }, /* TableLaw */
    { 1e-09f, 1.0f }, /* ArmLaw */
    { 0.0001f, 10.0f }, /* ArmLaw */
    { 0.1f, 5000.0f }, /* ArmLaw */
    { 0.1f, 5000.0f }, /* ArmLaw */
    { 0.1f, 5000.0f }, /* ArmLaw */
    { 0.0f, 1.0f }, /* ArmLaw */
    { 0.0f, 100.0f }, /* ArmLaw */
    { 0.0f, 1.0f }, /* ArmLaw */
    { -1.0f, 1.0f }, /* Gravity */
    { 0.001f, 1.0f }, /* Contact */
    { 10.0f, 10000000.0f }, /* Contact */
    { 0.1f, 1000.0f }, /* Loops */
    { 0.001f, 100.0f }, /* Moves */
    { 0.001f, 100.0f }, /* Moves */
    { 0.0f, 1.0f }, /* Moves */
    { 0.001f, 10.0f }, /* Bounds */
    { 0.001f, 1.0f }, /* Bounds */
    { 0.1f, 600.0f }, /* Bounds */
    { 0.1f, 1000.0f }, /* Bounds */
    { 64.0f, 65535.0f }, /* Counts */
    { 1.0f, 1000.0f }, /* Counts */
    { 0.0f, 6.0f }, /* Simulate */
};

static const tqd_register tqd_registers[] = {
    { TQD_WHO_AM_I, TQD_INTEGER, 2, 1, TQD_READS, 0, 0, offsetof(tqd_values, who_am_i) },
    { TQD_FIRMWARE_VERSION, TQD_INTEGER, 2, 1, TQD_READS, 0, 0, offsetof(tqd_values, firmware_version) },
    { TQD_SCHEMA_HASH, TQD_INTEGER, 8, 1, TQD_READS, 0, 0, offsetof(tqd_values, schema_hash) },
    { TQD_TICK_RATE, TQD_FLOAT, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, tick_rate) },
    { TQD_REAL_SIZE, TQD_INTEGER, 1, 1, TQD_READS, 0, 0, offsetof(tqd_values, real_size) },
    { TQD_STATE, TQD_INTEGER, 1, 1, TQD_READS, 0, 0, offsetof(tqd_values, state) },
    { TQD_CAUSE, TQD_INTEGER, 1, 1, TQD_READS, 0, 0, offsetof(tqd_values, cause) },
    { TQD_COMMAND, TQD_INTEGER, 1, 1, TQD_WRITES, 0, 0, offsetof(tqd_values, command) },
    { TQD_HEARTBEAT, TQD_INTEGER, 4, 1, TQD_WRITES, 1, 0, offsetof(tqd_values, heartbeat) },
    { TQD_WANTED, TQD_FLOAT, 4, 5, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 2, 1, offsetof(tqd_values, wanted) },
    { TQD_NUMBER, TQD_INTEGER, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, number) },
    { TQD_FOUND, TQD_FLOAT, 4, 8, TQD_READS, 0, 0, offsetof(tqd_values, found) },
    { TQD_NOW, TQD_FLOAT, 4, 5, TQD_READS, 0, 0, offsetof(tqd_values, now) },
    { TQD_CURRENT_LIMITS, TQD_FLOAT, 4, 3, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 7, 1, offsetof(tqd_values, current_limits) },
    { TQD_TABLE_LAW, TQD_FLOAT, 4, 8, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 10, 1, offsetof(tqd_values, table_law) },
    { TQD_ARM_LAW, TQD_FLOAT, 4, 8, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 18, 1, offsetof(tqd_values, arm_law) },
    { TQD_GRAVITY, TQD_FLOAT, 4, 1, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 26, 0, offsetof(tqd_values, gravity) },
    { TQD_CONTACT, TQD_FLOAT, 4, 2, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 27, 1, offsetof(tqd_values, contact) },
    { TQD_LOOPS, TQD_FLOAT, 4, 2, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 29, 0, offsetof(tqd_values, loops) },
    { TQD_MOVES, TQD_FLOAT, 4, 3, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 30, 1, offsetof(tqd_values, moves) },
    { TQD_BOUNDS, TQD_FLOAT, 4, 4, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 33, 1, offsetof(tqd_values, bounds) },
    { TQD_COUNTS, TQD_INTEGER, 2, 2, TQD_READS | TQD_WRITES | TQD_IDLE_ONLY, 37, 1, offsetof(tqd_values, counts) },
    { TQD_TICK, TQD_INTEGER, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, tick) },
    { TQD_HEARD_TICK, TQD_INTEGER, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, heard_tick) },
    { TQD_FAULT_TICK, TQD_INTEGER, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, fault_tick) },
    { TQD_ZERO_TICK, TQD_INTEGER, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, zero_tick) },
    { TQD_FRAMES_GOOD, TQD_INTEGER, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, frames_good) },
    { TQD_FRAMES_BAD, TQD_INTEGER, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, frames_bad) },
    { TQD_FRAMES_REFUSED, TQD_INTEGER, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, frames_refused) },
    { TQD_TICKS_LATE, TQD_INTEGER, 4, 1, TQD_READS, 0, 0, offsetof(tqd_values, ticks_late) },
    { TQD_TICK_CLOCKS, TQD_INTEGER, 4, 2, TQD_READS, 0, 0, offsetof(tqd_values, tick_clocks) },
    { TQD_SIMULATE, TQD_INTEGER, 1, 1, TQD_WRITES, 39, 0, offsetof(tqd_values, simulate) },
    { TQD_EMERGED, TQD_FLOAT, 4, 2, TQD_READS, 0, 0, offsetof(tqd_values, emerged) },
    { TQD_SIMULATED, TQD_INTEGER, 1, 1, TQD_READS, 0, 0, offsetof(tqd_values, simulated) },
};

enum { TQD_REGISTERS = 34 };

#endif
