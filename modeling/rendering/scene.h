/* A scene: one hand over several textures, switched without a click. docs/method/rendering.md#scenes

   C99 or C++17; the lines of kernel.h on compiling and its macros hold here, too.

   Each hand has one state and one memory, whatever it touches. After a switch the present texture fades
   out as if the hand had lifted off: every gain is at 0 after 5 ms or one parameter update, whichever is
   longer. Then the next texture starts, in silence for one parameter update, and its gains rise from 0
   to those of the hand, the largest of them in 5 ms again. So it is heard after 6 ms with updates every
   millisecond. In between there is silence: a state renders one texture at a time, and the most
   expensive sample costs one tq_start and one tq_render.

   All textures of a scene must have the same rate, compensation and limits. The states of the limits and
   of the compensation continue over a switch, and so do the counters (hand->state.counters): the
   actuator's limits hold for the output, whichever texture plays.

   Noise: before the first switch stream (number of the hand) * 2^32, after switch n stream n more, all
   of the scene's seed. Output depends on the blocks only through the times of switches: with switches
   at equal samples it has equal bits.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_SCENE_H
#define TQ_SCENE_H

#ifndef TQ_KERNEL_H
#include "kernel.h"
#endif

#define TQ_LARGER(a, b) ((a) > (b) ? (a) : (b))

/* The textures that can be touched: constant while playing. */
typedef struct {
    const tq_texture *textures;
    int count;
    uint64_t noise; /* of the seed: tq_scene_mix(seed + UINT64_C(0x9E3779B97F4A7C15)) */
} tq_scene;

typedef struct {
    const tq_scene *scene;
    uint64_t number, switches; /* of the hand; switches so far */
    int now, wanted;           /* indices of the texture that plays, fades included, and of the next */
    tq_state state;
} tq_scene_hand;

/* The mixing of SplitMix64. */
TQ_INLINE uint64_t tq_scene_mix(uint64_t z)
{
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    return z ^ (z >> 31);
}

TQ_INLINE const tq_texture *tq_scene_texture(const tq_scene_hand *h)
{
    return h->scene->textures + h->now;
}

/* The key of the noise until the next switch. */
TQ_INLINE uint64_t tq_scene_key(const tq_scene_hand *h)
{
    uint64_t stream = (h->number << 32) + h->switches;
    return tq_scene_mix((h->scene->noise ^ stream) + UINT64_C(0x9E3779B97F4A7C15));
}

/* Whether no gain is left, as at lift-off and in the first update after a switch, and nothing that is yet
   to be interpolated. */
TQ_INLINE int tq_scene_silent(const tq_scene_hand *h)
{
    const tq_texture *t = tq_scene_texture(h);
    const tq_real *gain = tq_row(t, &h->state, TQ_GAIN), *past = tq_past(t, &h->state);
    int i;
    for (i = 0; i < t->layers; i++)
        if (gain[i] != 0)
            return 0;
    for (i = 0; t->up && i < TQ_DOUBLING - 1; i++)
        if (past[i] != 0)
            return 0;
    for (i = 2; t->up && i < TQ_PHASE + 1; i++) /* two for what came before an update */
        if (past[TQ_KEPT + i] != 0)
            return 0;
    return h->state.floor_gain == 0;
}

/* Samples until the next parameter update, or for a chunk at the texture's rate. */
TQ_INLINE size_t tq_scene_left(const tq_scene_hand *h)
{
    const tq_texture *t = tq_scene_texture(h);
    const tq_state *s = &h->state;
    int left = t->update_samples - s->since_update;
    return s->position ? tq_outputs_before(t, s->phase, left < TQ_CHUNK ? left : TQ_CHUNK) : 0;
}

/* The wanted texture, from its beginning, behind the same compensation and limits as before. */
static void tq_scene_next(tq_scene_hand *h)
{
    tq_state before = h->state;
    h->now = h->wanted;
    h->switches++;
    tq_start(tq_scene_texture(h), &h->state, before.memory, tq_scene_key(h));
    h->state.notch_s1 = before.notch_s1;
    h->state.notch_s2 = before.notch_s2;
    h->state.mean_square = before.mean_square;
    h->state.sounding = before.sounding;
    h->state.silent = before.silent;
    h->state.counters = before.counters;
}

/* The next `count` samples for a hand of `step` = 1 reading for each, or that is held (0). */
static void tq_scene_render_by(tq_scene_hand *h, const tq_real *speed, const tq_real *force, size_t step,
                               tq_real *out, size_t count)
{
    tq_state *s = &h->state;
    const tq_real off = 0;
    while (count) {
        const tq_texture *t = tq_scene_texture(h);
        int changes, lifted;
        size_t left = tq_scene_left(h), piece = count;
        uint64_t lift_offs = s->counters.lift_offs;
        if (left == 0 && h->wanted != h->now && tq_scene_silent(h)) {
            tq_scene_next(h);
            t = tq_scene_texture(h);
        }
        changes = h->wanted != h->now || (h->switches && s->position == 0);
        lifted = changes && left == 0; /* as the next update reads the hand */
        if (changes) {
            int period = t->update_samples < TQ_CHUNK ? t->update_samples : TQ_CHUNK;
            size_t most = left ? left : tq_outputs_before(t, s->phase, period);
            piece = count < most ? count : most;
        }
        if (lifted)
            lift_offs += tq_lift_offs(speed, force, step, (int)piece);
        tq_render_by(t, s, speed, lifted ? &off : force, lifted ? 0 : step, out, piece);
        if (lifted) /* those of the hand, not of what was read for it */
            s->counters.lift_offs = lift_offs;
        speed += step * piece, force += step * piece;
        out += piece, count -= piece;
    }
}

/* --- The calls --------------------------------------------------------------------------------- */

/* A hand on a texture of the scene; an index out of range selects the first texture.
   `memory` holds as many reals as the largest TQ_MEMORY of all textures and must live as long as the
   hand. Hands of different numbers have different noise. */
static inline void tq_scene_start(tq_scene_hand *h, const tq_scene *scene, tq_real *memory,
                                  uint32_t number, int texture)
{
    h->scene = scene;
    h->number = number;
    h->switches = 0;
    h->now = h->wanted = texture >= 0 && texture < scene->count ? texture : 0;
    tq_start(tq_scene_texture(h), &h->state, memory, tq_scene_key(h));
}

/* The texture that the hand touches from now on: called between two blocks, at any time. A texture that
   is fading out rises again if selected. An index out of range changes nothing. */
static inline void tq_scene_switch(tq_scene_hand *h, int texture)
{
    if (texture >= 0 && texture < h->scene->count)
        h->wanted = texture;
}

/* The next samples, as of tq_render and tq_render_held. */
static inline void tq_scene_render(tq_scene_hand *h, const tq_real *speed, const tq_real *force,
                                   tq_real *out, size_t count)
{
    tq_scene_render_by(h, speed, force, 1, out, count);
}

static inline void tq_scene_render_held(tq_scene_hand *h, tq_real speed, tq_real force, tq_real *out,
                                        size_t count)
{
    tq_scene_render_by(h, &speed, &force, 0, out, count);
}

#endif
