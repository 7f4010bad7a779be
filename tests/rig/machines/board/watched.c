/* The firmware on a board whose watchdog counts how often it is fed: in 100 turns of the main loop with a tick each,
   in 100 without one, and in 100 ticks while the main loop hangs. */

#include "firmware.c"

#include <stdio.h>
#include <stdlib.h>

static int fed;

void board_begin(tq_board *board) { board->baud = 1000000, board->entropy = 1; }
int board_write(int output, tq_number value) { return (void)output, (void)value, 0; }
void board_counts(uint16_t counts[TQ_MOTORS]) { counts[0] = counts[1] = 0; }
int board_button(void) { return 0; }
void board_kick(void) {}
void board_lock(void) {}
void board_unlock(void) {}
void board_pace(int ticks) { (void)ticks; }
uint32_t board_clock(void) { return 0; }
void board_watchdog(void) { fed++; }

/* The main loop's turn ends here. */
void board_wait(void)
{
    static int turns;
    int n;
    if (++turns <= 100)
        firmware_tick();
    if (turns == 100 || turns == 200)
        printf("%d ", fed), fed = 0;
    if (turns <= 200)
        return;
    for (n = 0; n < 100; n++)
        firmware_tick();
    printf("%d\n", fed);
    exit(0);
}

int main(void) { return firmware_main(); }
