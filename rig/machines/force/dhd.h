/* The back end of Force Dimension's devices: omega, delta, sigma, Novint Falcon.

   The functions are those of the maker's library (libdhd, 3.3 or later), which the laboratory has
   installed; `tactileq.rig.machines.force.dhd` finds them at run time. Metres and newtons; -1 is a failure, while
   DHD_TIMEGUARD (1) and DHD_MOTOR_SATURATED (2) are none.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_DHD_H
#define TQ_DHD_H

#include "backend.h"

typedef struct {
    int (*get_position)(double *x_m, double *y_m, double *z_m, char id);
    int (*set_force)(double x_n, double y_n, double z_n, char id);
    int (*get_button)(int index, char id);
    int id;
} tq_dhd;

static inline void tq_dhd_read(void *device, tq_sensed *sensed)
{
    const tq_dhd *dhd = (const tq_dhd *)device;
    double x_m = 0, y_m = 0, z_m = 0;
    sensed->failed = dhd->get_position(&x_m, &y_m, &z_m, (char)dhd->id) < 0;
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

/* The back end of an open device, which has to outlive it. */
static inline tq_backend tq_dhd_backend(tq_dhd *device)
{
    tq_backend backend;
    backend.device = device, backend.read = tq_dhd_read, backend.push = tq_dhd_push;
    return backend;
}

#endif
