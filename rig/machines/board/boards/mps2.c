/* ARM's board MPS2 with a Cortex-M7 (AN500), as QEMU knows it: an UART, a watchdog, and no motors.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#include "cortex_m.h"

enum { HZ = 25000000 };
#ifndef BAUD
#define BAUD 921600
#endif
#define UART_DATA REGISTER(0x40004000) /* CMSDK UART 0 */
#define UART_STATE REGISTER(0x40004004)
#define UART_CONTROL REGISTER(0x40004008)
#define UART_INTERRUPT REGISTER(0x4000400C)
#define UART_DIVISOR REGISTER(0x40004010)
#define WATCHDOG(offset) REGISTER(0x40008000 + (offset)) /* CMSDK */

static int sending;

void board_kick(void)
{
    uint8_t byte;
    if (sending || !firmware_next(&byte))
        return;
    sending = 1;
    UART_DATA = byte;
}

static void byte_came(void)
{
    UART_INTERRUPT = 2;
    while (UART_STATE & 2)
        firmware_byte((uint8_t)UART_DATA);
}

static void byte_left(void)
{
    UART_INTERRUPT = 1;
    sending = 0;
    board_kick();
}

void board_begin(tq_board *board)
{
    board->baud = BAUD, board->entropy = start_number();
    UART_DIVISOR = HZ / BAUD;
    UART_CONTROL = 15; /* both ways, with an interrupt each */
    INTERRUPTS_ON(0);
    INTERRUPTS_ON(1);
    begin_ticks(HZ);
    WATCHDOG(0x00) = HZ; /* a second, since the computer that emulates it may be late */
    WATCHDOG(0x08) = 3;  /* after the first one `crashed`, by the NMI, after the next one a reset */
}

void board_watchdog(void)
{
    WATCHDOG(0x0C) = 1; /* counts from the beginning, and takes the NMI back */
}

int board_write(int output, tq_number value)
{
    (void)output, (void)value;
    return 0;
}

void board_counts(uint16_t counts[TQ_MOTORS])
{
    counts[0] = counts[1] = 0;
}

int board_button(void)
{
    return 0;
}

/* The first stack, the start, faults, the tick (15), and the UART's interrupts (16 and 17). */
__attribute__((section(".vectors"), used)) static void (*const vectors[])(void) = {
    stack_top, start, crashed, crashed, crashed, crashed, crashed, crashed, crashed, crashed, crashed,
    crashed, crashed, crashed, crashed, firmware_tick, byte_came, byte_left,
};
