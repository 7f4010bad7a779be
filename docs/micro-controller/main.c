/* A texture on a micro-controller, from its ADC to its DAC. SPDX-License-Identifier: GPL-3.0-or-later */

#define TQ_REAL float
#include "canvas.h" /* tactileq export c models/canvas.json --single --peak 5 --rms 1 --duration 60 */
#include "board.h"

enum { HALF = 5, BACK = 16 };          /* samples in 1 ms; readings over which the speed is measured */
#define MM_PER_COUNT (100.0f / 4096)   /* a linear potentiometer of 100 mm */
#define N_PER_COUNT (5.0f / 4096)      /* a load cell of 5 N with its amplifier */
#define NO_CONTACT 60                  /* counts that it does not exceed while nothing touches it */
#define COUNTS_PER_G 400.0f            /* amplifier and actuator: tactileq rig calibrate measures it */

static tq_real memory[texture_canvas_memory];
static tq_state state;
static uint16_t values[2 * HALF], places[BACK];

static uint16_t to_dac(tq_real acceleration_g)
{
    tq_real value = 2048.5f + COUNTS_PER_G * acceleration_g;
    return (uint16_t)(value < 0 ? 0 : value > 4095 ? 4095 : value);
}

int main(void)
{
    size_t turn = 0, n;
    for (n = 0; n < 2 * HALF; n++)
        values[n] = to_dac(0);
    for (n = 0; n < BACK; n++)
        places[n] = board_position();
    tq_start(&texture_canvas, &state, memory, texture_canvas_key);
    board_play(values, 2 * HALF);
    for (;; turn = (turn + 1) % BACK) {
        uint16_t *half = values + HALF * board_half(), place = board_position();
        tq_real speed = (tq_real)(place - places[turn]) * (MM_PER_COUNT * 1000 / BACK), out[HALF];
        tq_real force = (tq_real)(board_force() - NO_CONTACT) * N_PER_COUNT;
        places[turn] = place;
        tq_read(&texture_canvas, &state, HALF, speed, force);
        tq_render_on(&texture_canvas, &state, out, HALF);
        for (n = 0; n < HALF; n++)
            half[n] = to_dac(out[n]);
    }
}
