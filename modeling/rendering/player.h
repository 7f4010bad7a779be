/* The player: what a real-time callback calls to play textures, swap them and stop without a click.
   docs/method/rendering.md#player

   C11, C++17, or C99 with GCC or Clang. No allocation, no lock, no system call, and no library call but
   those of kernel.h; its lines on compiling and its macros hold here, too.

   A voice is a texture, or the lattice of an all-pole model, with its own state and memory. One control
   thread (any thread, but one at a time) prepares voices and selects the one to play, NULL for silence.
   One callback thread renders. None of these calls ever waits.

   A change takes effect in the next block. The playing voice fades out linearly; then the selected one
   starts, with a fade-in of the same length. So its first sample is at most one block and one fade late.
   A selection during a fade takes effect at once: a voice that is fading out rises again if it is
   selected again, a voice that is fading in falls again if it is not. After a stop the output is
   exactly 0 and costs a memset. A voice that is selected again without being prepared again continues
   where it stopped.

   The hand is read by tq_player_read, whenever there is a reading; a voice that starts begins with the last
   one. Output does not depend on the blocks: with readings and changes between blocks at equal samples it
   has equal bits. A voice between its fades is the output of tq_render_on or tq_lattice_render_on, rounded
   to single precision.

   Every sample is rendered by one voice at most. So the most expensive block costs its rendering and,
   where a voice begins, up to 64 squarings more. Stack: 4 TQ_CHUNK reals.

   All voices of a player must have the same rate, peak, mean_square, mean_share, longest, pause and
   silence. Then these limits hold for the output, swaps included: each voice takes over the state of
   the limits from the one before and the silence between, and a fade only makes samples smaller.
   (Rounding to single precision adds up to 6e-8 of a sample.)

   Example for PortAudio. The program that starts the stream calls begin before it, and change as often
   as needed; `hand` is a function of the program and must not wait, either.

       #include "player.h"

       static tq_player player;

       void hand(tq_real *ago, tq_real *speed, tq_real *force);

       void begin(void)
       {
           tq_player_start(&player, TQ_FADE(48000));
       }

       int change(tq_voice *voice, const tq_texture *texture, tq_real *memory, uint64_t key)
       {
           if (tq_player_uses(&player, voice))
               return 0;
           tq_voice_start(voice, texture, memory, key);
           tq_player_want(&player, voice);
           return 1;
       }

       int callback(const void *in, void *out, unsigned long count, const void *times,
                    unsigned long flags, void *user)
       {
           tq_real ago, speed, force;
           (void)in, (void)times, (void)flags, (void)user;
           hand(&ago, &speed, &force);
           tq_player_read(&player, ago, speed, force);
           tq_player_render(&player, (float *)out, count);
           return 0;
       }

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_PLAYER_H
#define TQ_PLAYER_H

#include "lattice.h"

/* Pointers that two threads share. All loads and stores are sequentially consistent: there is one order
   of them that both threads see, and what a thread wrote before a store is seen by who loads the stored
   value. For other compilers define all three before including this. */
#ifndef TQ_SHARED
#if !defined __cplusplus && defined __STDC_VERSION__ && __STDC_VERSION__ >= 201112L \
    && !defined __STDC_NO_ATOMICS__
#include <stdatomic.h>
#if ATOMIC_POINTER_LOCK_FREE != 2
#error "expected pointers that are read and written without a lock; define TQ_SHARED."
#endif
#define TQ_SHARED(type) _Atomic(type)
#define TQ_GET(place) atomic_load(place)
#define TQ_SET(place, value) atomic_store(place, value)
#elif defined __GNUC__ && __GCC_ATOMIC_POINTER_LOCK_FREE == 2
#define TQ_SHARED(type) type
#define TQ_GET(place) __atomic_load_n(place, __ATOMIC_SEQ_CST)
#define TQ_SET(place, value) __atomic_store_n(place, value, __ATOMIC_SEQ_CST)
#else
#error "expected C11 atomics or those of GCC or Clang; define TQ_SHARED, TQ_GET and TQ_SET."
#endif
#endif

/* A fade of 5 ms, in samples. */
#define TQ_FADE(rate_hz) ((int)((rate_hz) / 200))

/* The texture, the lattice of an all-pole model (else NULL) and their data, and the memory, must stay as they
   are while the voice is in use. */
typedef struct {
    const tq_texture *texture;
    const tq_lattice *lattice;
    tq_state state;
    tq_lattice_state filter;
} tq_voice;

typedef struct {
    TQ_SHARED(tq_voice *) wanted;  /* written by the control thread */
    TQ_SHARED(tq_voice *) playing; /* written by the callback */
    /* The callback's own: steps of a fade, those of them that the voice has risen, and 1 / fade. */
    int fade, level;
    tq_real step;
    /* What the limits remembered when the last voice left, and samples of silence since. */
    tq_real mean_square;
    uint64_t sounding, silent, idle;
    /* The last reading of the hand, 0 before the first, and how many samples ago it was made. */
    tq_real speed, force, ago;
} tq_player;

/* --- The control thread ------------------------------------------------------------------------ */

/* Silence. Fades take `fade` samples, at least 1. Before the callback is first called. */
static inline void tq_player_start(tq_player *p, int fade)
{
    TQ_FILL(p, 0, sizeof *p);
    p->fade = fade > 1 ? fade : 1;
    p->step = 1 / (tq_real)p->fade;
}

/* Prepares a voice that is not in use; see tq_start. */
static inline void tq_voice_start(tq_voice *v, const tq_texture *t, tq_real *memory, uint64_t key)
{
    v->texture = t;
    v->lattice = NULL;
    tq_start(t, &v->state, memory, key);
}

/* The same for an all-pole model; see tq_lattice_start. */
static inline void tq_voice_start_lattice(tq_voice *v, const tq_texture *t, const tq_lattice *l,
                                          tq_real *memory, uint64_t key)
{
    v->texture = t;
    v->lattice = l;
    tq_lattice_start(t, l, &v->state, &v->filter, memory, key);
}

/* What shall play from now on; NULL for silence. */
static inline void tq_player_want(tq_player *p, tq_voice *v)
{
    TQ_SET(&p->wanted, v);
}

/* The voice that plays, fades included; NULL in silence. */
static inline tq_voice *tq_player_playing(tq_player *p)
{
    return TQ_GET(&p->playing);
}

/* Whether the callback uses a voice or may yet. Once it does not, the voice may be freed or prepared
   again: nobody touches it until it is wanted again.

   For the callback takes a voice in this order: it writes `playing`, then reads `wanted` once more. The
   control thread writes `wanted` and later reads `playing` here. In the one order of these four either
   the callback reads that the voice is no longer wanted and leaves it alone, or this reads that it
   plays. After the last touch the callback writes `playing`; who reads that may write the voice. */
static inline int tq_player_uses(tq_player *p, const tq_voice *v)
{
    return TQ_GET(&p->wanted) == v || TQ_GET(&p->playing) == v;
}

/* --- The callback ------------------------------------------------------------------------------ */

/* x^n by squaring, for 0 <= x <= 1. */
TQ_INLINE tq_real tq_power(tq_real x, uint64_t n)
{
    tq_real power = 1;
    for (; n; n >>= 1, x *= x)
        if (n & 1)
            power *= x;
    return power;
}

/* A voice takes over the hand, and what the limits remember, as if it had itself been silent since. */
TQ_INLINE void tq_player_remind(const tq_player *p, tq_voice *v)
{
    const tq_texture *t = v->texture;
    tq_state *s = &v->state;
    TQ_FILL(&s->hand, 0, sizeof s->hand);
    tq_read(t, s, p->ago, p->speed, p->force);
    s->mean_square = p->mean_square * tq_power(1 - t->mean_share, p->idle);
    s->mean_square = tq_within(s->mean_square, 0, t->mean_square);
    s->silent = p->silent + p->idle;
    s->sounding = s->silent >= t->pause || !p->sounding ? 0 : p->sounding + p->idle;
}

/* The wanted voice, ready to fade in; NULL if there is none, or it changes at this moment. */
TQ_INLINE tq_voice *tq_player_take(tq_player *p)
{
    tq_voice *v = TQ_GET(&p->wanted);
    if (!v)
        return NULL;
    TQ_SET(&p->playing, v);
    if (TQ_GET(&p->wanted) != v) { /* perhaps freed before it was seen to play */
        TQ_SET(&p->playing, NULL);
        return NULL;
    }
    tq_player_remind(p, v);
    return v;
}

TQ_INLINE void tq_player_leave(tq_player *p, const tq_voice *v)
{
    p->mean_square = v->state.mean_square;
    p->sounding = v->state.sounding;
    p->silent = v->state.silent;
    p->idle = 0;
    TQ_SET(&p->playing, NULL);
}

/* The next samples of a voice, at most a chunk and at most up to the end of a fade-out; how many. */
TQ_INLINE size_t tq_player_chunk(tq_player *p, tq_voice *v, int leaves, float *out, size_t count)
{
    tq_real chunk[TQ_CHUNK];
    size_t most = count < TQ_CHUNK ? count : TQ_CHUNK, n;
    if (leaves && most > (size_t)p->level)
        most = (size_t)p->level;
    if (v->lattice)
        tq_lattice_render_on(v->texture, v->lattice, &v->state, &v->filter, chunk, most);
    else
        tq_render_on(v->texture, &v->state, chunk, most);
    p->ago += (tq_real)most;
    for (n = 0; n < most && (leaves || p->level < p->fade); n++) {
        p->level += leaves ? -1 : 1;
        chunk[n] *= p->level < p->fade ? (tq_real)p->level * p->step : 1;
    }
    for (n = 0; n < most; n++)
        out[n] = (float)chunk[n];
    return most;
}

/* A reading of the hand, made `ago` samples before the next one; see tq_read. */
static inline void tq_player_read(tq_player *p, tq_real ago, tq_real speed, tq_real force)
{
    tq_voice *v = TQ_GET(&p->playing);
    if (v)
        tq_read(v->texture, &v->state, ago, speed, force);
    if (speed - speed == 0 && force - force == 0)
        p->ago = ago > 0 ? ago : 0, p->speed = speed, p->force = force;
}

/* The next `count` samples, of what is wanted, or zeros. */
static inline void tq_player_render(tq_player *p, float *out, size_t count)
{
    tq_voice *v = TQ_GET(&p->playing);
    int leaves = v && TQ_GET(&p->wanted) != v;
    while (count) {
        size_t done;
        if (!v) {
            v = tq_player_take(p);
            leaves = 0;
        }
        if (!v)
            break;
        done = tq_player_chunk(p, v, leaves, out, count);
        out += done, count -= done;
        if (p->level == 0) {
            tq_player_leave(p, v);
            v = NULL;
        }
    }
    TQ_FILL(out, 0, count * sizeof *out);
    p->idle += count;
    p->ago += (tq_real)count;
}

#endif
