/* The firmware, which ends QEMU with status 3 after four seconds of ticks, but with -DHANGS=1 its main loop hangs after
   one, and with -DHANGS=2 its tick. */

#include "simulated.h"

static inline void hanging_poll(tq_device *device)
{
    static const uint32_t ended[2] = { 0x20026, 3 };
    register uint32_t what __asm("r0") = 0x20; /* SYS_EXIT_EXTENDED of semihosting */
    register const uint32_t *told __asm("r1") = ended;
    while (HANGS == 1 && device->values.tick > TQ_TICK_HZ)
        ;
    if (device->values.tick > 4 * TQ_TICK_HZ)
        __asm volatile("bkpt 0xab" : : "r"(what), "r"(told) : "memory");
    tq_device_poll(device);
}

static inline int hanging_pace(const tq_device *device)
{
    while (HANGS == 2 && device->values.tick > TQ_TICK_HZ)
        ;
    return tq_device_pace(device);
}

#define tq_device_poll hanging_poll
#define tq_device_pace hanging_pace
#include "firmware.c"
