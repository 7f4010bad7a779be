/* Judges the firmware from outside, in virtual time, over its wire.

   walks paths DEPTH         every sequence of so many inputs; prints those that reach force unasked
   walks limits SEED TICKS   random hand, faults and commands; prints what was broken
   walks damaged SEED COUNT  frames damaged at random, and a good one after each
   walks silences COUNT      a host that falls silent; ticks from its last frame to no current
   walks extremes SEED TICKS any counters from any count, mechanics that run away; what the sanitizers find
   walks frames              frames as lines of "kind sequence nonce body" in, their bytes out, and back */

#include "virtual.h"

#include <limits.h>
#include <stdio.h>

static unsigned long long state_of_chance;

static double chance(void)
{
    state_of_chance = state_of_chance * 6364136223846793005u + 1442695040888963407u;
    return (double)(state_of_chance >> 11) / 9007199254740992.0;
}

static unsigned below(unsigned most)
{
    return (unsigned)(chance() * most);
}

/* A frame of the host, with the numbers that the device expects. */
static size_t frame(const tq_virtual *v, uint8_t kind, const uint8_t *body, uint8_t length, uint8_t *out)
{
    int hello = kind == TQ_HELLO;
    return tq_stuffed(kind, hello ? 0 : v->device.expected, hello ? 0 : v->device.nonce, body, length, out);
}

static void say(tq_virtual *v, uint8_t kind, const uint8_t *body, uint8_t length)
{
    uint8_t out[TQ_MOST_STUFFED];
    tq_virtual_receive(v, out, frame(v, kind, body, length, out));
    v->waiting = 0;
}

static void command(tq_virtual *v, uint8_t which)
{
    uint8_t body[2] = { TQD_COMMAND, 0 };
    body[1] = which;
    say(v, TQ_WRITE, body, 2);
}

static void beat(tq_virtual *v)
{
    static const uint8_t body[5] = { TQD_HEARTBEAT, 1, 0, 0, 0 };
    say(v, TQ_WRITE, body, 5);
}

static int pulls(const tq_virtual *v)
{
    return v->simulated.current_a[0] != 0 || v->simulated.current_a[1] != 0;
}

/* --- Every path ------------------------------------------------------------------------------------ */

enum { HELLO, HOME, ARM, SHOW, HIDE, CLEAR, STOP, TICKS, SILENCE, HANG, UNREADABLE, RESTART, INPUTS };

/* What was asked for, in this order, since the device last let go or started. */
enum { NOTHING, HOMED, ARMED, SHOWN };

static long wrong, reached, paths;

static void input(tq_virtual *v, int which)
{
    static const uint8_t asked[INPUTS] = { 0, TQD_COMMAND_HOME, TQD_COMMAND_ARM, TQD_COMMAND_SHOW,
                                           TQD_COMMAND_HIDE, TQD_COMMAND_CLEAR, TQD_COMMAND_STOP, 0, 0, 0,
                                           0, 0 };
    int n;
    switch (which) {
    case HELLO: say(v, TQ_HELLO, NULL, 0); break;
    case TICKS: tq_virtual_step(v, 150); beat(v); break;
    case SILENCE: tq_virtual_step(v, 700); break;
    case HANG:
        for (n = 0; n < 28; n++) {
            static const uint8_t body[1] = { TQD_STATE };
            say(v, TQ_READ, body, 1);
            tq_virtual_step(v, 200);
        }
        break;
    case UNREADABLE: v->simulated.offset[0] = (uint16_t)(v->simulated.offset[0] + 326); tq_virtual_step(v, 200); break;
    case RESTART: tq_virtual_start(v, 7, 0); tq_virtual_step(v, 2); break;
    default: command(v, asked[which]); tq_virtual_step(v, 2); break;
    }
    v->waiting = 0;
}

static void walk(const tq_virtual *from, int depth, int asked)
{
    int which;
    tq_virtual *v;
    if (!depth)
        return;
    v = (tq_virtual *)malloc(sizeof *v);
    for (which = 0; which < INPUTS; which++) {
        int before = from->device.force.state, now, next = asked;
        memcpy(v, from, sizeof *v);
        v->device.board.context = v, v->device.hand.scene = &v->device.scene;
        input(v, which);
        paths++;
        now = v->device.force.state;
        if (which == RESTART || which == HELLO)
            next = which == RESTART ? NOTHING : asked;
        else if (which == HOME && v->device.homed && now != TQ_ARMED && now != TQ_RUNNING)
            next = HOMED;
        else if (which == ARM && before == TQ_IDLE && now == TQ_ARMED)
            next = asked >= HOMED ? ARMED : asked;
        else if (which == SHOW && before == TQ_ARMED && now == TQ_RUNNING)
            next = asked >= ARMED ? SHOWN : asked;
        if ((now == TQ_ARMED || now == TQ_RUNNING) && before != TQ_ARMED && before != TQ_RUNNING
            && !(which == ARM && now == TQ_ARMED && asked >= HOMED))
            wrong++; /* armed without being asked to, or without a home */
        if (now == TQ_RUNNING && before != TQ_RUNNING && which != SHOW)
            wrong++;
        if (before == TQ_FAULT && now != TQ_FAULT && which != CLEAR && which != RESTART)
            wrong++;
        if (now == TQ_RUNNING && next < SHOWN)
            wrong++;
        if ((now == TQ_BOOT || now == TQ_IDLE || now == TQ_FAULT) && pulls(v))
            wrong++;
        if ((which == SILENCE || which == HANG || which == UNREADABLE || which == RESTART || which == HELLO)
            && (now == TQ_ARMED || now == TQ_RUNNING))
            wrong++;
        reached += now == TQ_RUNNING;
        if (now == TQ_FAULT || now == TQ_RELEASING)
            next = next > HOMED ? HOMED : next;
        walk(v, depth - 1, next);
    }
    free(v);
}

static int every_path(int depth)
{
    tq_virtual *v = (tq_virtual *)malloc(sizeof *v);
    tq_virtual_start(v, 7, 0);
    tq_virtual_step(v, 2);
    walk(v, depth, NOTHING);
    free(v);
    printf("paths %ld running %ld wrong %ld\n", paths, reached, wrong);
    return wrong != 0;
}

/* --- Limits ---------------------------------------------------------------------------------------- */

static void write_float(tq_virtual *v, uint8_t address, float value)
{
    uint8_t body[5];
    body[0] = address;
    memcpy(body + 1, &value, 4);
    say(v, TQ_WRITE, body, 5);
}

static void write_pair(tq_virtual *v, uint8_t address, float first, float second)
{
    uint8_t body[9];
    body[0] = address;
    memcpy(body + 1, &first, 4), memcpy(body + 5, &second, 4);
    say(v, TQ_WRITE, body, 9);
}

static long broken_limits(const tq_virtual *v, double before_n, const tq_number heat_before[TQ_MOTORS],
                          double slack)
{
    const tq_device *d = &v->device;
    const tqd_values *r = &d->values;
    double force = d->force.normal_n, speed = fabs(d->force.velocity_mm_s[2]);
    int state = d->force.state, allowed = state == TQ_ARMED || state == TQ_RUNNING || state == TQ_RELEASING, n;
    long broken = 0;
    broken += !(fabs(force) <= r->force_limit * (1 + 1e-6));
    broken += (state == TQ_ARMED || state == TQ_RUNNING)
              && !(fabs(force - before_n) <= r->force_slew / TQ_TICK_HZ * (1 + 1e-6) || fabs(force) < fabs(before_n));
    broken += (state == TQ_ARMED || state == TQ_RUNNING) && !(fabs(force) * speed <= 1e3 * r->power_limit * (1 + 1e-6));
    broken += !allowed && force != 0;
    for (n = 0; n < TQ_MOTORS; n++) {
        double current = d->current_a[n];
        broken += !(current >= 0 && current <= r->current_limit * (1 + 1e-6));
        broken += !(current * d->board.cables.n_per_a <= r->tension_range[1] * (1 + 1e-6));
        /* A limit may have been lowered below what it was; then it grows no more. */
        broken += !(d->heat_a2_s[n] <= r->heat_limit + slack || d->heat_a2_s[n] <= heat_before[n]);
        broken += !allowed && current != 0;
    }
    broken += !(fabsf(r->vibration) <= r->vibration_limit);
    return broken;
}

static int limits(unsigned long long seed, long ticks)
{
    tq_virtual *v = (tq_virtual *)malloc(sizeof *v);
    long n, broken = 0, ran = 0, clipped = 0, seen, causes = 0;
    double largest_n = 0, largest_heat = 0;
    uint32_t cause_seen = 0;
    state_of_chance = seed;
    tq_virtual_start(v, 1, 0);
    say(v, TQ_HELLO, NULL, 0);
    for (n = 0; n < ticks; n++) {
        double draw = chance(), before = v->device.force.normal_n, over;
        tq_number heat[TQ_MOTORS];
        memcpy(heat, v->device.heat_a2_s, sizeof heat);
        if (n % 200 == 0)
            draw < 0.98 ? beat(v) : (void)0;
        if (draw < 0.004) {
            static const uint8_t asked[8] = { TQD_COMMAND_HOME, TQD_COMMAND_ARM, TQD_COMMAND_ARM, TQD_COMMAND_SHOW,
                                              TQD_COMMAND_SHOW, TQD_COMMAND_HIDE, TQD_COMMAND_CLEAR, TQD_COMMAND_CLEAR };
            command(v, asked[below(8)]);
        } else if (draw < 0.00401) {
            command(v, TQD_COMMAND_STOP);
        } else if (draw < 0.005) {
            write_float(v, TQD_FORCE_LIMIT, (float)(0.1 + 20 * chance()));
            write_float(v, TQD_CURRENT_LIMIT, (float)(0.1 + 9 * chance()));
            write_float(v, TQD_HEAT_LIMIT, (float)(0.1 + chance()));
            write_float(v, TQD_POWER_LIMIT, (float)(0.01 + 20 * chance() * chance()));
            write_float(v, TQD_FORCE_SLEW, (float)(100 + 9000 * chance()));
            write_pair(v, TQD_TENSION_RANGE, (float)chance(), (float)(1 + 90 * chance()));
        } else if (draw < 0.0051) {
            v->device.simulate = (int)below(10);
        } else if (draw < 0.0054) {
            v->device.simulate = 0;
        } else if (draw < 0.0056) {
            v->simulated.mechanics.vz_mm_s -= 300 * (chance() - 0.3);
            v->simulated.mechanics.vx_mm_s += 400 * (chance() - 0.5);
        } else if (draw < 0.0058) {
            v->device.values.stroke[0] = (float)(150 * chance()), v->device.values.stroke[2] = (float)(30 * chance());
        }
        if (!v->device.greeted)
            say(v, TQ_HELLO, NULL, 0);
        tq_virtual_step(v, 1);
        v->waiting = 0;
        /* Within one tick the heat may pass its limit by what that tick adds. */
        over = v->device.values.current_limit;
        broken += broken_limits(v, before, heat, over * over / TQ_TICK_HZ + 1e-6);
        ran += v->device.force.state == TQ_RUNNING, clipped += v->device.clipped;
        if (v->device.force.normal_n > largest_n)
            largest_n = v->device.force.normal_n;
        for (seen = 0; seen < TQ_MOTORS; seen++) {
            over = v->device.heat_a2_s[seen] / v->device.values.heat_limit;
            largest_heat = over > largest_heat ? over : largest_heat;
        }
        if (v->device.force.cause && !(cause_seen >> v->device.force.cause & 1))
            cause_seen |= 1u << v->device.force.cause, causes++;
    }
    printf("ticks %ld running %ld clipped %ld causes %ld largest_n %.3f heat %.3f broken %ld\n", ticks, ran, clipped,
           causes, largest_n, largest_heat, broken);
    free(v);
    return broken != 0;
}

/* --- Damaged frames -------------------------------------------------------------------------------- */

static size_t draw_frame(const tq_virtual *v, uint8_t *out)
{
    uint8_t body[TQ_MOST_BODY];
    unsigned n, length;
    switch (below(6)) {
    case 0: return frame(v, TQ_HELLO, NULL, 0, out);
    case 1: body[0] = TQD_STATE; return frame(v, TQ_READ, body, 1, out);
    case 2: body[0] = TQD_COMMAND, body[1] = TQD_COMMAND_HOME; return frame(v, TQ_WRITE, body, 2, out);
    case 3:
        body[0] = TQD_WALL;
        for (n = 0; n < 5; n++) {
            float value = (float)(1 + chance());
            memcpy(body + 1 + 4 * n, &value, 4);
        }
        return frame(v, TQ_WRITE, body, 21, out);
    default:
        length = 6 + below(TQ_MOST_BODY - 6);
        body[0] = 1, memcpy(body + 1, &v->device.upload_count, 4);
        for (n = 5; n < length; n++)
            body[n] = (uint8_t)below(256);
        return frame(v, TQ_UPLOAD, body, (uint8_t)length, out);
    }
}

/* One to four changes: a bit, a byte, one more, one less, the end cut off. */
static size_t damage(uint8_t *bytes, size_t count)
{
    unsigned changes = 1 + below(4);
    for (; changes && count > 1; changes--) {
        size_t at = below((unsigned)count);
        switch (below(5)) {
        case 0: bytes[at] = (uint8_t)(bytes[at] ^ 1u << below(8)); break;
        case 1: bytes[at] = (uint8_t)below(256); break;
        case 2: memmove(bytes + at + 1, bytes + at, count - at), bytes[at] = (uint8_t)below(256), count++; break;
        case 3: memmove(bytes + at, bytes + at + 1, count - at - 1), count--; break;
        default: if (below(8) == 0) count = at + 1; break;
        }
    }
    return count;
}

static int damaged(unsigned long long seed, long count)
{
    static tqd_values before;
    tq_virtual *v = (tq_virtual *)malloc(sizeof *v);
    uint8_t *upload = (uint8_t *)malloc(TQ_CAPACITY * sizeof(tq_real));
    long n, undamaged = 0, passed = 0, applied = 0, lost = 0, uploads = 0;
    state_of_chance = seed;
    tq_virtual_start(v, 3, 0);
    tq_virtual_step(v, 2);
    say(v, TQ_HELLO, NULL, 0);
    for (n = 0; n < count; n++) {
        uint8_t good[TQ_MOST_STUFFED], bad[TQ_MOST_STUFFED + 8], next[TQ_MOST_STUFFED];
        static const uint8_t who[1] = { TQD_WHO_AM_I };
        static const uint8_t begin[5] = { 0, 0, 0x20, 0, 0 };
        size_t size, whole, k;
        uint32_t frames, upload_count;
        int same;
        if (v->device.slot < 0 || v->device.upload_count > 4096)
            say(v, TQ_UPLOAD, begin, 5);
        whole = draw_frame(v, good);
        memcpy(bad, good, whole);
        size = damage(bad, whole);
        /* What still holds the frame whole between two zeros is not damaged. */
        same = 0;
        for (k = 0; k + whole <= size + 2; k++) {
            size_t inner = whole - 2;
            if (k + inner <= size && !memcmp(bad + k, good + 1, inner) && (k == 0 || bad[k - 1] == 0)
                && (k + inner == size || bad[k + inner] == 0))
                same = 1;
        }
        if (same) {
            undamaged++;
            continue;
        }
        uploads += (v->device.slot >= 0);
        before = v->device.values, frames = v->device.values.frames_good, upload_count = v->device.upload_count;
        memcpy(upload, v->device.uploads[v->device.slot].bytes, TQ_CAPACITY * sizeof(tq_real));
        tq_virtual_receive(v, bad, size);
        v->waiting = 0;
        passed += v->device.values.frames_good != frames;
        before.frames_good = v->device.values.frames_good, before.frames_refused = v->device.values.frames_refused;
        applied += memcmp(&before, &v->device.values, sizeof before) || v->device.upload_count != upload_count
                   || v->device.slot < 0
                   || memcmp(upload, v->device.uploads[v->device.slot].bytes, TQ_CAPACITY * sizeof(tq_real));
        tq_virtual_receive(v, next, frame(v, TQ_READ, who, 1, next));
        lost += v->device.values.frames_good != before.frames_good + 1;
        v->waiting = 0;
    }
    printf("damaged %ld still_whole %ld passed %ld applied %ld next_lost %ld uploading %ld\n", count - undamaged,
           undamaged, passed, applied, lost, uploads);
    free(v), free(upload);
    return applied || lost;
}

/* --- Silence --------------------------------------------------------------------------------------- */

static int silences(long count)
{
    tq_virtual *v = (tq_virtual *)malloc(sizeof *v);
    long n, shortest = 1000000, longest = 0;
    state_of_chance = 11;
    for (n = 0; n < count; n++) {
        unsigned k, turns = 60 + below(60);
        long took;
        tq_virtual_start(v, (uint32_t)n, 0);
        tq_virtual_step(v, 1 + below(20));
        say(v, TQ_HELLO, NULL, 0), command(v, TQD_COMMAND_HOME), command(v, TQD_COMMAND_ARM);
        command(v, TQD_COMMAND_SHOW);
        for (k = 0; k < turns; k++)
            tq_virtual_step(v, 20 + below(200)), beat(v);
        tq_virtual_step(v, 1000);
        took = (long)(v->device.values.zero_tick - v->device.values.heard_tick);
        if (v->device.force.state != TQ_FAULT || v->device.force.cause != TQD_CAUSE_LINK || pulls(v))
            took = 1000000;
        shortest = took < shortest ? took : shortest, longest = took > longest ? took : longest;
    }
    printf("silences %ld shortest %ld longest %ld\n", count, shortest, longest);
    free(v);
    return 0;
}

/* --- Extremes -------------------------------------------------------------------------------------- */

static double extreme(void)
{
    static const double values[8] = { NAN, INFINITY, -INFINITY, 1e300, -1e300, 1e10, -1e10, 0 };
    return values[below(8)];
}

/* A board of which anything may be the case. */
static void spoil(tq_virtual *v)
{
    tq_mechanics *m = &v->simulated.mechanics;
    int n = (int)below(2);
    switch (below(8)) {
    case 0: v->device.counted[n] = below(2) ? INT32_MAX : INT32_MIN; break;
    case 1: v->device.still[n] = below(2) ? INT32_MAX : INT32_MIN; break;
    case 2: v->device.felt[n].counted = below(2) ? INT32_MAX : INT32_MIN, v->device.felt[n].slack = INT_MAX; break;
    case 3: m->paid_mm[n] = extreme(); break;
    case 4: m->x_mm = extreme(), m->z_mm = extreme(); break;
    case 5: m->vx_mm_s = extreme(), m->mass_s = extreme(); break;
    case 6: v->device.values.tick = UINT32_MAX - below(100); break;
    default: v->device.simulate = (int)below(10); break;
    }
}

static int extremes(unsigned long long seed, long ticks)
{
    tq_virtual *v = (tq_virtual *)malloc(sizeof *v);
    long n, stuck = 0, wrapped = 0, sources = 0;
    state_of_chance = seed;
    tq_virtual_start(v, 1, 0);
    for (n = 0; n < ticks; n++) {
        int32_t before = v->device.counted[0];
        if (!v->device.greeted)
            say(v, TQ_HELLO, NULL, 0);
        if (below(200) == 0)
            tq_simulated_start(&v->simulated, 0), v->device.board.cables = tq_usual_cables();
        if (below(20) == 0)
            spoil(v);
        if (below(20) == 0)
            v->device.force.state = (int)below(TQ_STATES);
        if (below(50) == 0)
            v->device.values.source = (uint8_t)below(3), v->device.samples_in += below(5), sources++;
        if (below(2)) {
            tq_virtual_step(v, 1);
        } else { /* whatever the counters say */
            uint16_t counts[TQ_MOTORS] = { (uint16_t)below(65536), v->device.counts[1] };
            counts[1] = (uint16_t)(below(2) ? below(65536) : counts[1]);
            tq_device_tick(&v->device, counts, (int)below(2), 1);
        }
        v->waiting = 0;
        v->device.force.engaged = below(10) > 0;
        stuck += tq_device_stuck(&v->device);
        wrapped += (before > 0) != (v->device.counted[0] > 0) && (before > 1 << 30 || before < -(1 << 30));
    }
    printf("ticks %ld stuck %ld wrapped %ld sources %ld\n", ticks, stuck, wrapped, sources);
    free(v);
    return 0;
}

/* --- Frames ---------------------------------------------------------------------------------------- */

static size_t from_hex(const char *text, uint8_t *out)
{
    size_t n = 0;
    unsigned byte;
    for (; text[2 * n] && sscanf(text + 2 * n, "%2x", &byte) == 1; n++)
        out[n] = (uint8_t)byte;
    return n;
}

static int frames(void)
{
    unsigned kind, sequence;
    unsigned long nonce;
    char text[2 * TQ_MOST_BODY + 2];
    while (scanf("%u %u %lu %473s", &kind, &sequence, &nonce, text) == 4) {
        uint8_t body[TQ_MOST_BODY + 1], out[TQ_MOST_STUFFED];
        size_t length = text[0] == '-' ? 0 : from_hex(text, body), n, count;
        tq_reader reader;
        tq_frame f;
        int back = 0;
        memset(&reader, 0, sizeof reader);
        count = tq_stuffed((uint8_t)kind, (uint16_t)sequence, (uint32_t)nonce, body, (uint8_t)length, out);
        for (n = 0; n < count; n++)
            if (tq_reader_take(&reader, out[n], &f))
                back = f.kind == kind && f.sequence == sequence && f.nonce == nonce && f.length == length
                       && !memcmp(f.body, body, length);
        for (n = 0; n < count; n++)
            printf("%02x", out[n]);
        printf(" %d\n", back);
    }
    return 0;
}

int main(int count, char **arguments)
{
    if (count == 3 && !strcmp(arguments[1], "paths"))
        return every_path(atoi(arguments[2]));
    if (count == 4 && !strcmp(arguments[1], "limits"))
        return limits(strtoull(arguments[2], NULL, 10), atol(arguments[3]));
    if (count == 4 && !strcmp(arguments[1], "damaged"))
        return damaged(strtoull(arguments[2], NULL, 10), atol(arguments[3]));
    if (count == 3 && !strcmp(arguments[1], "silences"))
        return silences(atol(arguments[2]));
    if (count == 4 && !strcmp(arguments[1], "extremes"))
        return extremes(strtoull(arguments[2], NULL, 10), atol(arguments[3]));
    if (count == 2 && !strcmp(arguments[1], "frames"))
        return frames();
    return 2;
}
