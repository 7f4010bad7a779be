/* Lattices of all small orders and numbers of taps in memory of just their size, to be watched by
   sanitizers; prints the sum of all samples. */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "lattice.h"

static double rendered(int order, int taps, int up, int down)
{
    tq_real axis[2] = {50, 350}, force[2] = {0.5, 3.5}, one = 1, slew = 1, sum = 0, out[200];
    tq_real *values = calloc(4, sizeof *values), *lowpass = calloc((size_t)(up * taps), sizeof *lowpass);
    tq_real *frequencies = calloc((size_t)(4 * order), sizeof *frequencies), *memory;
    tq_texture texture = {0};
    tq_lattice lattice = {order, frequencies, up, down, taps, lowpass};
    tq_state state;
    tq_lattice_state filter;
    int i;
    texture.speeds = texture.forces = 2, texture.speed_mm_s = axis, texture.force_n = force;
    texture.values = values, texture.rate_hz = 48000, texture.noise_scale = 1;
    texture.lowpass = &one, texture.taps = 1, texture.update_samples = 5, texture.slews = &slew;
    for (i = 0; i < 4; i++)
        values[i] = 1;
    for (i = 0; i < 4 * order; i++)
        frequencies[i] = 3 * (tq_real)(i % order + 1) / (tq_real)(order + 1);
    for (i = 0; i < up * taps; i++)
        lowpass[i] = 1;
    memory = malloc(tq_lattice_memory(&lattice) * sizeof *memory);
    for (i = 0; i < (int)tq_lattice_memory(&lattice); i++)
        memory[i] = NAN; /* whatever was in it before */
    tq_lattice_start(&texture, &lattice, &state, &filter, memory, 1);
    for (i = 0; i < 5; i++)
        tq_lattice_render_held(&texture, &lattice, &state, &filter, i * 100, i, out + 40 * i, 40);
    for (i = 0; i < 200; i++)
        sum += out[i];
    free(values), free(lowpass), free(frequencies), free(memory);
    return sum;
}

int main(void)
{
    double sum = 0;
    int order, taps;
    for (order = 1; order <= 30; order++)
        for (taps = 1; taps < 8; taps++)
            sum += rendered(order, taps, 1, 1) + rendered(order, taps, 7, 3);
    printf("%.17g\n", sum);
    return 0;
}
