/* A back end: all that the servo of tactileq needs of a force device. docs/force-device.md#another-device

   Write these two functions for another device, and a Python class that opens it (`rig.force.backend`).
   They are called by one thread, one to four thousand times a second, and must neither allocate nor wait
   for longer than the device's own communication takes.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_BACKEND_H
#define TQ_BACKEND_H

/* One reading. A device that cannot say where it is sets `failed`; the servo then ramps its force to 0 and
   stays there. What the position is worth (NaN, a jump, the same for too long) is the servo's to judge. */
typedef struct {
    double position_mm[3]; /* of the tool, in the device's own right-handed frame */
    int failed;
    int button; /* whether its button is down */
} tq_sensed;

typedef struct {
    void *device; /* the back end's own; given to both functions */
    void (*read)(void *device, tq_sensed *sensed);
    /* Push with this force (N, device's frame) from now on; not 0 where that failed. */
    int (*push)(void *device, const double force_n[3]);
} tq_backend;

/* --- Force Dimension: omega, delta, sigma, Novint Falcon ----------------------------------------

   The functions are those of the maker's library (libdhd, 3.3 or later), which the laboratory has
   installed; `rig.force.dhd` finds them at run time. Metres and newtons; -1 is a failure, while
   DHD_TIMEGUARD (1) and DHD_MOTOR_SATURATED (2) are none. */
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
