/* The program of a device, or with TQ_RECORDER of a recorder: rings of bytes, the tick, and a loop that sleeps.
   docs/device.md#porting

   With TQ_SIMULATED a simulated hand, or simulated mechanics, take the place of encoders and motors.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#include "board.h"

enum { RECEIVED = 1024, SENT = 4096 };

static tq_device device;
#ifdef TQ_SIMULATED
static tq_simulated simulated;
#endif
static uint8_t received[RECEIVED], sent[SENT];
static volatile uint32_t received_in, received_out, sent_in, sent_out;
static volatile int turned; /* whether the main loop went round since the watchdog was last fed */

void firmware_byte(uint8_t byte)
{
    if (received_in - received_out < RECEIVED) /* else the frame is damaged and sent again */
        received[received_in++ % RECEIVED] = byte;
}

int firmware_next(uint8_t *byte)
{
    if (sent_in == sent_out)
        return 0;
    *byte = sent[sent_out++ % SENT];
    return 1;
}

void firmware_tick(void)
{
    static int pace = 1; /* what this tick stands for */
    int next;
    uint32_t before, after;
#ifdef TQ_SIMULATED
    tq_simulated_before(&simulated, &device, pace);
    before = board_clock(); /* what is simulated is none of the device's work */
    tq_device_tick(&device, simulated.counts, simulated.button, pace);
#else
    uint16_t counts[TQ_MOTORS];
    before = board_clock();
    board_counts(counts);
    tq_device_tick(&device, counts, board_button(), pace);
#endif
    after = board_clock();
    if (after >= before)
        tq_device_clocks(&device, after - before);
    else /* the next one was due already */
        device.values.ticks_late++;
    next = tq_device_pace(&device);
    if (next != pace)
        board_pace(pace = next);
    /* Here alone, and once in a turn of the main loop: where either hangs, or starves the other, none is fed. */
    if (turned)
        turned = 0, board_watchdog();
}

static int written(void *context, int output, tq_number value)
{
    (void)context;
#ifdef TQ_SIMULATED
    if (tq_simulated_write(&simulated, output, value))
        return 1;
#endif
    return board_write(output, value);
}

static size_t room(void *context)
{
    (void)context;
    return SENT - (sent_in - sent_out);
}

static void send(void *context, const uint8_t *bytes, size_t count)
{
    (void)context;
    for (; count; count--, bytes++) {
        sent[sent_in % SENT] = *bytes;
        sent_in++;
    }
    board_lock();
    board_kick();
    board_unlock();
}

static void lock(void *context)
{
    (void)context;
    board_lock();
}

static void unlock(void *context)
{
    (void)context;
    board_unlock();
}

int firmware_main(void)
{
    tq_board board;
    memset(&board, 0, sizeof board);
    board.write = written, board.room = room, board.send = send;
    board.lock = lock, board.unlock = unlock;
    board_lock();
#ifdef TQ_SIMULATED
    tq_simulated_board(&board), board.simulated = 1;
    tq_simulated_start(&simulated, 0);
#endif
    board_begin(&board);
    tq_device_start(&device, &board);
    board_unlock();
    for (;;) {
        while (received_in != received_out) {
            uint8_t byte = received[received_out % RECEIVED];
            received_out++;
            tq_device_received(&device, &byte, 1);
        }
        tq_device_poll(&device);
        turned = 1;
        board_lock();
        if (received_in == received_out)
            board_wait();
        board_unlock();
    }
}
