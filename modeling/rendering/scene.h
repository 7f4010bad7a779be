/* A scene: one hand over several textures, switched without a click. docs/method/rendering.md#scenes

   C99 or C++17; the lines of kernel.h on compiling and its macros hold here, too.

   Each hand has one state and one memory, whatever it touches. After a switch the present texture fades
   out as if the hand had lifted off: every gain is at 0 after 5 ms or one parameter update, whichever is
   longer; at another rate than the model's, 37 samples of the model ring out. Then the next texture starts,
   in silence for one parameter update, and its gains rise from 0 to those of the hand, the largest of them
   in 5 ms again. So at the model's rate it is heard after 6 ms with updates every millisecond. In between there is silence: a state renders one texture at a time, and the most
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

/* The wanted texture, from its beginning, behind the same compensation and limits as before; its hand is
   still to be read. */
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

/* A time as so many samples before the model's next one: of a texture with another rate of the model, where
   `now` is how far the output is behind. */
TQ_INLINE tq_real tq_scene_ago(uint64_t *from, tq_real ago, uint64_t position, tq_real now, tq_real shorter)
{
    *from -= position; /* modulo 2^64, as all positions */
    if (shorter != 1) {
        ago = tq_age(*from, ago, 0);
        *from = 0;
    }
    return (ago - now) * shorter;
}

/* The hand on the next texture is as it was read on the last one, whose state `before` was. */
TQ_INLINE void tq_scene_keep(tq_scene_hand *h, const tq_state *before, const tq_texture *last)
{
    const tq_texture *t = tq_scene_texture(h);
    tq_followed hand = before->hand;
    tq_real shorter = t->model_rate_hz / last->model_rate_hz, now = 0;
    tq_real longer = (tq_real)t->update_samples / (tq_real)last->update_samples / shorter;
    if (last->up)
        now = 1 - (tq_real)before->phase / (tq_real)(2 * last->up);
    hand.ago = tq_scene_ago(&hand.read, hand.ago, before->position, now, shorter);
    hand.off_ago = tq_scene_ago(&hand.off, hand.off_ago, before->position, now, shorter);
    hand.speed_slope *= longer;
    hand.force_slope *= longer;
    hand.speed_turn *= longer;
    hand.force_turn *= longer;
    tq_locate(t, &hand);
    h->state.hand = hand;
}

/* The next samples without a force, at most up to the next update, for a hand as of tq_scene_render_by. */
TQ_INLINE void tq_scene_lifted(tq_scene_hand *h, const tq_real *speed, const tq_real *force, size_t step,
                               int reads, tq_real *out, size_t count)
{
    tq_state *s = &h->state;
    tq_followed hand = s->hand;
    const tq_real off = 0;
    uint64_t lift_offs = s->counters.lift_offs; /* those of the hand, not of what is read for it */
    if (reads) {
        lift_offs += tq_lift_offs(speed, force, step, (int)count);
        s->hand.force = s->hand.force_slope = s->hand.force_turn = 0; /* no contact that has to end first */
        tq_render_by(tq_scene_texture(h), s, speed, &off, 0, 1, out, count);
    } else {
        lift_offs += hand.known ? 0 : count;
        TQ_FILL(&s->hand, 0, sizeof s->hand);
        tq_render_by(tq_scene_texture(h), s, &off, &off, 0, 0, out, count);
        s->hand = hand;
        tq_count_hand(s, 1, count); /* as last read, which does not depend on blocks */
    }
    s->counters.lift_offs = lift_offs;
}

/* The next `count` samples for a hand of `step` = 1 reading for each, or that is held (0); where `reads` is
   0, for the hand as last read. */
static void tq_scene_render_by(tq_scene_hand *h, const tq_real *speed, const tq_real *force, size_t step,
                               int reads, tq_real *out, size_t count)
{
    tq_state *s = &h->state;
    while (count) {
        const tq_texture *t = tq_scene_texture(h);
        size_t left = tq_scene_left(h), piece = count;
        int changes;
        if (left == 0 && h->wanted != h->now && tq_scene_silent(h)) {
            tq_state before = *s;
            tq_scene_next(h);
            if (!reads)
                tq_scene_keep(h, &before, t);
            t = tq_scene_texture(h);
        }
        changes = h->wanted != h->now || (h->switches && s->position == 0);
        if (changes) {
            int period = t->update_samples < TQ_CHUNK ? t->update_samples : TQ_CHUNK;
            size_t most = left ? left : tq_outputs_before(t, s->phase, period);
            piece = count < most ? count : most;
        }
        if (changes && left == 0) /* the next update finds the hand lifted */
            tq_scene_lifted(h, speed, force, step, reads, out, piece);
        else
            tq_render_by(t, s, speed, force, step, reads, out, piece);
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
    tq_scene_render_by(h, speed, force, 1, 1, out, count);
}

static inline void tq_scene_render_held(tq_scene_hand *h, tq_real speed, tq_real force, tq_real *out,
                                        size_t count)
{
    tq_scene_render_by(h, &speed, &force, 0, 1, out, count);
}

/* A reading of the hand at a time of its own, and the next samples for the hand as last read, as of
   tq_read and tq_render_on. */
static inline void tq_scene_read(tq_scene_hand *h, tq_real ago, tq_real speed, tq_real force)
{
    tq_read(tq_scene_texture(h), &h->state, ago, speed, force);
}

static inline void tq_scene_render_on(tq_scene_hand *h, tq_real *out, size_t count)
{
    const tq_real none = 0;
    tq_scene_render_by(h, &none, &none, 0, 0, out, count);
}

#endif
