/* What main.c needs of a board; to be written for yours. */
#ifndef BOARD_H
#define BOARD_H

#include <stddef.h>
#include <stdint.h>

/* Place of the hand and force on it, 0 to 4095, as the ADC has them now. */
uint16_t board_position(void);
uint16_t board_force(void);

/* Let a timer send `count` values, 0 to 4095, to the DAC by DMA, at the texture's rate, over and over. */
void board_play(const uint16_t *values, size_t count);

/* Wait until the DAC has begun with one half of them; the other half, 0 or 1, is to be filled now. */
int board_half(void);

#endif
