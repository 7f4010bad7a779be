/* The back end of Force Dimension's devices: omega, delta, sigma, Novint Falcon.

   The functions are those of the maker's library (libdhd, 3.3 or later), which the laboratory has
   installed; `tactileq.rig.machines.force.dhd` finds them at run time. Metres and newtons; -1 is a failure, while
   DHD_TIMEGUARD (1, the last position once more) and DHD_MOTOR_SATURATED (2) are none.

   The device switches its forces off by itself: by its force switch, above its speed limit, where its own
   watchdog heard nothing. They stay off until they are enabled again, whatever it is told to push with, and
   only its status says so. Hence it is read with each position.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_DHD_H
#define TQ_DHD_H

#include "force.h"

/* A status has 15 to 17 words, by the version of the library; of a later one there is room for more. */
enum { TQ_DHD_TIMEGUARD = 1, TQ_DHD_STATUS = 32, TQ_DHD_RESET = 3, TQ_DHD_FORCE = 5, TQ_DHD_ERROR = 9, TQ_DHD_OFF_CAUSE = 14 };

typedef struct {
    int (*get_position)(double *x_m, double *y_m, double *z_m, char id);
    int (*set_force)(double x_n, double y_n, double z_n, char id);
    int (*get_button)(int index, char id);
    int (*get_status)(int *status, char id);
    int (*enable_force)(unsigned char on, char id);
    int id;
} tq_dhd;

/* Why forces are off; TQ_NO_CAUSE while they are on. */
static inline int tq_dhd_off(const int *status)
{
    static const unsigned char causes[] = { TQ_OFF, TQ_OFF_SWITCH, TQ_OFF_SPEED, TQ_OFF_WATCHDOG };
    unsigned why = (unsigned)status[TQ_DHD_OFF_CAUSE];
    if (status[TQ_DHD_FORCE] && !status[TQ_DHD_ERROR])
        return TQ_NO_CAUSE;
    return why < sizeof causes ? causes[why] : TQ_OFF;
}

static inline void tq_dhd_read(void *device, tq_sensed *sensed)
{
    const tq_dhd *dhd = (const tq_dhd *)device;
    double x_m = 0, y_m = 0, z_m = 0;
    int status[TQ_DHD_STATUS] = { 0 }, got = dhd->get_position(&x_m, &y_m, &z_m, (char)dhd->id);
    sensed->stale = got == TQ_DHD_TIMEGUARD;
    sensed->failed = got < 0 || dhd->get_status(status, (char)dhd->id) < 0 || status[TQ_DHD_RESET];
    sensed->off = tq_dhd_off(status);
    sensed->position_mm[0] = 1e3 * x_m;
    sensed->position_mm[1] = 1e3 * y_m;
    sensed->position_mm[2] = 1e3 * z_m;
    sensed->button = dhd->get_button(0, (char)dhd->id) == 1;
}

static inline int tq_dhd_push(void *device, const double force_n[3])
{
    const tq_dhd *dhd = (const tq_dhd *)device;
    return dhd->set_force(force_n[0], force_n[1], force_n[2], (char)dhd->id) < 0;
}

static inline void tq_dhd_enable(void *device)
{
    const tq_dhd *dhd = (const tq_dhd *)device;
    dhd->enable_force(1, (char)dhd->id); /* whether it does, its status says */
}

/* The back end of an open device, which has to outlive it. */
static inline tq_backend tq_dhd_backend(tq_dhd *device)
{
    tq_backend backend;
    backend.device = device, backend.read = tq_dhd_read, backend.push = tq_dhd_push;
    backend.enable = tq_dhd_enable;
    return backend;
}

#endif
