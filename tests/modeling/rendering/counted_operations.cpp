/* Operations of the kernel, counted: a C++17 program in which every real number counts what is done
   with it.

   counted_operations [NAME=NUMBER ...], all of them optional:
       layers=4 update_samples=5          as in tq_texture
       interpolated=0                     1: eight samples of the output for one of the model
       notch=0 peak=0 rms=0 duration=0    1: with vibrator compensation, with that limit

   Prints lines "PART_WHAT count". PART is
       sample    one sample of the model between updates, in a block of a multiple of four
       output    one sample of the output between updates for which the model makes none
       update    one parameter update, without the sample that follows
       chunk     what a call, or a chunk of TQ_CHUNK samples in it, costs beside its samples
       block     12 updates and their samples in one call
   and WHAT additions (subtractions included), multiplications, divisions, square_roots, or
   table_reads: numbers of the texture's table. Signs and comparisons are not counted, nor are the
   integers of the noise; also printed are block_samples, block_updates and block_chunks.

   The hand moves steadily on the grid, no parameter is clamped and no gain reaches its slew. The
   RMS limit touches every sample, so each costs its square root. */

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "counted.h"
#include "kernel.h"

static const int UPDATES = 12;

static int argument(int count, char **texts, const std::string &name, int otherwise)
{
    for (int i = 1; i < count; i++)
        if (std::string(texts[i]).rfind(name + "=", 0) == 0)
            return std::atoi(texts[i] + name.size() + 1);
    return otherwise;
}

/* A texture of 3 speeds and 2 forces, with what its pointers point to. */
struct Texture {
    std::vector<Counted> speeds{10, 100, 300}, forces{0.25, 1}, values, signs, doubling, phases, slews;
    tq_texture texture{};

    Texture(int count, char **texts)
    {
        tq_texture &t = texture;
        t.speeds = 3, t.forces = 2;
        t.layers = argument(count, texts, "layers", 4);
        t.update_samples = argument(count, texts, "update_samples", 5);
        for (int condition = 0; condition < t.speeds * t.forces; condition++)
            append_condition(t.layers);
        for (Counted &value : values)
            value.of_table = true;
        signs.assign(static_cast<size_t>(t.layers) + 1, 1);
        slews.assign(static_cast<size_t>(t.layers) + 1, 1);
        doubling.assign(2 * TQ_DOUBLING, 1.0 / TQ_DOUBLING);
        phases.assign(4 * TQ_PHASE, 1.0 / TQ_PHASE);
        t.speed_mm_s = speeds.data(), t.force_n = forces.data(), t.values = values.data();
        t.signs = signs.data(), t.slews = slews.data();
        t.model_rate_hz = t.rate_hz = 5000;
        if (argument(count, texts, "interpolated", 0)) {
            t.rate_hz = 40000, t.up = 4, t.down = 1, t.lead = 0.4;
            t.doubling = doubling.data(), t.phases = phases.data();
        }
        t.speed_change = 100, t.force_change = 1, t.slope_share = 0.5;
        if (argument(count, texts, "notch", 0))
            t.notch_hz = 80, t.notch_width_hz = 60, t.notch_share = 0.7;
        t.peak = argument(count, texts, "peak", 0);
        if (argument(count, texts, "rms", 0)) /* below every sample */
            t.mean_square = 1e-20, t.mean_share = 0.01;
        if (argument(count, texts, "duration", 0))
            t.longest = 1000000, t.pause = 10;
    }

    void append_condition(int layers)
    {
        values.push_back(0.1);
        for (int layer = 0; layer < layers; layer++)
            values.push_back(100 + 200 * layer);
        for (int layer = 0; layer < layers; layer++)
            values.push_back(50);
        for (int layer = 0; layer < layers; layer++)
            values.push_back(0.5);
    }
};

/* A texture in motion. */
struct Motion {
    const tq_texture &texture;
    std::vector<Counted> memory;
    tq_state state;
    Counted speed = 150, force = 0.5;

    explicit Motion(const tq_texture &t)
        : texture(t), memory(static_cast<size_t>(TQ_MEMORY(t.layers, t.up)))
    {
        tq_start(&texture, &state, memory.data(), 7);
        render(10 * texture.update_samples * outputs());
    }

    /* Samples of the output for each of the model. */
    int outputs() const
    {
        return texture.up ? 2 * texture.up : 1;
    }

    Counts render(int samples)
    {
        std::vector<Counted> v(static_cast<size_t>(samples), speed), f(v.size(), force);
        std::vector<Counted> out(v.size());
        counts = Counts();
        tq_render(&texture, &state, v.data(), f.data(), out.data(), v.size());
        return counts;
    }

    /* That many samples of the model before the next update is due. */
    Counts render_between(int samples)
    {
        state.since_update = texture.update_samples - samples;
        return render(samples * outputs());
    }

    /* What samples of the output cost that need none of the model. */
    Counts follow(size_t samples)
    {
        std::vector<Counted> v(samples, speed), f(samples, force), out(samples, Counted(1));
        const int phase = state.phase;
        counts = Counts();
        tq_lift_offs(v.data(), f.data(), 1, static_cast<int>(samples));
        if (texture.up)
            tq_interpolate(&texture, &state, 0, out.data(), samples);
        tq_restrain(&texture, &state, out.data(), static_cast<int>(samples));
        state.phase = phase;
        return counts;
    }

    /* An update is due, one period after the last one. */
    void due()
    {
        state.since_update = texture.update_samples;
        state.hand.read = state.position - static_cast<uint64_t>(texture.update_samples);
    }

    Counts update()
    {
        due();
        counts = Counts();
        tq_take_in(&texture, &state, 0, speed, force);
        tq_update(&texture, &state);
        return counts;
    }
};

/* (times * a - b) / parts */
static Counts less(int times, const Counts &a, const Counts &b, int parts)
{
    Counts left;
    left.additions = (times * a.additions - b.additions) / parts;
    left.multiplications = (times * a.multiplications - b.multiplications) / parts;
    left.divisions = (times * a.divisions - b.divisions) / parts;
    left.square_roots = (times * a.square_roots - b.square_roots) / parts;
    left.table_reads = (times * a.table_reads - b.table_reads) / parts;
    return left;
}

static void print(const char *part, const Counts &of)
{
    std::printf("%s_additions %ld\n", part, of.additions);
    std::printf("%s_multiplications %ld\n", part, of.multiplications);
    std::printf("%s_divisions %ld\n", part, of.divisions);
    std::printf("%s_square_roots %ld\n", part, of.square_roots);
    std::printf("%s_table_reads %ld\n", part, of.table_reads);
}

int main(int count, char **texts)
{
    const Texture made(count, texts);
    Motion motion(made.texture);
    const Counts one = motion.follow(1), output = less(1, motion.follow(2), one, 1);
    const Counts four = motion.render_between(4), eight = motion.render_between(8);
    const int outputs = motion.outputs();
    print("output", output);
    print("sample", less(1, less(1, eight, four, 4), less(outputs, output, Counts(), 1), 1));
    print("chunk", less(2, four, eight, 1));
    print("update", motion.update());
    const int samples = UPDATES * made.texture.update_samples, all = samples * outputs;
    motion.due();
    print("block", motion.render(all));
    std::printf("block_samples %d\nblock_outputs %d\n", samples, all);
    std::printf("block_updates %d\n", UPDATES);
    std::printf("block_chunks %d\n", (samples + TQ_CHUNK - 1) / TQ_CHUNK);
    return 0;
}
