/* Textures for tests of the player: two layers and a noise floor, at 5 kHz; of low frequencies, so that
   a click stands out. */

#ifndef PLAYER_TEXTURES_H
#define PLAYER_TEXTURES_H

#include "player.h"

enum { TEXTURES = 3, LAYERS = 2, MEMORY = TQ_MEMORY(LAYERS, 0), FORCE = 1 };
static const tq_real peaks_hz[TEXTURES][LAYERS] = {{20, 60}, {35, 90}, {15, 45}};
static const tq_real speeds[] = {20, 200}, forces[] = {(tq_real)0.5, 2}, one[] = {1};
static const tq_real zeros[LAYERS] = {0, 0};
static const tq_real slews[] = {(tq_real)0.01, (tq_real)0.2, (tq_real)0.2};
static tq_real values[TEXTURES][4][1 + 3 * LAYERS];
static tq_texture textures[TEXTURES];

/* Gains double from the lowest speed to the highest. There are no limits. */
static inline void fill_textures(void)
{
    int i, corner, layer;
    for (i = 0; i < TEXTURES; i++) {
        tq_texture *t = &textures[i];
        for (corner = 0; corner < 4; corner++) {
            tq_real *value = values[i][corner], gain = (tq_real)(corner < 2 ? 0.5 : 1);
            value[0] = gain / 500;
            for (layer = 0; layer < LAYERS; layer++) {
                value[1 + layer] = peaks_hz[i][layer];
                value[1 + LAYERS + layer] = 10;
                value[1 + 2 * LAYERS + layer] = layer ? -gain : gain;
            }
        }
        memset(t, 0, sizeof *t);
        t->speeds = t->forces = 2, t->layers = LAYERS;
        t->speed_mm_s = speeds, t->force_n = forces, t->values = values[i][0];
        t->signs = zeros, t->slews = slews;
        t->model_rate_hz = t->rate_hz = 5000, t->update_samples = 5;
        t->speed_change = 20, t->force_change = (tq_real)0.2, t->slope_share = (tq_real)0.2;
        t->hold = 100, t->release = 15;
    }
}

#endif
