/* Plays a script and writes what leaves; judges nothing.

   player_script play LIMITS FADE BLOCK SAMPLES EVENT...    single precision
   player_script render LIMITS VOICE GENERATION             double; for each sample three doubles on
                                                            standard input: whether the voice starts, how
                                                            long ago the hand was read (below 0: not now),
                                                            and its speed

   LIMITS are six arguments: peak, mean square, its share, longest, pause, silence. An EVENT is SAMPLE:A
   (or B or C: what is wanted), SAMPLE:a (the same, prepared anew unless it is in use), SAMPLE:-
   (silence) or SAMPLE:NUMBER (the hand's speed). Blocks end where events are, and where the hand is read: at
   every event, and every BEAT samples. */

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>

#include "player_textures.h"

enum { BEAT = 16 };

static tq_player player;
static tq_voice voices[TEXTURES];
static tq_real memory[TEXTURES][MEMORY], speed;

static void limit(char **arguments)
{
    int i;
    for (i = 0; i < TEXTURES; i++) {
        tq_texture *t = &textures[i];
        t->peak = atof(arguments[0]), t->mean_square = atof(arguments[1]);
        t->mean_share = atof(arguments[2]), t->longest = strtoull(arguments[3], NULL, 10);
        t->pause = strtoull(arguments[4], NULL, 10), t->silence = atof(arguments[5]);
    }
}

static void prepare(int i, int generation)
{
    tq_voice_start(&voices[i], &textures[i], memory[i], (uint64_t)(1000 * i + generation));
}

static void happen(const char *event)
{
    static int generations[TEXTURES];
    int i = toupper(*event) - 'A';
    if (isdigit((unsigned char)*event)) {
        speed = atof(event);
    } else if (*event == '-') {
        tq_player_want(&player, NULL);
    } else {
        if (islower((unsigned char)*event) && !tq_player_uses(&player, &voices[i]))
            prepare(i, ++generations[i]);
        tq_player_want(&player, &voices[i]);
    }
}

static void play(int fade, size_t block, size_t samples, char **events)
{
    float *out = malloc(block * sizeof *out);
    size_t n = 0, count, until;
    int i;
    for (i = 0; i < TEXTURES; i++)
        prepare(i, 0);
    tq_player_start(&player, fade);
    for (; n < samples; n += count) {
        int reads = n % BEAT == 0;
        for (; *events && strtoul(*events, NULL, 10) <= n; events++, reads = 1)
            happen(strchr(*events, ':') + 1);
        if (reads)
            tq_player_read(&player, 0, speed, FORCE);
        until = *events ? strtoul(*events, NULL, 10) : samples;
        if (until > n + BEAT - n % BEAT)
            until = n + BEAT - n % BEAT;
        count = until - n < block ? until - n : block;
        tq_player_render(&player, out, count);
        fwrite(out, sizeof *out, count, stdout);
    }
    free(out);
}

static void render(int voice, int generation)
{
    tq_state *state = &voices[voice].state;
    tq_real row[3], out;
    prepare(voice, generation);
    while (fread(row, sizeof row, 1, stdin) == 1) {
        if (row[0] > 0)
            memset(&state->hand, 0, sizeof state->hand);
        if (row[1] >= 0)
            tq_read(&textures[voice], state, row[1], row[2], FORCE);
        tq_render_on(&textures[voice], state, &out, 1);
        fwrite(&out, sizeof out, 1, stdout);
    }
}

int main(int count, char **arguments)
{
    if (count < 10)
        return 2;
    fill_textures();
    limit(arguments + 2);
    if (strcmp(arguments[1], "play") == 0)
        play(atoi(arguments[8]), strtoul(arguments[9], NULL, 10), strtoul(arguments[10], NULL, 10),
             arguments + 11);
    else
        render(atoi(arguments[8]), atoi(arguments[9]));
    return 0;
}
