/* A texture rendered in C or C++: pairs of speed and force, doubles, on standard input; samples,
   doubles, on standard output. Define HEADER, the exported header, and TEXTURE, its name. */

#include <stdio.h>

#include HEADER

enum { BLOCK = 100 };

#define JOINED(a, b) a##b
#define NAMED(a, b) JOINED(a, b)

int main(void)
{
    static tq_real memory[NAMED(TEXTURE, _memory)], speed[BLOCK], force[BLOCK], out[BLOCK];
    static tq_state state;
    static double hand[2 * BLOCK];
    size_t count, n;
    tq_start(&TEXTURE, &state, memory, NAMED(TEXTURE, _key));
    while ((count = fread(hand, 2 * sizeof(double), BLOCK, stdin)) > 0) {
        for (n = 0; n < count; n++)
            speed[n] = (tq_real)hand[2 * n], force[n] = (tq_real)hand[2 * n + 1];
        tq_render(&TEXTURE, &state, speed, force, out, count);
        for (n = 0; n < count; n++)
            hand[n] = (double)out[n];
        if (fwrite(hand, sizeof(double), count, stdout) != count)
            return 1;
    }
    return 0;
}
