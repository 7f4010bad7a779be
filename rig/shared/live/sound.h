/* The audio callback of a rig: the model under the hand as it is now, prepared signals, masking
   noise. docs/method/live.md#callback

   PortAudio calls tq_sound_callback with a tq_sound. The hand comes from shared memory; what is played
   is logged there. In the callback there is no Python, no allocation, no lock and no system call (the
   clock is a page that the kernel maps).

   One control thread prepares sources and selects the one to play, as in player.h, on which this is
   based. A source is a voice (a model) or a signal. Signals begin when no voice plays any more, and
   voices when no signal does: all changes pass through silence.

   A presentation is halted if the session's heartbeat in shared memory is missing: it fades, masking
   noise with it, and stays silent. Later requests are played.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_SOUND_H
#define TQ_SOUND_H

#include "player.h"
#include "weigh.h"

#include "live.h"

#define TQ_PIECE 256     /* samples that are rendered in one go */
#define TQ_FRESH 64      /* readings that a block takes in at most, the latest */
#define TQ_CLOCK_S 0.1   /* over which the times of blocks are smoothed */
#define TQ_PAUSE_S 0.05  /* a block so much out of time begins a new sequence of them */
#define TQ_NEXT 3        /* a given clock is so many blocks ahead of the card at most */
#define TQ_UNDERFLOWED 4 /* of PortAudio: paOutputUnderflow */

/* A voice with a number, by which the log knows it. */
typedef struct {
    tq_voice voice; /* first, so that both have one address */
    uint32_t presentation;
} tq_surface;

/* A signal in g that plays once; its samples must stay as they are while it is in use. */
typedef struct {
    const float *samples;
    size_t count, position;
    int level; /* steps of its fade: it begins as it is, and fades where it is stopped */
    uint32_t presentation;
} tq_signal;

struct tq_sound {
    tq_player player; /* what it shall play is said by the callback */
    TQ_SHARED(tq_surface *) surface_wanted; /* written by the control thread */
    TQ_SHARED(tq_signal *) signal_wanted;   /* written by the control thread */
    TQ_SHARED(tq_signal *) signal_playing;  /* written by the callback */
    uint64_t asked;          /* when, by tq_put_time; written by the control thread after the sources */
    uint64_t masking_wanted; /* RMS of the masking noise, in millionths of full scale */
    tq_live *live;
    int channels, vibration, masking; /* channels count from 0; masking is -1 for none */
    float scale;                      /* full scale per g */
    double rate_hz;
    double stale_s;                   /* a hand older than this counts as lifted off */
    double heartbeat_s;               /* the session looks as often at least while something plays */
    /* The callback's own. */
    double halted_s; /* when that was asked for which was halted last */
    int halted;      /* whether that is what is asked for now */
    double due_s;    /* when the next block is */
    tq_reading hand; /* the last that was taken in */
    uint64_t readings; /* how many were written up to that */
    tq_real masking_level;
    uint64_t masking_key, position, signal_samples;
    tq_weighting weighting;
    void (*follows)(double); /* NULL but where the clock is given: is told when the next call is due */
    double heard_s;          /* how far the card has come, by that clock */
};
typedef struct tq_sound tq_sound;

/* --- The control thread ------------------------------------------------------------------------ */

static inline size_t tq_sound_size(void)
{
    return sizeof(tq_sound);
}

/* Silence. Before the callback is first called. Fades take `fade` samples. */
static inline void tq_sound_start(tq_sound *s, tq_live *live, double rate_hz, int fade, int channels,
                                  int vibration, int masking, float scale, double stale_s,
                                  double heartbeat_s, uint64_t masking_key)
{
    TQ_FILL(s, 0, sizeof *s);
    tq_player_start(&s->player, fade);
    s->live = live, s->rate_hz = rate_hz;
    s->hand.flags = TQ_GONE, s->due_s = -1;
    s->channels = channels, s->vibration = vibration, s->masking = masking;
    s->scale = scale, s->stale_s = stale_s, s->heartbeat_s = heartbeat_s;
    s->halted_s = -1;
    s->masking_key = masking_key;
}

/* How vibration is weighted for the exposure of the hand: sections in series, 5 numbers each. Before the
   callback is first called; without it nothing is weighted, and the sum is 0. */
static inline void tq_sound_weigh(tq_sound *s, const double *sections, int count)
{
    memcpy(s->weighting.section, sections, (size_t)count * sizeof s->weighting.section[0]);
    s->weighting.count = count;
}

/* Prepares a surface that is not in use; see tq_start. */
static inline void tq_surface_start(tq_surface *u, const tq_texture *t, tq_real *memory, uint64_t key,
                                    uint32_t presentation)
{
    tq_voice_start(&u->voice, t, memory, key);
    u->presentation = presentation;
}

/* The same of an all-pole model; see tq_lattice_start. */
static inline void tq_surface_start_lattice(tq_surface *u, const tq_texture *t, const tq_lattice *l,
                                            tq_real *memory, uint64_t key, uint32_t presentation)
{
    tq_voice_start_lattice(&u->voice, t, l, memory, key);
    u->presentation = presentation;
}

/* Prepares a signal that is not in use. */
static inline void tq_signal_start(tq_signal *c, const float *samples, size_t count,
                                   uint32_t presentation)
{
    c->samples = samples, c->count = count, c->position = 0;
    c->level = 0, c->presentation = presentation;
}

/* What shall play from now on: a surface, a signal, or silence where both are NULL. It is asked for now
   (tq_now), and at no time twice. */
static inline void tq_sound_want(tq_sound *s, tq_surface *surface, tq_signal *signal, double asked_s)
{
    TQ_SET(&s->surface_wanted, surface);
    TQ_SET(&s->signal_wanted, signal);
    tq_put_time(&s->asked, asked_s); /* last: what was halted before must not begin again */
}

/* The RMS of the masking noise from now on, in millionths of full scale; 0 for none. */
static inline void tq_sound_mask(tq_sound *s, uint64_t millionths)
{
    __atomic_store_n(&s->masking_wanted, millionths, __ATOMIC_RELAXED);
}

/* Whether the callback uses a source or may yet; once it does not, it may be freed or prepared again.
   It takes sources as tq_player_uses says. */
static inline int tq_sound_uses_surface(tq_sound *s, tq_surface *u)
{
    return TQ_GET(&s->surface_wanted) == u || tq_player_uses(&s->player, &u->voice);
}

static inline int tq_sound_uses_signal(tq_sound *s, tq_signal *c)
{
    return TQ_GET(&s->signal_wanted) == c || TQ_GET(&s->signal_playing) == c;
}

/* Whether anything plays. */
static inline int tq_sound_plays(tq_sound *s)
{
    return tq_player_playing(&s->player) || TQ_GET(&s->signal_playing);
}

/* Has a given clock wait for the callback. Before it is first called. */
static inline void tq_sound_follow(tq_sound *s)
{
    s->follows = tq_called;
}

/* --- The callback ------------------------------------------------------------------------------ */

/* The time of a block of so many seconds that was called now. A callback comes late by a varying time, or
   several come at once, but samples leave evenly: times are smoothed, so that the hand moves evenly, too. */
TQ_INLINE double tq_block_time(tq_sound *s, double now_s, double seconds)
{
    double off = now_s - s->due_s, time_s;
    if (!(off < TQ_PAUSE_S && off > -TQ_PAUSE_S))
        s->due_s = now_s;
    else
        s->due_s += off * (seconds < TQ_CLOCK_S ? seconds / TQ_CLOCK_S : 1);
    time_s = s->due_s;
    s->due_s += seconds;
    return time_s;
}

/* Takes in what was read of the hand up to the time of a block; what was read later is for the next. */
TQ_INLINE void tq_hand_take(tq_sound *s, tq_block *block)
{
    tq_reading rows[TQ_FRESH];
    uint64_t written = tq_readings_written(s->live), first;
    uint64_t from = written - s->readings > TQ_FRESH ? written - TQ_FRESH : s->readings;
    size_t count = tq_readings(s->live, from, rows, TQ_FRESH, &first), n;
    for (n = 0; n < count && rows[n].time_s <= block->hand_s; n++) {
        s->readings = first + n + 1;
        s->hand = rows[n];
        if (s->hand.flags & TQ_GONE)
            continue;
        tq_player_read(&s->player, (tq_real)((block->hand_s - s->hand.time_s) * s->rate_hz),
                       s->hand.speed_mm_s, s->hand.force_n);
    }
    block->readings = s->readings, block->taken = (uint32_t)n;
    /* A hand that is gone, or too old, counts as lifted off. */
    if (s->hand.flags & TQ_GONE || !(block->hand_s - s->hand.time_s <= s->stale_s))
        block->flags |= TQ_STALE;
    else
        block->speed_mm_s = s->hand.speed_mm_s, block->force_n = s->hand.force_n;
    if (!(block->force_n > 0)) /* nobody needs to say again that there is no contact */
        tq_player_read(&s->player, 0, 0, 0);
}

/* Halts what plays where the session has neither asked for it nor looked after it for too long. It stays
   halted, also when the session comes back: only what is asked for later plays. */
TQ_INLINE void tq_sound_mind(tq_sound *s, double now_s)
{
    double asked_s = tq_take_time(&s->asked), beat_s = tq_take_time(&s->live->heartbeat);
    if (tq_sound_plays(s) && !(now_s - beat_s <= s->heartbeat_s)
        && !(now_s - asked_s <= s->heartbeat_s))
        s->halted_s = asked_s;
    s->halted = s->halted_s == asked_s;
}

/* Sets what the player has to play, which is silence while a signal plays. Once per block: a voice that
   began amid one could not be rendered again from the log, which knows no smaller step. */
TQ_INLINE void tq_sound_tell(tq_sound *s)
{
    tq_surface *u = s->halted || TQ_GET(&s->signal_playing) ? NULL : TQ_GET(&s->surface_wanted);
    tq_player_want(&s->player, (tq_voice *)u);
    if (u && TQ_GET(&s->surface_wanted) != u) /* perhaps freed before it was seen to be wanted */
        tq_player_want(&s->player, NULL);
}

/* The signal that plays, or begins now; NULL while a voice plays. */
TQ_INLINE tq_signal *tq_signal_now(tq_sound *s)
{
    tq_signal *c = TQ_GET(&s->signal_playing);
    if (c || tq_player_playing(&s->player))
        return c;
    c = s->halted ? NULL : TQ_GET(&s->signal_wanted);
    if (!c)
        return NULL;
    TQ_SET(&s->signal_playing, c);
    if (TQ_GET(&s->signal_wanted) != c || c->position == c->count) { /* freed, or over */
        TQ_SET(&s->signal_playing, NULL);
        return NULL;
    }
    c->level = s->player.fade;
    return c;
}

/* The next samples of a signal, into zeros: up to its end, or to that of its fade. */
TQ_INLINE void tq_signal_render(tq_sound *s, tq_signal *c, float *out, size_t count)
{
    int leaves = s->halted || TQ_GET(&s->signal_wanted) != c;
    size_t n = 0;
    for (; n < count && c->position < c->count && c->level > 0; n++) {
        c->level -= leaves;
        out[n] = c->samples[c->position++];
        if (c->level < s->player.fade)
            out[n] *= (float)((tq_real)c->level * s->player.step);
    }
    s->signal_samples += n;
    if (c->position == c->count || c->level == 0) {
        c->position = c->count; /* over: the same signal does not begin again */
        /* For the limits of the voice that follows: as if the mean square were at its limit now. */
        s->player.mean_square = (tq_real)1e30;
        s->player.sounding += s->signal_samples;
        s->player.silent = s->player.idle = 0;
        s->signal_samples = 0;
        TQ_SET(&s->signal_playing, NULL);
    }
}

/* The next samples of the masking noise, which reaches its level within a fade. */
TQ_INLINE void tq_masking_render(tq_sound *s, float *out, size_t count)
{
    uint64_t millionths = s->halted ? 0 : __atomic_load_n(&s->masking_wanted, __ATOMIC_RELAXED);
    tq_real wanted = (tq_real)1e-6 * (tq_real)millionths;
    size_t n;
    for (n = 0; n < count; n++) {
        s->masking_level += tq_within(wanted - s->masking_level, -s->player.step, s->player.step);
        if (s->masking_level != 0) {
            tq_real noise = s->masking_level * tq_noise(s->masking_key, s->position + n);
            out[n * (size_t)s->channels] = (float)tq_within(noise, -1, 1);
        }
    }
}

/* The number of the surface that plays, 0 for none. */
TQ_INLINE uint32_t tq_surface_now(tq_sound *s)
{
    const tq_surface *u = (const tq_surface *)tq_player_playing(&s->player);
    return u ? u->presentation : 0;
}

/* The next samples, at most a piece; `block` collects what the log says of them. */
TQ_INLINE void tq_piece_render(tq_sound *s, tq_block *block, float *out, size_t count)
{
    float piece[TQ_PIECE];
    tq_signal *signal;
    uint32_t before = tq_surface_now(s), after;
    size_t n;
    tq_player_render(&s->player, piece, count);
    after = tq_surface_now(s);
    if (before || after)
        block->presentation = after ? after : before;
    signal = tq_signal_now(s);
    if (signal) {
        block->presentation = signal->presentation;
        tq_signal_render(s, signal, piece, count);
    }
    for (n = 0; n < count; n++) {
        float size = piece[n] < 0 ? -piece[n] : piece[n];
        double weighted = tq_weigh(&s->weighting, (tq_real)piece[n]);
        block->weighted_square_sum_g2 += weighted * weighted;
        block->peak_g = size > block->peak_g ? size : block->peak_g;
        block->square_sum_g2 += (double)piece[n] * (double)piece[n];
        /* A peak limit at full scale may be rounded to above it, which a card may take for its
           opposite. */
        out[n * (size_t)s->channels + (size_t)s->vibration]
            = (float)tq_within(piece[n] * s->scale, -1, 1);
    }
    if (s->masking >= 0)
        tq_masking_render(s, out + s->masking, count);
    s->position += count;
}

/* A block that was called now, interleaved; what the log says of it. */
static tq_block tq_sound_block(tq_sound *s, double now_s, float *out, size_t frames)
{
    tq_block block;
    TQ_FILL(&block, 0, sizeof block);
    block.time_s = now_s, block.hand_s = tq_block_time(s, now_s, (double)frames / s->rate_hz);
    block.position = s->position, block.frames = (uint32_t)frames;
    tq_hand_take(s, &block);
    tq_sound_mind(s, now_s);
    tq_sound_tell(s);
    if (s->halted)
        block.flags |= TQ_NO_HEARTBEAT;
    TQ_FILL(out, 0, frames * (size_t)s->channels * sizeof *out);
    while (frames) {
        size_t count = frames < TQ_PIECE ? frames : TQ_PIECE;
        tq_piece_render(s, &block, out, count);
        out += count * (size_t)s->channels;
        frames -= count;
    }
    return block;
}

/* For PortAudio (PaStreamCallback): 32-bit floats; `user` is the tq_sound. */
static int tq_sound_callback(const void *in, void *out, unsigned long frames, const void *times,
                             unsigned long flags, void *user)
{
    tq_sound *s = (tq_sound *)user;
    const double *moments = (const double *)times; /* of input, of the call, of output */
    double latency_s = moments ? moments[2] - moments[1] : 0;
    tq_block block = tq_sound_block(s, tq_now(), (float *)out, frames);
    (void)in;
    if (s->follows) {
        double block_s = (double)frames / s->rate_hz;
        s->heard_s += block_s;
        if (s->heard_s > block.time_s || s->heard_s == block_s) /* a card may be ahead of the clock */
            s->heard_s = block.time_s;
        s->follows(s->heard_s + TQ_NEXT * block_s);
    }
    block.dac_time_s = block.time_s + (latency_s > 0 && latency_s < 10 ? latency_s : 0);
    if (flags & TQ_UNDERFLOWED)
        block.flags |= TQ_UNDERFLOW;
    block.seconds = (float)(tq_now() - block.time_s);
    tq_write_block(s->live, &block);
    return 0;
}

#endif
