/* Lattices of all small orders and ratios of rates in memory of just their size, to be watched by
   sanitizers; prints the sum of all samples. */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "lattice.h"

static double rendered(int order, int up, int down)
{
    tq_real axis[2] = {50, 350}, force[2] = {0.5, 3.5}, slew = 1, sum = 0, out[200];
    tq_real *values = calloc(4, sizeof *values), *memory;
    tq_real *frequencies = calloc((size_t)(4 * order), sizeof *frequencies);
    tq_real *doubling = calloc(2 * TQ_DOUBLING, sizeof *doubling);
    tq_real *phases = calloc((size_t)up * TQ_PHASE + 1, sizeof *phases);
    tq_texture texture = {0};
    tq_lattice lattice = {order, frequencies};
    tq_state state;
    tq_lattice_state filter;
    int i;
    texture.speeds = texture.forces = 2, texture.speed_mm_s = axis, texture.force_n = force;
    texture.values = values, texture.rate_hz = 48000, texture.model_rate_hz = 5000;
    texture.up = up, texture.down = down, texture.doubling = doubling, texture.phases = phases;
    texture.update_samples = 5, texture.slews = &slew;
    for (i = 0; i < 4; i++)
        values[i] = 1;
    for (i = 0; i < 4 * order; i++)
        frequencies[i] = 3 * (tq_real)(i % order + 1) / (tq_real)(order + 1);
    for (i = 0; i < 2 * TQ_DOUBLING; i++)
        doubling[i] = 1;
    for (i = 0; i < up * TQ_PHASE; i++)
        phases[i] = 1;
    memory = malloc(tq_lattice_memory(&texture, &lattice) * sizeof *memory);
    for (i = 0; i < (int)tq_lattice_memory(&texture, &lattice); i++)
        memory[i] = NAN; /* whatever was in it before */
    tq_lattice_start(&texture, &lattice, &state, &filter, memory, 1);
    for (i = 0; i < 5; i++)
        tq_lattice_render_held(&texture, &lattice, &state, &filter, i * 100, i, out + 40 * i, 40);
    for (i = 0; i < 200; i++)
        sum += out[i];
    free(values), free(doubling), free(phases), free(frequencies), free(memory);
    return sum;
}

int main(void)
{
    double sum = 0;
    int order, up, down;
    for (order = 1; order <= 30; order++)
        for (up = 0; up < 8; up++)
            for (down = 1; down <= 2 * up + !up; down++)
                sum += rendered(order, up, down);
    printf("%.17g\n", sum);
    return 0;
}
