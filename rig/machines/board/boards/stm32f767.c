/* An STM32F767 at 216 MHz, as on a NUCLEO-F767ZI, the paper's board.

   pins beside those of stm32.h, which its LEDs, its Ethernet and its USB leave free: PD8, PD9 UART 3, which its ST-LINK
   has as a serial port; PD12, PD13 right encoder (timer 4); PC2 is low where a motor driver reports a fault; PD4 is
   the button, low while it is down. Of a recorder the turntable is left and the contactor right; PD4 is low at a
   mark and PD5 at the index, from before its mark on.

   Compiled; run by nothing: QEMU has no such chip, and no hardware has tried it.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

enum { HZ = 216000000, UART_HZ = 54000000, UART_IRQ = 39 };
enum { STATE = 0x1C, RECEIVE = 0x24, SEND = 0x28, DIVISOR = 0x0C, CONTROL = 0x00 };
enum { UART_PORT = 'D', UART_PIN = 8, RIGHT_PORT = 'D', RIGHT_PIN = 12, MARK_PORT = 'D', MARK_PIN = 4, FAULT_PIN = 2 };
#define UART_ADDRESS 0x40004800 /* UART 3 */
#define UART_ON 1u
#define UART_CLEARS 0x20
#define UNIQUE_ID 0x1FF0F420

#include "stm32.h"

#define POWER(offset) REGISTER(0x40007000 + (offset))
#define CACHES REGISTER(0xE000ED14)
#define CACHE_FORGETS REGISTER(0xE000EF50) /* of instructions */
#define CACHE_LINE_FORGETS REGISTER(0xE000EF60) /* of data, by set and way */

/* Both caches, which hold nothing valid after a reset; of data 16 kB in 4 ways of 128 lines. The program reads its
   constants through it; what it writes lies in DTCM, beside it. */
static void begin_caches(void)
{
    uint32_t line;
    CACHE_FORGETS = 0;
    for (line = 0; line < 4 * 128; line++)
        CACHE_LINE_FORGETS = (line & 3) << 30 | line >> 2 << 5;
    BARRIER();
    CACHES |= 1u << 17 | 1u << 16;
    BARRIER();
}

/* 216 MHz from the 8 MHz that the ST-LINK gives. */
static void begin_clocks(void)
{
    begin_caches();
    RCC(0x00) |= 1u << 18; /* a clock, no crystal */
    RCC(0x00) |= 1u << 16;
    wait_for(&RCC(0x00), 1u << 17);
    RCC(0x40) |= 1u << 28 | 1u << 18; /* power, UART 3 */
    RCC(0x04) = 4u | 216u << 6 | 1u << 22 | 9u << 24 | 2u << 28;
    RCC(0x00) |= 1u << 24; /* PLL */
    wait_for(&RCC(0x00), 1u << 25);
    POWER(0x00) |= 1u << 16; /* over-drive, and over to it: above 180 MHz */
    wait_for(&POWER(0x04), 1u << 16);
    POWER(0x00) |= 1u << 17;
    wait_for(&POWER(0x04), 1u << 17);
    FLASH_CONTROL = 7u; /* wait states */
    RCC(0x08) = 5u << 10 | 4u << 13; /* APB1 at 54 MHz, APB2 at 108 MHz */
    RCC(0x08) |= 2u;
    wait_for(&RCC(0x08), 2u << 2);
}

/* The first stack, the start, faults, the tick (15), and the UART's interrupt. */
__attribute__((section(".vectors"), used)) static void (*const vectors[16 + 110])(void) = {
    stack_top, start, crashed, crashed, crashed, crashed, crashed, crashed, crashed, crashed, crashed,
    crashed, crashed, crashed, crashed, firmware_tick, [16 + UART_IRQ] = uart,
};
