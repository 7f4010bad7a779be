/* A stand-in for the library of Force Dimension: the functions that tactileq calls, by the maker's public
   header and manual, with no device behind them but a simulated one. What it gives is simulated, and says
   nothing about how a real device behaves. docs/force-device.md#stand-in

   The device is a file in memory whose path stands in TACTILEQ_STANDIN: a mass with friction that a
   scripted hand holds with a spring and a damper, above a real surface on springs. It keeps the force that
   it was given last, whoever has died meanwhile. Its force switch, its speed limit and its own watchdog
   switch its forces off, and they stay off until they are enabled again, whatever it is told to push with:
   so does the maker's. Faults are set in the file. POSIX only.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_STANDIN_H
#define TQ_STANDIN_H

#include "live.h"
#include <math.h>

typedef struct {
    /* What it is. */
    int devices, major, minor, serial, needs_home, has_watchdog;
    /* The mechanics: kg, N/m, N s/m, m, N. */
    double mass, friction;
    double hand_stiffness, hand_damping; /* 0: nobody holds it */
    double stroke, stroke_hz, press;     /* the hand's target: back and forth along x, and down to z = -press */
    double rest[2];                      /* where it does so */
    double real_height, real_stiffness;  /* the real surface */
    double resolution;                   /* of the encoders */
    double noise_n;                      /* of the hand, a pulse of this size up or down every 0.1 ms */
    /* Faults; counts are of readings from now on. */
    int fail_reads, nan_reads, jump_reads, fail_pushes, freezes, button, flipped;
    int switched_off;    /* its force switch */
    double stall_s, jump, most_m_s; /* its speed limit; 0: none */
    double guard_s;                 /* sooner than so long after a position there is no new one */
    /* What happens. */
    double time_s, began_s, pushed_s, told_s;
    double position[3], velocity[3], force[3], shown[3];
    double most_n; /* largest force that it was given */
    uint64_t reads, pushes, seed;
    int is_open, watchdog, force_on, off_cause;
} tq_standin;

enum { TQ_STANDIN_BUTTON = 1, TQ_STANDIN_VELOCITY, TQ_STANDIN_WATCHDOG, TQ_STANDIN_SOFTWARE };

/* A device as it is by default: an arm of 0.2 kg, in a hand that strokes. */
static inline void tq_standin_start(tq_standin *d)
{
    memset(d, 0, sizeof *d);
    d->devices = 1, d->major = 3, d->minor = 17, d->serial = 1;
    d->mass = 0.2, d->friction = 2;
    d->hand_stiffness = 300, d->hand_damping = 5;
    d->stroke = 0.03, d->stroke_hz = 0.8, d->press = 0.005;
    d->real_height = -0.02, d->real_stiffness = 1000, d->resolution = 1e-5;
    d->position[2] = 0.01;
    d->time_s = d->began_s = d->pushed_s = tq_now();
}

static inline size_t tq_standin_size(void)
{
    return sizeof(tq_standin);
}

/* Whether its own watchdog has heard of no force for too long. */
static inline int tq_standin_unheard(const tq_standin *d, double now_s)
{
    return d->watchdog && now_s - d->pushed_s > 125e-6 * d->watchdog;
}

/* The force (N) along an axis that its motors give at a moment. */
static inline double tq_standin_force(const tq_standin *d, double now_s, int axis)
{
    return d->force_on && !d->switched_off && !tq_standin_unheard(d, now_s) ? d->force[axis] : 0;
}

/* Switches its forces off where it has to; the first cause stays. */
static inline void tq_standin_look(tq_standin *d, double now_s)
{
    const double *v = d->velocity;
    int cause = d->switched_off ? TQ_STANDIN_BUTTON : tq_standin_unheard(d, now_s) ? TQ_STANDIN_WATCHDOG : 0;
    if (!cause && d->most_m_s > 0 && sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) > d->most_m_s)
        cause = TQ_STANDIN_VELOCITY;
    if (cause && d->force_on)
        d->force_on = 0, d->off_cause = cause;
}

/* Its motion up to a moment, at most 50 ms of it. */
static inline void tq_standin_move(tq_standin *d, double now_s)
{
    const double step_s = 1e-4;
    int n;
    if (now_s - d->time_s > 0.05)
        d->time_s = now_s - 0.05;
    tq_standin_look(d, now_s);
    for (; d->time_s + step_s <= now_s; d->time_s += step_s) {
        double phase = 6.283185307179586 * d->stroke_hz * (d->time_s - d->began_s);
        double turn = 6.283185307179586 * d->stroke_hz;
        double target[3], speed[3], fade = d->time_s - d->began_s < 1 ? d->time_s - d->began_s : 1;
        target[0] = d->rest[0] + d->stroke * sin(phase), target[1] = d->rest[1], target[2] = 0.01 - fade * (0.01 + d->press);
        speed[0] = d->stroke * turn * cos(phase), speed[1] = speed[2] = 0;
        d->seed = d->seed * 6364136223846793005u + 1442695040888963407u;
        for (n = 0; n < 3; n++) {
            double force = tq_standin_force(d, d->time_s, n) - d->friction * d->velocity[n];
            force += d->hand_stiffness * (target[n] - d->position[n]);
            force += d->hand_damping * (speed[n] - d->velocity[n]);
            if (n == 2) {
                force += d->seed >> 63 ? d->noise_n : -d->noise_n;
                if (d->position[2] < d->real_height)
                    force += d->real_stiffness * (d->real_height - d->position[2]);
                if (d->hand_stiffness == 0 && d->position[2] > 0.02) /* its own stop */
                    force -= 300 * (d->position[2] - 0.02);
            }
            d->velocity[n] += force / d->mass * step_s;
            d->position[n] += d->velocity[n] * step_s;
        }
        tq_standin_look(d, d->time_s);
    }
}

#ifndef _WIN32
#include <fcntl.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <unistd.h>

static tq_standin *tq_the_device;
static int tq_the_file = -1;
static const char *tq_the_error = "no error";

static tq_standin *tq_standin_find(void)
{
    const char *path = getenv("TACTILEQ_STANDIN");
    void *memory;
    if (tq_the_device)
        return tq_the_device;
    tq_clock_take(getenv("TACTILEQ_CLOCK"));
    tq_the_file = path ? open(path, O_RDWR) : -1;
    if (tq_the_file < 0)
        return NULL;
    memory = mmap(NULL, sizeof(tq_standin), PROT_READ | PROT_WRITE, MAP_SHARED, tq_the_file, 0);
    tq_the_device = memory == MAP_FAILED ? NULL : (tq_standin *)memory;
    return tq_the_device;
}

const char *dhdErrorGetLastStr(void)
{
    return tq_the_error;
}

void dhdGetSDKVersion(int *major, int *minor, int *release, int *revision)
{
    const tq_standin *d = tq_standin_find();
    *major = d ? d->major : 0, *minor = d ? d->minor : 0, *release = *revision = 0;
}

int dhdGetDeviceCount(void)
{
    const tq_standin *d = tq_standin_find();
    return d ? d->devices : 0;
}

int dhdOpenID(char id)
{
    tq_standin *d = tq_standin_find();
    if (!d || id >= d->devices) {
        tq_the_error = "no device found";
        return -1;
    }
    if (flock(tq_the_file, LOCK_EX | LOCK_NB)) {
        tq_the_error = "device already in use";
        return -1;
    }
    d->is_open = 1, d->watchdog = 0, d->force_on = 0, d->off_cause = TQ_STANDIN_SOFTWARE;
    d->force[0] = d->force[1] = d->force[2] = 0;
    return id;
}

int dhdClose(char id)
{
    (void)id;
    if (!tq_the_device)
        return -1;
    tq_the_device->is_open = 0;
    flock(tq_the_file, LOCK_UN);
    return 0;
}

int dhdStop(char id)
{
    tq_standin *d = tq_the_device;
    (void)id;
    if (!d)
        return -1;
    d->force[0] = d->force[1] = d->force[2] = 0, d->pushed_s = tq_now();
    if (d->force_on)
        d->force_on = 0, d->off_cause = TQ_STANDIN_SOFTWARE;
    return 0;
}

const char *dhdGetSystemName(char id)
{
    (void)id;
    return "stand-in";
}

int dhdGetSerialNumber(unsigned short *serial, char id)
{
    *serial = (unsigned short)((unsigned)tq_the_device->serial + (unsigned)id);
    return 0;
}

/* 17 words, as a later library has. */
int dhdGetStatus(int *status, char id)
{
    tq_standin *d = tq_the_device;
    (void)id;
    tq_standin_move(d, tq_now());
    memset(status, 0, 17 * sizeof *status);
    status[0] = status[1] = status[2] = 1; /* power, connected, started */
    status[3] = d->needs_home;
    status[5] = d->force_on, status[6] = !d->force_on; /* forces, else the brake */
    status[14] = d->force_on ? 0 : d->off_cause;
    status[16] = 1; /* axes checked */
    return 0;
}

int dhdEnableForce(unsigned char on, char id)
{
    tq_standin *d = tq_the_device;
    (void)id;
    d->pushed_s = tq_now();
    d->force_on = on && !d->switched_off;
    d->off_cause = d->switched_off ? TQ_STANDIN_BUTTON : TQ_STANDIN_SOFTWARE;
    return 0;
}

int dhdSetWatchdog(unsigned char duration, char id)
{
    (void)id;
    if (!tq_the_device->has_watchdog) {
        tq_the_error = "not available on this device";
        return -1;
    }
    tq_the_device->watchdog = duration, tq_the_device->pushed_s = tq_now();
    return 0;
}

int dhdGetButton(int index, char id)
{
    (void)id;
    return index == 0 && tq_the_device->button;
}

int dhdGetPosition(double *x, double *y, double *z, char id)
{
    tq_standin *d = tq_the_device;
    double *out[3];
    int n, guarded;
    (void)id;
    out[0] = x, out[1] = y, out[2] = z;
    if (d->stall_s > 0) {
        double until_s = tq_now() + d->stall_s;
        d->stall_s = 0;
        tq_know_place();
        tq_sleep_until(until_s);
    }
    tq_standin_move(d, tq_now());
    d->reads++;
    if (d->fail_reads) {
        d->fail_reads--;
        tq_the_error = "communication failed";
        return -1;
    }
    if (!(guarded = d->guard_s > 0 && tq_now() - d->told_s < d->guard_s))
        d->told_s = tq_now();
    for (n = 0; n < 3; n++) {
        if (!d->freezes && !guarded)
            d->shown[n] = d->resolution * floor(d->position[n] / d->resolution + 0.5);
        *out[n] = d->nan_reads ? NAN : n == 2 && d->flipped ? -d->shown[n] : d->shown[n];
    }
    if (d->jump_reads)
        *x += d->jump, d->jump_reads--;
    if (d->nan_reads)
        d->nan_reads--;
    return guarded; /* DHD_TIMEGUARD */
}

int dhdSetForce(double x, double y, double z, char id)
{
    tq_standin *d = tq_the_device;
    double size = sqrt(x * x + y * y + z * z), now_s = tq_now();
    (void)id;
    tq_standin_move(d, now_s);
    d->pushes++;
    if (d->fail_pushes) {
        d->fail_pushes--;
        tq_the_error = "communication failed";
        return -1;
    }
    d->force[0] = x, d->force[1] = y, d->force[2] = z, d->pushed_s = now_s;
    if (size > d->most_n)
        d->most_n = size;
    return 0;
}
#endif

#endif
