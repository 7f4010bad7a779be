/* An STM32F405 at 168 MHz, as on a Netduino Plus 2: what a laboratory's own board looks like.

   pins beside those of stm32.h: PA9, PA10 UART 1; PB6, PB7 right encoder (timer 4); PC1 is low where a motor driver
   reports a fault; PB0 is the button, low while it is down. Of a recorder the turntable is left and the
   contactor right; PB0 is low at a mark and PB1 at the index, from before its mark on.

   Compiled and run in QEMU, which has no motors; tried on no hardware.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

enum { HZ = 168000000, UART_HZ = 84000000, UART_IRQ = 37 };
enum { STATE = 0x00, RECEIVE = 0x04, SEND = 0x04, DIVISOR = 0x08, CONTROL = 0x0C };
enum { UART_PORT = 'A', UART_PIN = 9, RIGHT_PORT = 'B', RIGHT_PIN = 6, MARK_PORT = 'B', MARK_PIN = 0, FAULT_PIN = 1 };
#define UART_ADDRESS 0x40011000 /* UART 1 */
#define UART_ON (1u << 13)
#define UNIQUE_ID 0x1FFF7A10

#include "stm32.h"

/* 168 MHz from a crystal of 25 MHz. */
static void begin_clocks(void)
{
    RCC(0x00) |= 1u << 16; /* crystal */
    wait_for(&RCC(0x00), 1u << 17);
    RCC(0x40) |= 1u << 28; /* power */
    RCC(0x04) = 25u | 336u << 6 | 1u << 22 | 7u << 24;
    RCC(0x00) |= 1u << 24; /* PLL */
    wait_for(&RCC(0x00), 1u << 25);
    FLASH_CONTROL = 5u | 7u << 8;
    RCC(0x08) = 5u << 10 | 4u << 13; /* APB1 at 42 MHz, APB2 at 84 MHz */
    RCC(0x08) |= 2u;
    wait_for(&RCC(0x08), 2u << 2);
    RCC(0x44) |= 1u << 4; /* UART 1 */
}

/* The first stack, the start, faults, the tick (15), and the UART's interrupt. */
__attribute__((section(".vectors"), used)) static void (*const vectors[16 + 82])(void) = {
    stack_top, start, crashed, crashed, crashed, crashed, crashed, crashed, crashed, crashed, crashed,
    crashed, crashed, crashed, crashed, firmware_tick, [16 + UART_IRQ] = uart,
};
