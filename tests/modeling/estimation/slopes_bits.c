/* Prints the bits of everything that slopes.h calculates for one set of arbitrary numbers. */

#include "slopes.h"

#include <stdint.h>
#include <stdio.h>

enum { ROWS = 3, LAYERS = 5, BINS = 37, P = 1 + 3 * LAYERS, NODES = 6, CELLS = 2 };

static double uniform(void)
{
    static uint64_t state = 1;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) / 9007199254740992.0;
}

static void print(const double *values, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        uint64_t bits;
        memcpy(&bits, values + i, sizeof bits);
        printf("%016llx\n", (unsigned long long)bits);
    }
}

int main(void)
{
    static double table[5][ROWS * BINS], theta[ROWS * P], signs[ROWS * LAYERS], memory[100000];
    static ptrdiff_t lowest[CELLS * BINS];
    static double found[ROWS * (2 + P + P * P)], slope[(CELLS + NODES) * P * BINS], off[CELLS * BINS];
    static double blocks[5 * NODES * P * P], score[NODES * P];
    const double shares[4] = {0.25, 0.25, 0.25, 0.25};
    const ptrdiff_t corners[8] = {0, 1, 3, 4, 1, 2, 4, 5};
    const ptrdiff_t steps[16] = {0, 1, 3, 4, 0, 0, 2, 3, 0, 0, 0, 1, 0, 0, 0, 0};
    for (int i = 0; i < ROWS * BINS; i++) {
        table[0][i] = 0.1 + uniform();
        table[1][i] = uniform() < 0.2 ? 0 : uniform();
        table[2][i] = 0.05 + 3 * uniform();
        table[3][i] = 1 / table[2][i];
        table[4][i] = 1;
    }
    for (int i = 0; i < ROWS * P; i++)
        theta[i] = i % P && i % P <= 2 * LAYERS ? 2 + 4 * uniform() : uniform();
    for (int i = 0; i < ROWS * LAYERS; i++)
        signs[i] = uniform() < 0.5 ? 1 : -1;
    tq_spectra of = {ROWS,     BINS,     LAYERS,   0.003,    490,     1e-200, 20, 0.7,
                     table[0], table[1], table[2], table[3], table[4]};
    double *information = found + 2 * ROWS;
    for (int independent = 0; independent < 2; independent++) {
        tq_slopes(&of, theta, independent ? NULL : signs, memory, found, found + ROWS, information,
                  information + ROWS * P * P);
        print(found, ROWS * (2 + P + P * P));
    }
    for (size_t i = 0; i < (CELLS + NODES) * P * BINS; i++)
        slope[i] = uniform() - 0.5;
    for (size_t i = 0; i < CELLS * BINS; i++)
        off[i] = uniform() < 0.2 ? 0 : uniform() - 0.5;
    for (size_t i = 0; i < CELLS * BINS; i++)
        lowest[i] = (ptrdiff_t)(uniform() * 5) - 1;
    tq_cells cells = {CELLS, NODES, BINS, P, 20, slope, off, shares, corners, steps, lowest};
    tq_held(&cells, memory, blocks, score);
    print(blocks, 5 * NODES * P * P);
    print(score, NODES * P);
    return 0;
}
