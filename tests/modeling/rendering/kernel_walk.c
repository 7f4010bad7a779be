/* Drives the kernel along arbitrary trajectories, a parameter update at every sample, and looks at
   every step of every layer. Prints what it saw, one "name value" a line; judges nothing. */

#include <float.h>
#include <stdio.h>
#include <stdlib.h>

#include "kernel.h"

#define MOST_LAYERS 5
#define EPISODE 2000 /* samples of one texture, one rate and one kind of trajectory */
#define SINGLE (sizeof(tq_real) == sizeof(float))
#define EPSILON (SINGLE ? (long double)FLT_EPSILON : (long double)DBL_EPSILON)
#define LARGEST (SINGLE ? (tq_real)FLT_MAX : (tq_real)DBL_MAX)
#define SUBNORMAL (SINGLE ? (tq_real)FLT_MIN / 16 : (tq_real)(DBL_MIN / 16))

enum { JUMPS, STROKES, STEPS, ON_AND_OFF, REST, IN_THE_AIR, ODD, ANYTHING, KINDS };

static uint64_t seed = 2026;

/* Uniform on 0 ... 1 (Marsaglia's xorshift, unlike the kernel's own generator). */
static double uniform(void)
{
    seed ^= seed << 13, seed ^= seed >> 7, seed ^= seed << 17;
    return (double)(seed >> 11) * 0x1p-53;
}

static int below(int count)
{
    return (int)(uniform() * count);
}

/* From the lowest to the highest legal value, evenly or evenly in octaves; an edge; or beyond. */
static double anywhere(double lowest, double highest)
{
    double outside[] = {lowest, highest, 0, -highest, 1e6 * highest};
    int kind = below(8);
    if (kind < 4)
        return lowest + (highest - lowest) * uniform();
    return kind < 7 ? lowest * pow(highest / lowest, uniform()) : outside[below(5)];
}

typedef struct {
    tq_texture texture;
    tq_real axes[4], values[4 * (1 + 3 * MOST_LAYERS)], signs[MOST_LAYERS];
    tq_real slews[1 + MOST_LAYERS], memory[TQ_MEMORY(MOST_LAYERS, 0)];
    double largest[1 + MOST_LAYERS]; /* of the noise gain and of every layer's gain */
    tq_state state;
} walk;

/* Another texture: a grid of 2 x 2 whose corners have nothing to do with each other. */
static void begin(walk *k)
{
    static const double rates[] = {5000, 44100, 48000};
    tq_texture *t = &k->texture;
    int corner, i;
    double share;
    memset(k, 0, sizeof *k);
    t->speeds = t->forces = 2;
    t->layers = 1 + below(MOST_LAYERS);
    t->model_rate_hz = t->rate_hz = (tq_real)rates[below(3)];
    t->update_samples = 1;
    t->hold = (tq_real)below(4), t->release = (tq_real)below(4);
    t->speed_mm_s = k->axes, t->force_n = k->axes + 2;
    t->values = k->values, t->signs = k->signs, t->slews = k->slews;
    for (i = 0; i < 4; i += 2) {
        k->axes[i] = (tq_real)pow(10, 4 * uniform() - 2);
        k->axes[i + 1] = k->axes[i] * (tq_real)(1 + 10 * uniform() + 1e-3);
    }
    for (corner = 0; corner < 4; corner++) {
        tq_real *value = k->values + corner * (1 + 3 * t->layers);
        value[0] = (tq_real)uniform();
        for (i = 0; i < t->layers; i++) {
            value[1 + i] = (tq_real)anywhere(1, 0.49 * t->rate_hz);
            value[1 + t->layers + i] = (tq_real)anywhere(0.1, 0.45 * t->rate_hz);
            value[1 + 2 * t->layers + i] = (tq_real)((2 * uniform() - 1) * pow(10, below(4)));
            k->largest[1 + i] = fmax(k->largest[1 + i], fabs(value[1 + 2 * t->layers + i]));
        }
        k->largest[0] = fmax(k->largest[0], value[0]);
    }
    share = 1 / (5e-3 * t->rate_hz);
    for (i = 0; i <= t->layers; i++)
        k->slews[i] = (tq_real)(k->largest[i] * share);
    for (i = 0; i < t->layers; i++)
        k->signs[i] = (tq_real)(below(3) - 1);
    tq_start(t, &k->state, k->memory, seed);
}

static tq_real odd(tq_real edge)
{
    tq_real values[] = {0, NAN, INFINITY, -INFINITY, LARGEST, -LARGEST, SUBNORMAL, -SUBNORMAL, edge,
                        -edge, edge * (1 - (tq_real)EPSILON), (tq_real)-0.0};
    return values[below(12)];
}

/* The hand at sample n; what it does not change stays as it was. */
static void move(const walk *k, int kind, int n, tq_real *speed, tq_real *force)
{
    tq_real fastest = k->axes[1], strongest = k->axes[3];
    double turn = 0.001 * (1 + n % 7) * n;
    switch (kind == ANYTHING ? below(ANYTHING) : kind) {
    case JUMPS:
        *speed = fastest * (tq_real)(3 * uniform() - 1.5);
        *force = strongest * (tq_real)(2 * uniform() - 0.5);
        break;
    case STROKES:
        *speed = 2 * fastest * (tq_real)sin(turn), *force = strongest * (tq_real)fabs(cos(turn / 3));
        break;
    case STEPS:
        if (below(50) == 0)
            *speed = fastest * (tq_real)(2 * uniform() - 1), *force = strongest * (tq_real)uniform();
        break;
    case ON_AND_OFF:
        *speed = fastest, *force = below(5) ? strongest : 0;
        break;
    case REST:
        *speed = 0, *force = strongest;
        break;
    case IN_THE_AIR:
        *speed = fastest, *force = 0;
        break;
    default:
        *speed = odd(fastest), *force = odd(strongest);
    }
}

typedef struct {
    long long samples, not_finite, lift_offs, lift_offs_counted, clamped, turned;
    long double excess, reach, share_of_bound;
} sight;

static long double held(const walk *k, int layer)
{
    long double s1 = k->memory[layer], s2 = k->memory[TQ_ROW(k->texture.layers) + layer];
    return s1 * s1 + s2 * s2;
}

/* The most energy that a layer's step can leave of a unit, whatever the state and the noise: the
   larger eigenvalue of M M^T, where M is the matrix of the step from (s1, s2, w) to (s1, s2). */
static long double reach(const walk *k, int layer)
{
    long double value[TQ_ROWS], p, q, r, a, b, c;
    int row;
    for (row = 0; row < TQ_ROWS; row++)
        value[row] = tq_row(&k->texture, &k->state, row)[layer];
    p = 1 + value[TQ_P], q = value[TQ_Q], r = 1 + value[TQ_R];
    a = p * p + q * q + value[TQ_B1] * value[TQ_B1];
    b = q * q + r * r + value[TQ_B2] * value[TQ_B2];
    c = q * (p - r) + value[TQ_B1] * value[TQ_B2];
    return (a + b) / 2 + sqrtl((a - b) * (a - b) / 4 + c * c);
}

/* One sample: what it does to the energy of every state, and what comes out. */
static void step(walk *k, tq_real speed, tq_real force, sight *seen)
{
    const tq_texture *t = &k->texture;
    tq_real w = tq_noise(k->state.key, k->state.position), out;
    long double before[MOST_LAYERS], bound = k->largest[0] * fabsl((long double)w);
    tq_real p = tq_row(t, &k->state, TQ_P)[0];
    int i, lifted = !(isfinite(speed) && isfinite(force));
    for (i = 0; i < t->layers; i++)
        before[i] = held(k, i) + (long double)w * w;
    tq_render(t, &k->state, &speed, &force, &out, 1);
    for (i = 0; i < t->layers; i++) {
        long double excess = held(k, i) / before[i] - 1;
        if (!(excess <= seen->excess)) /* keeps a NaN, too */
            seen->excess = excess;
        if (!(reach(k, i) <= seen->reach))
            seen->reach = reach(k, i);
        bound += k->largest[1 + i] * sqrtl(before[i]);
    }
    if (!(fabsl((long double)out) <= seen->share_of_bound * bound))
        seen->share_of_bound = fabsl((long double)out) / bound;
    seen->samples++;
    seen->lift_offs += lifted;
    seen->not_finite += !isfinite(out);
    seen->turned += fabs(tq_row(t, &k->state, TQ_P)[0] - p) > 0.1;
}

int main(int count, char **arguments)
{
    long long wanted = count > 1 ? atoll(arguments[1]) : 0;
    sight seen = {0};
    walk k;
    int episode, n;
    seen.excess = -1;
    for (episode = 0; seen.samples < wanted; episode++) {
        tq_real speed = 0, force = 0;
        begin(&k);
        for (n = 0; n < EPISODE; n++) {
            move(&k, episode % KINDS, n, &speed, &force);
            step(&k, speed, force, &seen);
        }
        seen.lift_offs_counted += (long long)k.state.counters.lift_offs;
        seen.clamped += (long long)k.state.counters.clamped;
    }
    printf("samples %lld\nnot_finite %lld\n", seen.samples, seen.not_finite);
    printf("lift_offs %lld\nlift_offs_counted %lld\n", seen.lift_offs, seen.lift_offs_counted);
    printf("clamped %lld\nturned %lld\n", seen.clamped, seen.turned);
    printf("excess_in_epsilons %.3Lf\n", seen.excess / EPSILON);
    printf("reach_in_epsilons %.3Lf\n", (seen.reach - 1) / EPSILON);
    printf("share_of_bound %.6Lf\n", seen.share_of_bound);
    return 0;
}
