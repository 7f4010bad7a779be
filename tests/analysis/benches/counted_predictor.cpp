/* Operations of the autoregressive rival, counted: `counted_predictor ORDER`.

   Prints "sample_WHAT count" and "update_WHAT count"; WHAT is additions (subtractions included),
   multiplications, divisions or square_roots. The hand is on the grid. */

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "counted.h"
#include "rivals.h"

static void print(const char *part, const Counts &of, int samples)
{
    std::printf("%s_additions %ld\n", part, of.additions / samples);
    std::printf("%s_multiplications %ld\n", part, of.multiplications / samples);
    std::printf("%s_divisions %ld\n", part, of.divisions / samples);
    std::printf("%s_square_roots %ld\n", part, of.square_roots / samples);
}

int main(int, char **texts)
{
    const int order = std::atoi(texts[1]), layers = (order + 2) / 3, columns = 1 + 3 * layers;
    const int samples = 32;
    std::vector<Counted> speeds{10, 100, 300}, forces{0.25, 1}, values;
    for (int condition = 0; condition < 6; condition++)
        for (int column = 0; column < columns; column++)
            values.push_back(column ? 3.0 * column / columns : 0.1);
    tq_texture texture{};
    texture.speeds = 3, texture.forces = 2, texture.layers = layers;
    texture.speed_mm_s = speeds.data(), texture.force_n = forces.data();
    texture.values = values.data(), texture.model_rate_hz = texture.rate_hz = 5000;
    texture.update_samples = 1000;
    tq_rival rival{};
    rival.kind = TQ_PREDICTOR, rival.order = order;
    std::vector<Counted> speed(samples, 150), force(samples, 0.5), out(samples);
    tq_rival_render(&texture, &rival, speed.data(), force.data(), out.data(), out.size());
    counts = Counts();
    tq_rival_render(&texture, &rival, speed.data(), force.data(), out.data(), out.size());
    print("sample", counts, samples);
    counts = Counts();
    const tq_hand hand = tq_hand_at(&texture, speed[0], force[0]);
    tq_rival_update(&texture, &rival, &hand);
    print("update", counts, 1);
    return 0;
}
