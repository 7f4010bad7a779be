/* A control thread wants voices at random, and frees and makes them as soon as it may, while a callback
   renders; prints what was seen, one "name value" a line, and judges nothing. Voices are overwritten
   before they are freed, so that who touches one afterwards crashes or is heard.

   With INTERLEAVED there is one thread: the control thread acts within the callback, where that
   reads or writes a shared pointer. So come about the interleavings that are rare in time. */

#ifdef INTERLEAVED
static void meanwhile(void);
#define TQ_SHARED(type) type
#define TQ_GET(place) (meanwhile(), *(place))
#define TQ_SET(place, value) (meanwhile(), *(place) = (value), meanwhile())
#else
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#endif

#include <stdio.h>
#include <stdlib.h>

#include "player_textures.h"

enum { SLOTS = 4, KEYS = 4, FADE = 25, SPEED = 100, LONGEST_BLOCK = 256, SEEN = 10 };

typedef struct {
    tq_voice voice;
    tq_texture texture;
    tq_real memory[MEMORY];
} slot;

static tq_player player;
static slot *slots[SLOTS];
static long freed;

/* --- What a voice does by itself --------------------------------------------------------------- */

static double largest, steepest;

static void listen(long samples)
{
    static tq_voice voice;
    static tq_real memory[MEMORY];
    int i, key;
    long n;
    for (i = 0; i < TEXTURES; i++)
        for (key = 0; key < KEYS; key++) {
            tq_real last = 0, y;
            tq_voice_start(&voice, &textures[i], memory, (uint64_t)key);
            for (n = 0; n < samples; n++, last = y) {
                tq_render_held(&textures[i], &voice.state, SPEED, FORCE, &y, 1);
                largest = fmax(largest, fabs(y));
                steepest = fmax(steepest, n ? fabs(y - last) : 0);
            }
        }
}

/* --- The control thread ------------------------------------------------------------------------ */

static uint64_t below(uint64_t *seed, uint64_t count)
{
    *seed ^= *seed << 13, *seed ^= *seed >> 7, *seed ^= *seed << 17;
    return (*seed >> 11) % count;
}

static void drop(int i)
{
    memset(slots[i], 0xFF, sizeof *slots[i]);
    free(slots[i]);
    slots[i] = NULL;
    freed++;
}

static void make(int i, uint64_t *seed)
{
    slots[i] = (slot *)malloc(sizeof *slots[i]);
    slots[i]->texture = textures[below(seed, TEXTURES)];
    tq_voice_start(&slots[i]->voice, &slots[i]->texture, slots[i]->memory, below(seed, KEYS));
}

static void act(uint64_t *seed)
{
    int i = (int)below(seed, SLOTS);
    if (below(seed, 4) == 0) {
        tq_player_want(&player, NULL);
        return;
    }
    if (slots[i] && below(seed, 2) && !tq_player_uses(&player, &slots[i]->voice))
        drop(i);
    if (!slots[i] && below(seed, 8) == 0)
        return;
    if (!slots[i])
        make(i, seed);
    tq_player_want(&player, &slots[i]->voice);
}

/* --- The callback ------------------------------------------------------------------------------ */

static long samples, not_finite, silences, plateaus, not_silent;
static double step;

static void block(size_t count)
{
    static float last;
    float out[LONGEST_BLOCK];
    size_t n;
    int full = player.level == FADE;
    tq_player_read(&player, 0, SPEED, FORCE);
    tq_player_render(&player, out, count);
    for (n = 0; n < count; n++) {
        not_finite += !(out[n] - out[n] == 0);
        step = fmax(step, fabs((double)out[n] - (double)last));
        last = out[n];
    }
    samples += (long)count;
    silences += player.level == 0 && last == 0;
    plateaus += full && player.level == FADE;
}

#ifdef INTERLEAVED

static void meanwhile(void)
{
    static int acting;
    static uint64_t seed = 1;
    int often = below(&seed, 16) ? 0 : 1 + (int)below(&seed, 4);
    if (acting)
        return;
    acting = 1;
    while (often--)
        act(&seed);
    acting = 0;
}

static void play(long most)
{
    uint64_t seed = 2;
    while (samples < most)
        block(1 + below(&seed, 12));
}

#else

static atomic_long acts, blocks;
static atomic_int over;

/* Threads on busy cores may act long in step, so that a voice is seldom caught in a pause. */
static int goes_on(long most)
{
    int seen = silences > SEEN && plateaus > SEEN;
    return samples < most || (!seen && samples < 20 * most);
}

/* The control thread acts two to four times a block, on average, however the threads are scheduled. */
static void *control(void *nothing)
{
    uint64_t seed = 1;
    while (!atomic_load(&over)) {
        volatile uint64_t wait = below(&seed, UINT64_C(1) << below(&seed, 16));
        while (wait)
            wait--;
        if (atomic_load(&acts) > 4 * atomic_load(&blocks) + 16) {
            sched_yield();
            continue;
        }
        act(&seed);
        atomic_fetch_add(&acts, 1);
    }
    return nothing;
}

static void stop(void)
{
    float out[FADE];
    int n;
    tq_player_want(&player, NULL);
    block(FADE);
    tq_player_render(&player, out, FADE);
    for (n = 0; n < FADE; n++)
        not_silent += out[n] != 0;
}

static void play(long most)
{
    uint64_t seed = 2;
    pthread_t thread;
    pthread_create(&thread, NULL, control, NULL);
    for (; goes_on(most); atomic_fetch_add(&blocks, 1)) {
        while (atomic_load(&acts) < 2 * atomic_load(&blocks))
            sched_yield();
        block(1 + below(&seed, LONGEST_BLOCK));
    }
    atomic_store(&over, 1);
    pthread_join(thread, NULL);
    stop();
}

#endif

int main(int count, char **arguments)
{
    long most = count > 1 ? atol(arguments[1]) : 0;
    int i;
    fill_textures();
    listen(most + LONGEST_BLOCK);
    tq_player_start(&player, FADE);
    play(most);
    for (i = 0; i < SLOTS; i++)
        free(slots[i]);
    printf("samples %ld\nnot_finite %ld\nsilences %ld\nplateaus %ld\nfreed %ld\nnot_silent %ld\n",
           samples, not_finite, silences, plateaus, freed, not_silent);
    printf("step %g\nsteepest %g\nlargest %g\nfade %d\n", step, steepest, largest, FADE);
    return 0;
}
