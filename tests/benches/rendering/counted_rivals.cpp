/* Operations of the rivals, counted: `counted_rivals POLES ZEROS BANDS` of a filter by its coefficients,
   of bands by theirs, of looped wavetables and of grains.

   Prints "RIVAL_sample_WHAT count" and "RIVAL_update_WHAT count"; WHAT is additions (subtractions
   included), multiplications, divisions or square_roots. The hand is on the grid. */

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "counted.h"
#include "sounds.h"

/* Of each sample alike. */
static long each(long all, int samples)
{
    if (all % samples) {
        std::fprintf(stderr, "%ld operations in %d samples\n", all, samples);
        std::exit(1);
    }
    return all / samples;
}

static void print(const char *part, const Counts &of, int samples)
{
    std::printf("%s_additions %ld\n", part, each(of.additions, samples));
    std::printf("%s_multiplications %ld\n", part, each(of.multiplications, samples));
    std::printf("%s_divisions %ld\n", part, each(of.divisions, samples));
    std::printf("%s_square_roots %ld\n", part, each(of.square_roots, samples));
}

/* Three speeds and two forces, whose table has so many columns. */
struct Grid {
    std::vector<Counted> speeds{10, 100, 300}, forces{0.25, 1}, values;
    tq_texture texture{};
    Grid(int columns, int update_samples)
    {
        for (int condition = 0; condition < 6; condition++)
            for (int column = 0; column < columns; column++)
                values.push_back(column ? 3.0 * column / columns : 0.1);
        texture.speeds = 3, texture.forces = 2, texture.layers = (columns - 1) / 3;
        texture.speed_mm_s = speeds.data(), texture.force_n = forces.data();
        texture.values = values.data(), texture.model_rate_hz = texture.rate_hz = 5000;
        texture.update_samples = update_samples;
    }
};

static const int SAMPLES = 32;
static std::vector<Counted> speed(SAMPLES, 150), force(SAMPLES, 0.5), out(SAMPLES);

static void coefficients(int poles, int zeros)
{
    Grid grid(1 + (poles + zeros + 2) / 3 * 3, 1000);
    tq_rival rival{};
    rival.kind = TQ_COEFFICIENTS, rival.poles = poles, rival.zeros = zeros;
    tq_rival_render(&grid.texture, &rival, speed.data(), force.data(), out.data(), out.size());
    counts = Counts();
    tq_rival_render(&grid.texture, &rival, speed.data(), force.data(), out.data(), out.size());
    print("coefficients_sample", counts, SAMPLES);
    counts = Counts();
    const tq_hand hand = tq_hand_at(&grid.texture, speed[0], force[0]);
    tq_rival_update(&grid.texture, &rival, &hand);
    print("coefficients_update", counts, 1);
}

static void bands(int layers)
{
    Grid grid(1 + 3 * layers, 1000);
    tq_rival rival{};
    rival.kind = TQ_BANDS;
    tq_rival_render(&grid.texture, &rival, speed.data(), force.data(), out.data(), out.size());
    counts = Counts();
    tq_rival_render(&grid.texture, &rival, speed.data(), force.data(), out.data(), out.size());
    print("bands_sample", counts, SAMPLES);
    counts = Counts();
    const tq_hand hand = tq_hand_at(&grid.texture, speed[0], force[0]);
    tq_rival_update(&grid.texture, &rival, &hand);
    print("bands_update", counts, 1);
}

static void loops()
{
    Grid grid(1, 1000);
    std::vector<int16_t> sounds(6 * 50, 1000);
    tq_loops loops{};
    loops.sounds = sounds.data(), loops.length = 50;
    tq_loops_render(&grid.texture, &loops, speed.data(), force.data(), out.data(), out.size());
    counts = Counts();
    tq_loops_render(&grid.texture, &loops, speed.data(), force.data(), out.data(), out.size());
    print("loops_sample", counts, SAMPLES);
    counts = Counts();
    tq_loops_update(&grid.texture, &loops, speed[0], force[0]);
    print("loops_update", counts, 1);
}

static void grains()
{
    Grid grid(1, 1);
    std::vector<int16_t> sounds(6 * 50, 1000);
    std::vector<Counted> window(2 * SAMPLES, 1);
    tq_grains grains{};
    grains.sounds = sounds.data(), grains.length = 50, grains.grain = 8;
    grains.window = window.data();
    tq_grains_render(&grid.texture, &grains, speed.data(), force.data(), out.data(), 1);
    counts = Counts();
    tq_grains_render(&grid.texture, &grains, speed.data(), force.data(), out.data(), 3);
    print("grains_sample", counts, 3);
    counts = Counts();
    const tq_grain grain = tq_grain_of(&grid.texture, &grains, speed[0], force[0]);
    print("grains_update", counts, 1);
    out[0] = grain.gain[0];
}

int main(int, char **texts)
{
    coefficients(std::atoi(texts[1]), std::atoi(texts[2]));
    bands(std::atoi(texts[3]));
    loops();
    grains();
    return 0;
}
