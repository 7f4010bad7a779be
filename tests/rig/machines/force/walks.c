/* Judges rig/machines/force/force.h from outside, in virtual time.

   walks faults SEED STEPS      random readings, faults and requests; prints what was broken
   walks strokes SEED COUNT FACTOR DELAY DAMPER   net energy of strokes on a wall of FACTOR times the bound
   walks mass FACTOR DELAY      a mass with friction that rests on such a wall; prints how it ends
   walks late FACTOR LEAST MOST LATE SEED   the same, 0.2 kg, with periods from LEAST to MOST ms; -1 as MOST: a
                                single one of LATE ms whenever the mass is fastest and the running mean lets it */

#include "force.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static unsigned long long state_of_chance;

static double chance(void)
{
    state_of_chance = state_of_chance * 6364136223846793005u + 1442695040888963407u;
    return (double)(state_of_chance >> 11) / 9007199254740992.0;
}

static tq_force_limits usual(void)
{
    tq_force_limits l = { 0.004, 0.25, 0.05, 0.2, 5, 2000, 5, 1000, 2, 100, { -80, -80, -80 },
                          { 80, 80, 80 }, { 0, 0, 0 }, { 1, 0, 0, 0, 1, 0, 0, 0, 1 }, 0.001, 0, 0 };
    return l;
}

static int faults(unsigned long long seed, long steps)
{
    tq_force f;
    tq_force_limits l = usual();
    tq_wall wall = { 0, 3, 0.002, 40, 40 };
    tq_sensed s;
    double x[3] = { 0, 0, 20 }, v[3] = { 0, 0, 0 }, largest = 0, released_s = 0, longest_s = 0;
    long n, broken = 0, pairs = 0, causes = 0, ran = 0;
    static int pair[TQ_STATES][TQ_EVENTS], cause[TQ_CAUSES];
    int k;
    state_of_chance = seed;
    memset(&s, 0, sizeof s);
    tq_force_start(&f, &l);
    tq_force_set_wall(&f, &wall);
    for (n = 0; n < steps; n++) {
        double step_s = 0.001 * (0.5 + chance()), before_n = f.normal_n, size = 0, power, draw = chance();
        int before = f.state, event = -1, given = 0;
        if (draw < 0.02) {
            static const int asked[5] = { TQ_ARM, TQ_SHOW, TQ_SHOW, TQ_HIDE, TQ_CLEAR };
            event = asked[(int)(5 * chance())];
            if (event == TQ_SHOW && chance() < 0.1) {
                wall.height_mm = 30 * (chance() - 0.5), wall.stiffness_n_per_mm = 5 * chance();
                tq_force_set_wall(&f, &wall);
            }
        } else if (draw < 0.0202) {
            event = TQ_FAILED, given = 1 + (int)((TQ_CAUSES - 1) * chance());
        }
        if (event >= 0) {
            pair[f.state][event]++;
            tq_force_event(&f, event, given);
            if (f.state == TQ_RUNNING && before != TQ_RUNNING && !(before == TQ_ARMED && event == TQ_SHOW))
                broken++;
            if (before == TQ_FAULT && f.state != TQ_FAULT && event != TQ_CLEAR)
                broken++;
            before = f.state;
        }
        for (k = 0; k < 3; k++) { /* a hand that wanders, and comes back */
            v[k] += (600 * (chance() - 0.5) - 0.02 * v[k] - 0.3 * x[k]);
            if (v[k] > 550 || v[k] < -550)
                v[k] *= 0.5;
            x[k] += v[k] * step_s;
            s.position_mm[k] = x[k];
        }
        s.failed = 0;
        draw = chance();
        if (draw < 1e-4)
            s.failed = 1;
        else if (draw < 2e-4)
            s.position_mm[(int)(3 * chance())] = chance() < 0.5 ? NAN : INFINITY;
        else if (draw < 3e-4)
            s.position_mm[(int)(3 * chance())] += chance() < 0.5 ? 50 : -50;
        else if (draw < 4e-4)
            step_s = 0.005;
        else if (draw < 5e-4)
            step_s = chance() < 0.5 ? NAN : -1;
        else if (draw < 6e-4)
            for (k = 0; k < 3; k++)
                x[k] = 200 * (chance() - 0.5), s.position_mm[k] = x[k];
        tq_force_tick(&f, &s, step_s);
        ran += f.state == TQ_RUNNING;
        cause[f.cause]++;
        for (k = 0; k < 3; k++)
            size += f.command_n[k] * f.command_n[k];
        size = sqrt(size);
        largest = size > largest ? size : largest;
        power = fabs(f.normal_n * f.velocity_mm_s[2]) * 1e-3;
        if (!(size <= l.most_n * (1 + 1e-12)) || f.normal_n < 0)
            broken++;
        if ((f.state == TQ_BOOT || f.state == TQ_IDLE || f.state == TQ_FAULT) && size != 0)
            broken++;
        if (fabs(f.normal_n) - fabs(before_n) > l.most_n_per_s * 0.004 + 1e-9)
            broken++;
        if (step_s > 0 && step_s < 0.004 && fabs(f.normal_n) - fabs(before_n) > l.most_n_per_s * step_s + 1e-9)
            broken++;
        if ((f.state == TQ_ARMED || f.state == TQ_RUNNING) && power > l.most_w * (1 + 1e-9))
            broken++;
        if (f.state == TQ_RUNNING && before != TQ_RUNNING) /* a reading never arms */
            broken++;
        if (before == TQ_FAULT && f.state != TQ_FAULT)
            broken++;
        if (f.state == TQ_RELEASING && size > fabs(before_n) + 1e-12)
            broken++;
        released_s = f.state == TQ_RELEASING && step_s > 0 ? released_s + (step_s < 0.004 ? step_s : 0.004) : 0;
        longest_s = released_s > longest_s ? released_s : longest_s;
    }
    for (n = 0; n < TQ_STATES; n++)
        for (k = 0; k < TQ_EVENTS; k++)
            pairs += pair[n][k] > 0;
    for (k = 1; k < TQ_CAUSES; k++)
        causes += cause[k] > 0;
    printf("broken %ld largest %.9f longest %.6f pairs %ld causes %ld running %ld\n", broken, largest,
           longest_s, pairs, causes, ran);
    return 0;
}

/* A smooth stroke into a wall at z = 0 and out of it: up to 8 mm deep, with a tremor. */
typedef struct {
    double depth, seconds, tremor, hz;
} stroke;

static double height(const stroke *s, double t)
{
    double share = t / s->seconds, in = 0.5 - 0.5 * cos(6.283185307179586 * share);
    return 0.1 - (0.1 + s->depth) * in + s->tremor * in * sin(6.283185307179586 * s->hz * t);
}

static int strokes(unsigned long long seed, int count, double factor, int delay, double damper)
{
    const double T = 0.001, b = 0.0005; /* N s/mm */
    double most = -1e9, least = 1e9;
    int n, positive = 0;
    state_of_chance = seed;
    for (n = 0; n < count; n++) {
        stroke one = { 1 + 7 * chance(), 0.2 + chance(), 0.3 * chance(), 2 + 18 * chance() };
        tq_force_limits l = usual();
        tq_force f;
        tq_wall wall = { 0, factor * (b - damper * b) / (T / 2 + delay * T), damper * b, 100, 100 };
        tq_sensed s;
        double held[8] = { 0 }, energy = 0, stored = 0;
        int k, sub, steps = (int)(one.seconds / T) + delay + 1;
        l.most_n = 1e6, l.most_n_per_s = 1e12, l.most_w = 1e12, l.most_mm_s = 1e6, l.frozen_s = 10;
        memset(&s, 0, sizeof s);
        tq_force_start(&f, &l);
        tq_force_set_wall(&f, &wall);
        for (k = 0; k < steps; k++) {
            double t = k * T, z = height(&one, t), applied;
            s.position_mm[2] = z;
            tq_force_tick(&f, &s, T);
            if (k == 0) {
                tq_force_event(&f, TQ_ARM, 0);
                tq_force_event(&f, TQ_SHOW, 0);
            }
            held[k % 8] = f.normal_n;
            applied = k >= delay ? held[(k - delay) % 8] : 0;
            energy += applied * (height(&one, t + T) - z); /* exact: it is held for T */
            for (sub = 0; sub < 5; sub++) {
                double h = T / 5, dz = height(&one, t + (sub + 1) * h) - height(&one, t + sub * h);
                energy -= b * dz * dz / h;
            }
            stored += fabs(applied * (height(&one, t + T) - z));
        }
        energy /= stored;
        positive += energy > 0;
        most = energy > most ? energy : most;
        least = energy < least ? energy : least;
    }
    printf("positive %d most %.6f least %.6f\n", positive, most, least);
    return 0;
}

/* A wall that is shown, with the tool 1 mm above it. */
static void show_from_above(tq_force *f, tq_sensed *s, const tq_force_limits *l, const tq_wall *wall)
{
    memset(s, 0, sizeof *s);
    tq_force_start(f, l);
    tq_force_set_wall(f, wall);
    s->position_mm[2] = 1;
    tq_force_tick(f, s, 0.001);
    tq_force_event(f, TQ_ARM, 0);
    tq_force_event(f, TQ_SHOW, 0);
}

static int mass(double factor, int delay)
{
    const double T = 0.001, b = 0.0005, m = 0.0001, weight = 1; /* N s/mm, N s2/mm, N */
    tq_force_limits l = usual();
    tq_force f;
    tq_wall wall = { 0, factor * b / (T / 2 + delay * T), 0, 100, 100 };
    tq_sensed s;
    double held[8] = { 0 }, z, v = 10, worst = 0;
    int k, sub;
    z = -weight / wall.stiffness_n_per_mm;
    l.most_n = 1e6, l.most_n_per_s = 1e12, l.most_w = 1e12, l.most_mm_s = 1e9, l.frozen_s = 1e9;
    l.show_s = 1e-9, l.low_mm[2] = -1e6, l.high_mm[2] = 1e6;
    show_from_above(&f, &s, &l, &wall);
    for (k = 0; k < 20000; k++) {
        double force;
        s.position_mm[2] = z;
        f.sensed = k > 0;
        tq_force_tick(&f, &s, T);
        held[k % 8] = f.normal_n;
        force = k >= delay ? held[(k - delay) % 8] : weight;
        for (sub = 0; sub < 20; sub++) {
            v += (force - weight - b * v) / m * T / 20;
            z += v * T / 20;
        }
        if (k > 18000 && fabs(v) > worst)
            worst = fabs(v);
    }
    printf("worst %.9f state %d cause %d\n", worst, f.state, f.cause);
    return 0;
}

/* A weight on a wall whose servo ticks at periods that differ: how far it swings in the end, and whether the servo
   let go before it swung by 0.1 mm. */
static int late(double factor, double least_ms, double most_ms, double late_ms, double kg)
{
    const double T = 0.001, b = 0.0005, m = kg / 1000, weight = 1, h = 5e-5;
    tq_force_limits l = usual();
    tq_force f;
    tq_wall wall = { 0, factor * tq_largest_stiffness(b, 0, TQ_SLOWEST * T, 0), 0, 100, 100 };
    tq_sensed s;
    double z, v = 1, t = 0, worst = 0, last = 0, fell_s = -1, step_s = T, fastest = 0, rest, mean = 0;
    state_of_chance = 1, rest = z = -weight / wall.stiffness_n_per_mm;
    l.late_s = late_ms * 1e-3, l.frozen_s = 1e9, l.show_s = 1e-9;
    show_from_above(&f, &s, &l, &wall);
    f.sensed = 0; /* the mass is put onto the wall */
    while (t < 20 && f.cause == TQ_NO_CAUSE) {
        double force, until_s;
        s.position_mm[2] = z;
        tq_force_tick(&f, &s, step_s);
        mean = f.mean_s > mean ? f.mean_s : mean;
        force = f.normal_n;
        step_s = 1e-3 * (least_ms + (most_ms - least_ms) * chance());
        if (most_ms < 0) {
            double gap_s = -most_ms / 1000, window_s = l.late_s * (l.late_s - T) / ((TQ_SLOW_FROM - 1) * T);
            window_s = window_s > 0.02 ? window_s : 0.02;
            fastest = fabs(v) > fastest ? fabs(v) : fastest * 0.999;
            step_s = fabs(v) > 0.95 * fastest
                     && f.mean_s + gap_s / (window_s + gap_s) * (gap_s - f.mean_s) < TQ_SLOW_FROM * T
                         ? gap_s : T;
        }
        for (until_s = t + step_s; t < until_s - h / 2; t += h) {
            v += (force - weight - b * v) / m * h;
            z += v * h;
            worst = fabs(z - rest) > worst ? fabs(z - rest) : worst;
            if (t > 18)
                last = fabs(z - rest) > last ? fabs(z - rest) : last;
        }
    }
    if (f.cause != TQ_NO_CAUSE)
        fell_s = t;
    printf("worst %.6f last %.6f cause %d fell %.6f mean %.6f\n", worst, last, f.cause, fell_s, mean);
    return 0;
}

/* Tools of 0.05 to 0.5 kg, free or in hands that move up to 60 mm/s, with tremor, encoders of 0.005 to 0.08 mm and
   forces that come 0 to 3 ms late: how many are let through after ARM. */
static int probe(unsigned long long seed, int count, double sign)
{
    int n, armed = 0, unanswered = 0;
    state_of_chance = seed;
    for (n = 0; n < count; n++) {
        const double T = 0.001, h = 1e-4, turn = 6.283185307179586;
        const double m = 5e-5 * pow(10, chance()), b = 1e-4 * pow(20, chance()), count_mm = 0.005 * pow(16, chance());
        const int held = chance() < 0.8, delay = (int)(4 * chance());
        const double k = held ? 0.05 * pow(20, chance()) : 0, d = held ? 2e-3 * pow(10, chance()) : 0;
        const double hz = 0.3 + 2 * chance(), size = 60 * chance() / (turn * hz), phase = turn * chance();
        const double tremor = 0.05 * chance(), tremor_hz = 7 + 5 * chance(), tremor_phase = turn * chance();
        double z = size * sin(phase) * held, v = 0, x = 0, given[4] = { 0, 0, 0, 0 };
        tq_force_limits l = usual();
        tq_force f;
        tq_sensed s;
        int tick, sub;
        l.probe_n = 1, l.frozen_s = 1e9, l.answer_s = T * (delay + chance() - 0.5);
        memset(&s, 0, sizeof s);
        tq_force_start(&f, &l);
        for (tick = 0; tick < 700; tick++) {
            s.position_mm[0] = count_mm * floor(x / count_mm + 0.5);
            s.position_mm[2] = 30 + sign * count_mm * floor(z / count_mm + 0.5);
            tq_force_tick(&f, &s, T);
            if (tick == 200)
                tq_force_event(&f, TQ_ARM, 0);
            given[tick % 4] = f.normal_n;
            for (sub = 0; sub < 10; sub++) {
                double t = T * tick + h * sub, goal = size * sin(turn * hz * t + phase)
                       + tremor * sin(turn * tremor_hz * t + tremor_phase);
                v += h / m * (given[(tick + 4 - delay) % 4] - b * v + k * (goal - z) - d * v);
                z += h * v, x = 30 * sin(turn * 0.8 * t);
            }
        }
        armed += f.state == TQ_ARMED && f.proven, unanswered += f.cause == TQ_UNANSWERED;
    }
    printf("armed %d unanswered %d\n", armed, unanswered);
    return 0;
}

int main(int count, char **words)
{
    if (count > 3 && !strcmp(words[1], "faults"))
        return faults(strtoull(words[2], NULL, 10), atol(words[3]));
    if (count > 6 && !strcmp(words[1], "strokes"))
        return strokes(strtoull(words[2], NULL, 10), atoi(words[3]), atof(words[4]), atoi(words[5]),
                       atof(words[6]));
    if (count > 6 && !strcmp(words[1], "late"))
        return late(atof(words[2]), atof(words[3]), atof(words[4]), atof(words[5]), atof(words[6]));
    if (count > 4 && !strcmp(words[1], "probe"))
        return probe(strtoull(words[2], NULL, 10), atoi(words[3]), atof(words[4]));
    return mass(atof(words[2]), atoi(words[3]));
}
