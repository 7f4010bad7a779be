/* One narrow band from the same noise by two recursions, the kernel's and a transposed direct form
   II, in the precision of TQ_REAL: pairs of doubles on standard output. A build in single precision
   and one in double differ by rounding alone, for the noise is exact in both. */

#include <stdio.h>
#include <stdlib.h>

#include "kernel.h"

#define BLOCK 480

static const double rate_hz = 48000;

typedef struct {
    tq_real b0, a1, a2, s1, s2;
} direct_form;

/* H(z) = k/(1+k) (1 - z^-2) / (1 - 2 cos(2 pi f/rate)/(1+k) z^-1 + (1-k)/(1+k) z^-2), k = tan(pi B/rate);
   every coefficient exact in double precision and rounded once. */
static direct_form direct_form_of(double frequency_hz, double width_hz)
{
    double pi = 3.141592653589793, k = tan(pi * width_hz / rate_hz);
    direct_form d = {0};
    d.b0 = (tq_real)(k / (1 + k));
    d.a1 = (tq_real)(-2 * cos(2 * pi * frequency_hz / rate_hz) / (1 + k));
    d.a2 = (tq_real)((1 - k) / (1 + k));
    return d;
}

static tq_real direct_form_next(direct_form *d, tq_real w)
{
    tq_real y = d->b0 * w + d->s1;
    d->s1 = d->s2 - d->a1 * y;
    d->s2 = -d->b0 * w - d->a2 * y;
    return y;
}

/* The kernel with one layer of unit gain and no noise branch. */
static void start(tq_texture *t, tq_state *s, tq_real *values, tq_real *memory)
{
    static const tq_real axis[] = {1, 2}, none[2];
    t->speeds = t->forces = 2;
    t->layers = 1;
    t->speed_mm_s = t->force_n = axis;
    t->values = values, t->signs = t->slews = none;
    t->model_rate_hz = t->rate_hz = (tq_real)rate_hz;
    t->update_samples = 48;
    tq_start(t, s, memory, 1);
    tq_read(t, s, 0, 1, 1);
    tq_update(t, s);
}

/* Uniform on +-1 in 23 bits, which single precision holds. */
static tq_real noise(uint64_t *seed)
{
    *seed ^= *seed << 13, *seed ^= *seed >> 7, *seed ^= *seed << 17;
    return ((tq_real)(int32_t)(*seed >> 41) - 0x400000) * (tq_real)0x1p-22;
}

/* Arguments: blocks, f (Hz), B (Hz). */
int main(int count, char **arguments)
{
    long blocks = count == 4 ? atol(arguments[1]) : 0;
    double frequency_hz = count == 4 ? atof(arguments[2]) : 1;
    double width_hz = count == 4 ? atof(arguments[3]) : 1;
    tq_real values[16], memory[TQ_MEMORY(1, 0)], w[BLOCK], out[BLOCK];
    direct_form direct = direct_form_of(frequency_hz, width_hz);
    uint64_t seed = 2026;
    tq_texture t = {0};
    tq_state s;
    int n;
    for (n = 0; n < 16; n += 4) {
        values[n] = 0, values[n + 1] = (tq_real)frequency_hz;
        values[n + 2] = (tq_real)width_hz, values[n + 3] = 1;
    }
    start(&t, &s, values, memory);
    for (; blocks > 0; blocks--) {
        for (n = 0; n < BLOCK; n++)
            w[n] = noise(&seed);
        tq_filter(&t, &s, w, out, BLOCK);
        for (n = 0; n < BLOCK; n++) {
            double pair[] = {out[n], direct_form_next(&direct, w[n])};
            fwrite(pair, sizeof pair, 1, stdout);
        }
    }
    return 0;
}
