/* What one writes for a board; firmware.c does the rest. docs/device.md#porting

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_BOARD_H
#define TQ_BOARD_H

#include "simulated.h" /* of the machine, by the compiler's folders: it includes all else */

/* --- To be written ------------------------------------------------------------------------------- */

/* Clocks, pins, motors off, the UART with its interrupt, a timer with another one 5000 times a second,
   whose priority is the lower one. Fills in baud and entropy, of a cable device cables and most_g, too. */
void board_begin(tq_board *board);
/* A motor's current (A), of a recorder in both directions, or the vibrator's acceleration (g); not 0 where a
   driver reports a fault. */
int board_write(int output, tq_number value);
/* The encoders' counters, modulo 2^16, and whether the button is down; of a recorder 1 while a mark is seen, and
   2 more where it is the index. */
void board_counts(uint16_t counts[TQ_MOTORS]);
int board_button(void);
/* Bytes wait to be sent: start, and take them one by one from firmware_next. Called with interrupts off. */
void board_kick(void);
/* Interrupts off, and on again. */
void board_lock(void);
void board_unlock(void);
/* Sleep until an interrupt; called with interrupts off, which end the sleep nevertheless. */
void board_wait(void);
/* From the next tick on, one of them for so many; it saves power, and may count on being called in a tick. */
void board_pace(int ticks);
/* Clocks since the tick was due; 0 where nothing counts them. */
uint32_t board_clock(void);
/* Feeds the watchdog, which board_begin started: unfed for 50 ms at most, it resets the processor, whose pins then
   float, so that a pull-down on the drivers' enable line takes the current away. It may not bite before 10 ms. */
void board_watchdog(void);

/* --- To be called -------------------------------------------------------------------------------- */

void firmware_byte(uint8_t byte); /* by the UART's interrupt, for every byte that came */
int firmware_next(uint8_t *byte); /* the next byte to be sent; 0 where there is none */
void firmware_tick(void);         /* by the timer's interrupt */
int firmware_main(void);          /* once memory and floating-point unit are ready; never returns */

#endif
