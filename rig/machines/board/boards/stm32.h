/* What boards with an STM32F4 or an STM32F7 have in common: motors, encoders, vibrator, button, UART, watchdog.

   A board's file defines, before it includes this, HZ, UART_HZ, UART_IRQ, UART_ADDRESS with its registers' offsets,
   and the pins that are its own; after it, begin_clocks and the vectors. The pins of all: PC6, PC7 left encoder
   (timer 3); PC8, PC9 PWM of the left and the right motor's current (timer 8); PA4 vibrator (DAC 1); PC0 enables
   the motor drivers; of a recorder PC10, PC11 are high where its currents flow backwards. Registers: RM0090 and RM0410.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_STM32_H
#define TQ_STM32_H

#include "cortex_m.h"

#ifndef BAUD
#define BAUD 1000000
#endif
#define RCC(offset) REGISTER(0x40023800 + (offset))
#define FLASH_CONTROL REGISTER(0x40023C00)
#define UART(offset) REGISTER(UART_ADDRESS + (offset))
#define GPIO(port, offset) REGISTER(0x40020000 + 0x400 * ((port) - 'A') + (offset))
#define TIMER_3 0x40000400
#define TIMER_4 0x40000800
#define TIMER_8 0x40010400
#define TIMER(base, offset) REGISTER((base) + (offset))
#define DAC(offset) REGISTER(0x40007400 + (offset))
#define WATCHDOG(offset) REGISTER(0x40003000 + (offset)) /* the independent one */

enum { MODER = 0x00, PULL = 0x0C, INPUT = 0x10, SETS = 0x18, ALTERNATE = 0x20 };
enum { IN = 0, OUT = 1, OTHER = 2, ANALOG = 3 };
/* In the UART's state; in its control CAME and EMPTY ask for an interrupt, CAME for one of OVERRUN, too. */
enum { OVERRUN = 1u << 3, CAME = 1u << 5, EMPTY = 1u << 7 };
enum { PWM_STEPS = HZ / 20000 };

#define AMPERES_AT_FULL ((tq_number)6) /* of the motor driver at the whole PWM: set it for yours */
#ifndef TQ_RECORDER
#define STEPS_PER_G ((tq_number)200)   /* of the DAC; VibrationScale corrects it */
#endif

static void begin_clocks(void); /* HZ of the core and of timer 8, and the UART's clock on */

/* Until a bit is set; not for ever, since an emulator may not know it. */
static void wait_for(volatile uint32_t *where, uint32_t bit)
{
    int n;
    for (n = 0; n < 100000 && !(*where & bit); n++)
        ;
}

static void set_pin(int port, int pin, uint32_t mode, uint32_t alternate)
{
    uint32_t at = (uint32_t)(2 * pin), place = (uint32_t)(4 * (pin % 8));
    GPIO(port, MODER) = (GPIO(port, MODER) & ~(3u << at)) | mode << at;
    GPIO(port, ALTERNATE + 4 * (pin / 8)) =
        (GPIO(port, ALTERNATE + 4 * (pin / 8)) & ~(0xFu << place)) | alternate << place;
}

/* An input that is high unless something pulls it down. */
static void set_input(int port, int pin)
{
    GPIO(port, PULL) |= 1u << (2 * pin);
    set_pin(port, pin, IN, 0);
}

static void begin_pins(void)
{
    set_pin('C', 0, OUT, 0), GPIO('C', SETS) = 1u << 16; /* drivers off */
    set_input(MARK_PORT, MARK_PIN), set_input('C', FAULT_PIN);
#ifdef TQ_RECORDER
    set_input(MARK_PORT, MARK_PIN + 1);
    set_pin('C', 10, OUT, 0), set_pin('C', 11, OUT, 0);
#else
    set_pin('A', 4, ANALOG, 0);
#endif
    set_pin(UART_PORT, UART_PIN, OTHER, 7), set_pin(UART_PORT, UART_PIN + 1, OTHER, 7);
    set_pin('C', 6, OTHER, 2), set_pin('C', 7, OTHER, 2);
    set_pin(RIGHT_PORT, RIGHT_PIN, OTHER, 2), set_pin(RIGHT_PORT, RIGHT_PIN + 1, OTHER, 2);
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
        UART(SEND) = byte;
    UART(CONTROL) |= EMPTY; /* an interrupt once there is room, until nothing is left */
}

/* An overrun asks for an interrupt without a byte that came, where one completes between the reads of state and
   byte (RM0090: overrun error); until it is cleared no other byte is received. On an F4 reading the state and then
   the byte clears it, on an F7 a register of its own. */
static void uart(void)
{
    uint32_t state = UART(STATE);
    uint8_t byte;
    if (state & (CAME | OVERRUN)) {
        byte = (uint8_t)UART(RECEIVE);
#ifdef UART_CLEARS
        if (state & OVERRUN)
            UART(UART_CLEARS) = OVERRUN;
#endif
        if (state & CAME)
            firmware_byte(byte);
    }
    if ((UART(CONTROL) & EMPTY) && (state & EMPTY)) {
        if (firmware_next(&byte))
            UART(SEND) = byte;
        else
            UART(CONTROL) &= ~(uint32_t)EMPTY;
    }
}

/* Its clock has 17 to 47 kHz, of which it takes every fourth: a hang ends in a reset after 18 to 50 ms. Where the
   emulator does not know it, nothing happens. */
static void begin_watchdog(void)
{
    WATCHDOG(0x00) = 0xCCCC; /* begins, for ever */
    WATCHDOG(0x00) = 0x5555;
    WATCHDOG(0x08) = 211; /* counts from 512 ms down until this has come through, a moment later */
}

void board_watchdog(void)
{
    WATCHDOG(0x00) = 0xAAAA;
}

void board_begin(tq_board *board)
{
    begin_clocks();
    RCC(0x30) |= 15u;                           /* ports A to D */
    RCC(0x40) |= 1u << 1 | 1u << 2 | 1u << 29;  /* timers 3 and 4, DAC */
    RCC(0x44) |= 1u << 1;                       /* timer 8 */
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
    UART(DIVISOR) = (UART_HZ + BAUD / 2) / BAUD;
    UART(CONTROL) = UART_ON | 1u << 3 | 1u << 2 | CAME;
    INTERRUPTS_ON(UART_IRQ);
    begin_ticks(HZ);
    begin_watchdog();
    board->baud = BAUD, board->entropy = start_number();
#ifndef TQ_SIMULATED /* which QEMU does not know */
    board->entropy ^= REGISTER(UNIQUE_ID);
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
    return !(GPIO('C', INPUT) & 1u << FAULT_PIN);
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
    return (int)(~GPIO(MARK_PORT, INPUT) >> MARK_PIN & 3u);
#else
    return !(GPIO(MARK_PORT, INPUT) & 1u << MARK_PIN);
#endif
}

#endif
