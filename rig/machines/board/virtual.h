/* A simulated board in a process: in virtual time, or behind a file descriptor in that of the computer.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_VIRTUAL_H
#define TQ_VIRTUAL_H

#include "simulated.h" /* of the machine, by the compiler's folders: it includes all else */

#include <stdlib.h>

#ifndef _WIN32
#include "clock.h"

#include <errno.h>
#include <poll.h>
#include <unistd.h>
#endif

enum { TQ_SENT = 8192 };

struct tq_virtual {
    tq_device device;
    tq_simulated simulated;
    uint8_t sent[TQ_SENT]; /* a ring of what is to be sent */
    size_t first, waiting;
};
typedef struct tq_virtual tq_virtual;

static int tq_virtual_write(void *context, int output, tq_number value)
{
    return tq_simulated_write(&((tq_virtual *)context)->simulated, output, value);
}

static size_t tq_virtual_room(void *context)
{
    return TQ_SENT - ((tq_virtual *)context)->waiting;
}

static void tq_virtual_send(void *context, const uint8_t *bytes, size_t count)
{
    tq_virtual *v = (tq_virtual *)context;
    for (; count; count--, bytes++)
        v->sent[(v->first + v->waiting++) % TQ_SENT] = *bytes;
}

static void tq_virtual_nothing(void *context)
{
    (void)context;
}

static inline size_t tq_virtual_size(void)
{
    return sizeof(tq_virtual);
}

/* A board that was just switched on; a port of so many baud, 0 for any. */
static inline void tq_virtual_start(tq_virtual *v, uint32_t entropy, uint32_t baud)
{
    tq_board board;
    memset(v, 0, sizeof *v);
    memset(&board, 0, sizeof board);
    board.context = v, board.write = tq_virtual_write, board.room = tq_virtual_room;
    board.send = tq_virtual_send, board.lock = board.unlock = tq_virtual_nothing;
    tq_simulated_board(&board);
    board.entropy = entropy, board.baud = baud, board.simulated = 1;
    tq_simulated_start(&v->simulated, 0);
    tq_device_start(&v->device, &board);
}

/* Bytes from the host. */
static inline void tq_virtual_receive(tq_virtual *v, const uint8_t *bytes, size_t count)
{
    tq_device_received(&v->device, bytes, count);
}

/* So many ticks. */
static inline void tq_virtual_step(tq_virtual *v, size_t ticks)
{
    for (; ticks; ticks--) {
        tq_simulated_before(&v->simulated, &v->device, 1);
        tq_device_tick(&v->device, v->simulated.counts, v->simulated.button, 1);
        tq_device_poll(&v->device);
    }
}

/* Bytes for the host, at most so many. */
static inline size_t tq_virtual_take(tq_virtual *v, uint8_t *out, size_t most)
{
    size_t n;
    for (n = 0; n < most && v->waiting; n++, v->waiting--) {
        out[n] = v->sent[v->first];
        v->first = (v->first + 1) % TQ_SENT;
    }
    return n;
}

/* What an output was told last. */
static inline double tq_virtual_given(const tq_virtual *v, int output)
{
    return (double)v->simulated.given[output];
}

/* Every output off. */
static inline void tq_virtual_shut(tq_virtual *v)
{
    tq_device_shut(&v->device);
}

#ifdef _WIN32
static int tq_virtual_run(tq_virtual *v, int port, int end, int other)
{
    (void)v, (void)port, (void)end, (void)other;
    return -1;
}
#else
/* Writes what is to be sent, as much as the port takes; not 0 where the port is gone. */
static inline int tq_virtual_flush(tq_virtual *v, int port)
{
    while (v->waiting) {
        size_t whole = TQ_SENT - v->first;
        ssize_t done = write(port, v->sent + v->first, v->waiting < whole ? v->waiting : whole);
        if (done < 0)
            return errno != EAGAIN && errno != EINTR && errno != EIO;
        v->first = (v->first + (size_t)done) % TQ_SENT, v->waiting -= (size_t)done;
    }
    return 0;
}

TQ_INNER int tq_virtual_loop(tq_virtual *v, int port, int end, int other)
{
    double due_s = tq_now(), now_s, next_s;
    struct pollfd on[3];
    uint8_t bytes[512];
    memset(on, 0, sizeof on);
    on[0].fd = port, on[1].fd = end, on[2].fd = other;
    on[1].events = on[2].events = POLLIN;
    for (;;) {
        ssize_t count = 0;
        now_s = tq_now();
        if (now_s - due_s > 0.02) {
            v->device.values.ticks_late += (uint32_t)(uint64_t)((now_s - due_s) * TQ_TICK_HZ); /* modulo 2^32 */
            due_s = now_s;
        }
        for (; due_s <= now_s; due_s += 1.0 / TQ_TICK_HZ)
            tq_virtual_step(v, 1);
        if (port >= 0 && tq_virtual_flush(v, port))
            return -1;
        /* Longer where nothing is to be done: the ticks are made up for at once. */
        on[0].events = (short)(POLLIN | (v->waiting ? POLLOUT : 0));
        next_s = due_s + (tq_device_pace(&v->device) - 1.0) / TQ_TICK_HZ;
        if (tq_clock_given() && next_s < now_s + 1e-3) /* five ticks at once */
            next_s = now_s + 1e-3;
        if (tq_poll_until(on, 3, next_s) < 0 && errno != EINTR)
            return -1;
        if (on[1].revents || on[2].revents)
            return on[1].revents ? 0 : 1;
        while (port >= 0 && (count = read(port, bytes, sizeof bytes)) > 0)
            tq_virtual_receive(v, bytes, (size_t)count);
        if (port >= 0 && ((count == 0 && on[0].revents & POLLIN) || tq_virtual_flush(v, port)))
            return -1;
    }
}

/* 5000 ticks a second, and bytes from `port`, which does not block (-1 for none), until `end` or `other` can
   be read or is closed: 0 or 1; -1 where the port is gone. A board's clock never stops; where this process
   was held up for over 20 ms, its does. */
static int tq_virtual_run(tq_virtual *v, int port, int end, int other)
{
    int ended;
    tq_clock_take(getenv("TACTILEQ_CLOCK"));
    tq_take_part(1);
    ended = tq_virtual_loop(v, port, end, other);
    tq_take_part(0);
    return ended;
}
#endif

#endif
