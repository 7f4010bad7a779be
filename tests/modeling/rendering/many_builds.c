/* Streams side by side against one at a time, in every width that this processor has. Arbitrary
   hands, layers that jump all over their range, lengths of their own, limits and compensation. */

#include <stdio.h>
#include <stdlib.h>

#include "many.h"

enum { LAYERS = 5, SPEEDS = 3, FORCES = 4, NODES = SPEEDS * FORCES, LONGEST = 3000 };

static uint64_t drawn;

/* Uniform between two values. */
static double between(double low, double high)
{
    return low + (high - low) * (tq_noise(17, drawn++) / 1.7320508075688772 + 1) / 2;
}

static tq_real speeds[SPEEDS] = {20, 150, 351.3}, forces[FORCES] = {0.3, 1.1, 2.2, 3.5};
static tq_real values[NODES][1 + 3 * LAYERS], rows[NODES * 64], signs[LAYERS], slews[1 + LAYERS];
static tq_real doubling[2 * TQ_DOUBLING], phases[7 * TQ_PHASE];
static tq_real hands[2][TQ_STREAMS][LONGEST], single[LONGEST], many[TQ_STREAMS][LONGEST];

/* The values of the grid, for one stream and for many. */
static void draw_grid(void)
{
    size_t node, gains = tq_gains_at(LAYERS), i;
    for (node = 0; node < NODES; node++) {
        tq_real *row = rows + node * tq_table_row(LAYERS);
        row[gains] = values[node][0] = between(-0.05, 0.2);
        for (i = 0; i < LAYERS; i++) {
            row[2 * i] = values[node][1 + i] = between(-50, 2600);
            row[2 * i + 1] = values[node][1 + LAYERS + i] = between(-50, 2600);
            row[gains + 1 + i] = values[node][1 + 2 * LAYERS + i] = between(-1, 1);
        }
    }
    for (i = 0; i < LAYERS; i++)
        signs[i] = i % 3 - 1.0, slews[1 + i] = 0.2;
    slews[0] = 0.04;
}

/* A hand that moves, jumps, lifts off and reads nonsense. */
static void draw_hand(size_t stream)
{
    tq_real speed = 0, force = 0;
    size_t n;
    for (n = 0; n < LONGEST; n++) {
        double what = between(0, 1);
        speed += between(-9, 9), force += between(-0.1, 0.1);
        if (what < 0.02)
            speed = between(-400, 400), force = between(-1, 4);
        if (what < 0.005)
            speed = force = 0;
        hands[0][stream][n] = what > 0.99 ? (tq_real)NAN : what > 0.98 ? 1e300 : speed;
        hands[1][stream][n] = what > 0.97 && what < 0.98 ? (tq_real)INFINITY : force;
    }
}

static tq_texture texture(int up, int update_samples, int all)
{
    tq_texture t = {.speeds = SPEEDS, .forces = FORCES, .layers = LAYERS};
    t.speed_mm_s = speeds, t.force_n = forces, t.values = &values[0][0], t.signs = signs;
    t.model_rate_hz = 5000, t.rate_hz = up ? 10000.0 * up / 3 : 5000;
    t.up = up, t.down = up ? 3 : 0, t.doubling = doubling, t.phases = phases, t.lead = up ? 0.4 : 0;
    t.update_samples = update_samples, t.slews = slews;
    t.speed_change = 20, t.force_change = 0.2, t.slope_share = 0.25;
    if (all) {
        t.notch_hz = 80, t.notch_width_hz = 60, t.notch_share = 0.7;
        t.peak = 0.9, t.mean_square = 0.16, t.mean_share = 0.004;
        t.longest = 500, t.pause = 50, t.silence = 1e-3;
    }
    return t;
}

/* Samples and counters that differ, of as many streams as there are lanes. */
static int differing(tq_texture t, int lanes)
{
    tq_stream streams[TQ_STREAMS];
    tq_real *memory = malloc(tq_many_memory(t.layers) * sizeof *memory);
    tq_real alone[TQ_MEMORY(LAYERS, 1)];
    int different = 0, l;
    tq_state state;
    memset(streams, 0, sizeof streams);
    for (l = 0; l < lanes; l++) {
        tq_stream *s = streams + l;
        s->texture = t, s->texture.values = rows;
        s->key = 1000 + (uint64_t)l, s->count = (size_t)(LONGEST - 371 * l);
        s->speed = hands[0][l], s->force = hands[1][l], s->out = many[l];
    }
    tq_render_many(streams, memory, lanes);
    for (l = 0; l < lanes; l++) {
        tq_start(&t, &state, alone, streams[l].key);
        tq_render(&t, &state, hands[0][l], hands[1][l], single, streams[l].count);
        different += memcmp(single, many[l], streams[l].count * sizeof *single) != 0;
        different += memcmp(&state.counters, &streams[l].counters, sizeof state.counters) != 0;
    }
    free(memory);
    return different;
}

int main(void)
{
    static const int periods[] = {1, 5, 64, 700};
    int lanes, up, all, different = 0;
    size_t i;
    draw_grid();
    for (i = 0; i < sizeof doubling / sizeof *doubling; i++)
        doubling[i] = between(-0.1, 0.2);
    for (i = 0; i < sizeof phases / sizeof *phases; i++)
        phases[i] = between(-0.1, 0.3);
    for (i = 0; i < TQ_STREAMS; i++)
        draw_hand(i);
    for (lanes = 2; lanes <= tq_widest(); lanes *= 2) {
        for (i = 0; i < sizeof periods / sizeof *periods; i++)
            for (up = 0; up <= 7; up += 7)
                for (all = 0; all < 2; all++)
                    different += differing(texture(up, periods[i], all), lanes);
        printf("%d ", lanes);
    }
    printf("%d\n", different);
    return different != 0;
}
