/* The kernel's two calls with external linkage, so that a compiler keeps them and only them. */

#include "kernel.h"

#ifdef __cplusplus
extern "C" {
#endif

void start(const tq_texture *t, tq_state *s, tq_real *memory, uint64_t key);
void render(const tq_texture *t, tq_state *s, const tq_real *speed, const tq_real *force,
            tq_real *out, size_t count);

void start(const tq_texture *t, tq_state *s, tq_real *memory, uint64_t key)
{
    tq_start(t, s, memory, key);
}

void render(const tq_texture *t, tq_state *s, const tq_real *speed, const tq_real *force,
            tq_real *out, size_t count)
{
    tq_render(t, s, speed, force, out, count);
}

#ifdef __cplusplus
}
#endif
