/* What all Cortex-M boards have in common: start, interrupts, sleep, SysTick.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_CORTEX_M_H
#define TQ_CORTEX_M_H

#include "board.h"

#define REGISTER(address) (*(volatile uint32_t *)(uintptr_t)(address))
#define TICK_CONTROL REGISTER(0xE000E010)
#define TICK_RELOAD REGISTER(0xE000E014)
#define TICK_NOW REGISTER(0xE000E018)
#define INTERRUPTS_ON(number) REGISTER(0xE000E100 + 4 * ((number) / 32)) = 1u << ((number) % 32)
#define TICK_PRIORITY REGISTER(0xE000ED20)
#define COPROCESSORS REGISTER(0xE000ED88)
#define BARRIER() __asm volatile("dsb\nisb" : : : "memory")

extern uint32_t data_source[], data_begin[], data_end[], bss_begin[], bss_end[];
void stack_top(void); /* an address, not a function */
void start(void);

void start(void)
{
    uint32_t *to, *from = data_source;
    COPROCESSORS |= 0xFu << 20; /* the floating-point unit */
    BARRIER();
    for (to = data_begin; to < data_end;)
        *to++ = *from++;
    for (to = bss_begin; to < bss_end;)
        *to++ = 0;
    firmware_main();
}

/* A fault of the processor: every output off, and there it stays until the watchdog starts it anew. */
static void crashed(void)
{
    int n;
    for (n = 0; n < TQ_OUTPUTS; n++)
        (void)board_write(n, 0);
    for (;;)
        ;
}

static uint32_t processor_hz;

void board_pace(int ticks)
{
    TICK_RELOAD = processor_hz / TQ_TICK_HZ * (uint32_t)ticks - 1;
    TICK_NOW = 0; /* begins anew with it */
}

/* The tick, from a processor that runs at so many Hz; bytes come in between. */
static void begin_ticks(uint32_t hz)
{
    processor_hz = hz;
    board_pace(1);
    TICK_PRIORITY |= 0xF0u << 24;
    TICK_CONTROL = 7; /* the processor's clock, an interrupt, on */
}

void board_lock(void)
{
    __asm volatile("cpsid i" : : : "memory");
}

void board_unlock(void)
{
    __asm volatile("cpsie i" : : : "memory");
}

void board_wait(void)
{
    __asm volatile("wfi" : : : "memory");
}

uint32_t board_clock(void)
{
    uint32_t left = TICK_NOW;
    return left ? TICK_RELOAD + 1 - left : 0;
}

/* A word that survives a restart: each start differs from the one before. */
static uint32_t starts __attribute__((section(".noinit")));

static uint32_t start_number(void)
{
    return ++starts;
}

#endif
