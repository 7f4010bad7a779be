/* An STM32F405 at 168 MHz, as on a Netduino Plus 2: what a laboratory's own board looks like.

   pins: PA9, PA10 UART 1; PC6, PC7 left encoder (timer 3); PB6, PB7 right encoder (timer 4); PC8, PC9 PWM of
   the left and the right motor's current (timer 8); PA4 vibrator (DAC 1); PC0 enables the motor drivers, PC1
   is low where one reports a fault; PB0 is the button, low while it is down. Of a recorder the turntable is left
   and the contactor right; PC10, PC11 are high where their currents flow backwards, PB0 is low at a mark and PB1 at
   the index, from before its mark on. Registers: RM0090.

   Compiled and run in QEMU, which has no motors; tried on no hardware.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#include "cortex_m.h"

enum { HZ = 168000000, APB2_HZ = 84000000, UART_IRQ = 37, PWM_STEPS = 8400 };
#ifndef BAUD
#define BAUD 1000000
#endif
#define RCC(offset) REGISTER(0x40023800 + (offset))
#define FLASH_CONTROL REGISTER(0x40023C00)
#define GPIO(port, offset) REGISTER(0x40020000 + 0x400 * ((port) - 'A') + (offset))
#define UART(offset) REGISTER(0x40011000 + (offset)) /* UART 1 */
#define TIMER_3 0x40000400
#define TIMER_4 0x40000800
#define TIMER_8 0x40010400
#define TIMER(base, offset) REGISTER((base) + (offset))
#define DAC(offset) REGISTER(0x40007400 + (offset))
#define UNIQUE_ID REGISTER(0x1FFF7A10)

enum { MODER = 0x00, PULL = 0x0C, INPUT = 0x10, SETS = 0x18, ALTERNATE = 0x20 };
enum { STATE = 0x00, DATA = 0x04, DIVISOR = 0x08, CONTROL = 0x0C };
enum { CAME = 1u << 5, EMPTY = 1u << 7 }; /* in the UART's state; in its control they ask for an interrupt */

#define AMPERES_AT_FULL ((tq_number)6) /* of the motor driver at the whole PWM: set it for yours */
#ifndef TQ_RECORDER
#define STEPS_PER_G ((tq_number)200)   /* of the DAC; VibrationScale corrects it */
#endif

/* Until a bit is set; not for ever, since an emulator may not know it. */
static void wait_for(volatile uint32_t *where, uint32_t bit)
{
    int n;
    for (n = 0; n < 100000 && !(*where & bit); n++)
        ;
}

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
    RCC(0x30) |= 7u;                            /* ports A to C */
    RCC(0x40) |= 1u << 1 | 1u << 2 | 1u << 29;  /* timers 3 and 4, DAC */
    RCC(0x44) |= 1u << 1 | 1u << 4;             /* timer 8, UART 1 */
}

static void set_pin(int port, int pin, uint32_t mode, uint32_t alternate)
{
    uint32_t at = (uint32_t)(2 * pin), place = (uint32_t)(4 * (pin % 8));
    GPIO(port, MODER) = (GPIO(port, MODER) & ~(3u << at)) | mode << at;
    GPIO(port, ALTERNATE + 4 * (pin / 8)) =
        (GPIO(port, ALTERNATE + 4 * (pin / 8)) & ~(0xFu << place)) | alternate << place;
}

static void begin_pins(void)
{
    enum { IN = 0, OUT = 1, OTHER = 2, ANALOG = 3 };
    set_pin('C', 0, OUT, 0), GPIO('C', SETS) = 1u << 16; /* drivers off */
    GPIO('B', PULL) |= 1u, GPIO('C', PULL) |= 1u << 2;
    set_pin('B', 0, IN, 0), set_pin('C', 1, IN, 0);
#ifdef TQ_RECORDER
    GPIO('B', PULL) |= 1u << 2;
    set_pin('B', 1, IN, 0), set_pin('C', 10, OUT, 0), set_pin('C', 11, OUT, 0);
#else
    set_pin('A', 4, ANALOG, 0);
#endif
    set_pin('A', 9, OTHER, 7), set_pin('A', 10, OTHER, 7);
    set_pin('C', 6, OTHER, 2), set_pin('C', 7, OTHER, 2), set_pin('B', 6, OTHER, 2), set_pin('B', 7, OTHER, 2);
    set_pin('C', 8, OTHER, 3), set_pin('C', 9, OTHER, 3);
}

#ifndef TQ_SIMULATED
/* Counts both edges of both signals. */
static void begin_encoder(uint32_t timer)
{
    TIMER(timer, 0x08) = 3;         /* slave mode: encoder */
    TIMER(timer, 0x18) = 0x0101;    /* inputs 1 and 2 */
    TIMER(timer, 0x2C) = 0xFFFF;
    TIMER(timer, 0x00) = 1;
}
#endif

static void begin_motors(void)
{
    TIMER(TIMER_8, 0x28) = 0;
    TIMER(TIMER_8, 0x2C) = PWM_STEPS - 1;        /* 20 kHz */
    TIMER(TIMER_8, 0x1C) = 0x6868;               /* PWM on channels 3 and 4 */
    TIMER(TIMER_8, 0x20) = 1u << 8 | 1u << 12;
    TIMER(TIMER_8, 0x3C) = TIMER(TIMER_8, 0x40) = 0;
    TIMER(TIMER_8, 0x44) = 1u << 15;
    TIMER(TIMER_8, 0x00) = 1;
    GPIO('C', SETS) = 1u; /* drivers on: the PWM is 0 */
}

void board_kick(void)
{
    uint8_t byte;
    while ((UART(STATE) & EMPTY) && firmware_next(&byte))
        UART(DATA) = byte;
    UART(CONTROL) |= EMPTY; /* an interrupt once there is room, until nothing is left */
}

static void uart(void)
{
    uint8_t byte;
    if (UART(STATE) & CAME)
        firmware_byte((uint8_t)UART(DATA));
    if ((UART(CONTROL) & EMPTY) && (UART(STATE) & EMPTY)) {
        if (firmware_next(&byte))
            UART(DATA) = byte;
        else
            UART(CONTROL) &= ~(uint32_t)EMPTY;
    }
}

void board_begin(tq_board *board)
{
    begin_clocks();
    begin_pins();
#ifndef TQ_SIMULATED
    begin_encoder(TIMER_3), begin_encoder(TIMER_4);
#endif
    begin_motors();
#ifdef TQ_RECORDER
    board->most_a = (float)AMPERES_AT_FULL;
#else
    board->cables = tq_usual_cables(), board->most_g = 2047 / (float)STEPS_PER_G;
    DAC(0x00) = 1, DAC(0x08) = 2048;
#endif
    UART(DIVISOR) = (APB2_HZ + BAUD / 2) / BAUD;
    UART(CONTROL) = 1u << 13 | 1u << 3 | 1u << 2 | CAME;
    INTERRUPTS_ON(UART_IRQ);
    begin_ticks(HZ);
    board->baud = BAUD, board->entropy = start_number();
#ifndef TQ_SIMULATED /* which QEMU does not know */
    board->entropy ^= UNIQUE_ID;
#endif
}

int board_write(int output, tq_number value)
{
#ifdef TQ_RECORDER
    GPIO('C', SETS) = 1u << (10 + output) << (value < 0 ? 0 : 16);
    value = value < 0 ? -value : value;
#else
    if (output == TQ_VIBRATOR) {
        tq_number steps = (tq_number)2048.5 + STEPS_PER_G * value;
        DAC(0x08) = (uint32_t)(steps < 0 ? 0 : steps > 4095 ? 4095 : steps);
        return 0;
    }
#endif
    value = !(value > 0) ? 0 : value > AMPERES_AT_FULL ? AMPERES_AT_FULL : value; /* of no number none */
    TIMER(TIMER_8, output == 0 ? 0x3C : 0x40) = (uint32_t)(value / AMPERES_AT_FULL * PWM_STEPS);
#ifdef TQ_SIMULATED
    return 0;
#else
    return !(GPIO('C', INPUT) & 2u);
#endif
}

void board_counts(uint16_t counts[TQ_MOTORS])
{
    counts[0] = (uint16_t)TIMER(TIMER_3, 0x24), counts[1] = (uint16_t)TIMER(TIMER_4, 0x24);
}

int board_button(void)
{
#ifdef TQ_SIMULATED
    return 0;
#elif defined TQ_RECORDER
    return (int)(~GPIO('B', INPUT) & 3u);
#else
    return !(GPIO('B', INPUT) & 1u);
#endif
}

/* The first stack, the start, faults, the tick (15), and the UART's interrupt. */
__attribute__((section(".vectors"), used)) static void (*const vectors[16 + 82])(void) = {
    stack_top, start, crashed, crashed, crashed, crashed, crashed, crashed, crashed, crashed, crashed,
    crashed, crashed, crashed, crashed, firmware_tick, [16 + UART_IRQ] = uart,
};
