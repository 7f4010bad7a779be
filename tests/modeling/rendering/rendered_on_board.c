/* A texture rendered on a micro-controller without an operating system: the hand comes in over the
   serial port, samples go out. For ARM's boards MPS2 as QEMU knows them; mps2.ld is their memory.

   Define HEADER, the exported header, and TEXTURE, its name; or SCENE, that of a scene, whose last texture
   the hand is switched to before sample SWITCH_AT, the first of a call. In comes a request, out goes an answer, all little-endian:
       request   tq_real's size, samples, samples per reading, samples per call (4 bytes each), key
                 (8 bytes; of a scene the texture to begin with), then for every reading speed in 1/64 mm/s and force in 1/4096 N (2 bytes
                 each, signed; a speed of -32768 is none)
       answer    ticks of 25 MHz that a loop of a million instructions took, and that the calls of the
                 renderer took (4 bytes each), samples, the CRC-32 of all before */

#include HEADER

enum { MOST_SAMPLES = 10000, MOST_PER_CALL = 256 };

#define JOINED(a, b) a##b
#define NAMED(a, b) JOINED(a, b)
#define REGISTER(address) (*(volatile uint32_t *)(address))
#define UART_DATA REGISTER(0x40004000) /* CMSDK UART 0 */
#define UART_STATE REGISTER(0x40004004)
#define UART_CONTROL REGISTER(0x40004008)
#define UART_DIVISOR REGISTER(0x40004010)
#define TICK_CONTROL REGISTER(0xE000E010) /* SysTick */
#define TICK_RELOAD REGISTER(0xE000E014)
#define TICK_NOW REGISTER(0xE000E018)
#define COPROCESSORS REGISTER(0xE000ED88)

extern uint32_t data_source[], data_begin[], data_end[], bss_begin[], bss_end[];
void stack_top(void); /* an address, not a function */
int main(void);
void start(void);

/* --- Start ------------------------------------------------------------------------------------- */

static void stop(void)
{
    for (;;)
        ;
}

void start(void)
{
    uint32_t *to, *from = data_source;
    COPROCESSORS |= 0xFu << 20; /* the floating-point unit */
    __asm volatile("dsb\nisb");
    for (to = data_begin; to < data_end;)
        *to++ = *from++;
    for (to = bss_begin; to < bss_end;)
        *to++ = 0;
    main();
    stop();
}

/* The first stack and what is called at reset; nothing else is expected to happen. */
__attribute__((section(".vectors"), used)) static void (*const vectors[16])(void) = {
    stack_top, start, stop, stop, stop, stop, stop,
};

/* --- Serial port and time ---------------------------------------------------------------------- */

static uint32_t crc = 0xFFFFFFFFu;

static void put(const void *bytes, size_t count)
{
    const unsigned char *next = (const unsigned char *)bytes;
    int bit;
    for (; count; count--, next++) {
        while (UART_STATE & 1) /* full */
            ;
        UART_DATA = *next;
        for (crc ^= *next, bit = 0; bit < 8; bit++)
            crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320u : 0);
    }
}

static void get(void *bytes, size_t count)
{
    unsigned char *next = (unsigned char *)bytes;
    for (; count; count--) {
        while (!(UART_STATE & 2)) /* empty */
            ;
        *next++ = (unsigned char)UART_DATA;
    }
}

/* Counts downwards in 24 bits. */
static uint32_t ticks_since(uint32_t before)
{
    return (before - TICK_NOW) & 0xFFFFFF;
}

/* A million instructions: a subtraction and a jump, half a million times. */
static uint32_t ticks_of_a_million(void)
{
    uint32_t left = 500000, before = TICK_NOW;
    __asm volatile("1: subs %0, %0, #1\nbne 1b" : "+r"(left) : : "cc");
    return ticks_since(before);
}

/* --- Rendering --------------------------------------------------------------------------------- */

typedef struct {
    uint32_t size, samples, hold, per_call;
    uint64_t key;
} request;

static int16_t hand[MOST_SAMPLES][2];
static tq_real out[MOST_SAMPLES], speed[MOST_PER_CALL], force[MOST_PER_CALL];

#ifdef SCENE
static tq_real memory[NAMED(SCENE, _memory)];
static tq_scene_hand state;

static void begin(uint64_t key)
{
    tq_scene_start(&state, &SCENE, memory, 0, (int)key);
}

static void play(uint32_t done, uint32_t count)
{
    if (done == SWITCH_AT)
        tq_scene_switch(&state, SCENE.count - 1);
    tq_scene_render(&state, speed, force, out + done, count);
}
#else
static tq_real memory[NAMED(TEXTURE, _memory)];
static tq_state state;

static void begin(uint64_t key)
{
    tq_start(&TEXTURE, &state, memory, key);
}

static void play(uint32_t done, uint32_t count)
{
    tq_render(&TEXTURE, &state, speed, force, out + done, count);
}
#endif

/* All samples; the ticks that the calls of the renderer took. */
static uint32_t render(const request *asked)
{
    uint32_t done, i, ticks = 0, before;
    begin(asked->key);
    for (done = 0; done < asked->samples; done += asked->per_call) {
        uint32_t count = asked->samples - done;
        count = count < asked->per_call ? count : asked->per_call;
        for (i = 0; i < count; i++) {
            const int16_t *reading = hand[(done + i) / asked->hold];
            speed[i] = (tq_real)reading[0] / 64;
            force[i] = (tq_real)reading[1] / 4096;
            if (reading[0] == INT16_MIN)
                speed[i] = (tq_real)__builtin_nanf("");
        }
        before = TICK_NOW;
        play(done, count);
        ticks += ticks_since(before);
    }
    return ticks;
}

int main(void)
{
    request asked;
    uint32_t ticks[2], check;
    UART_DIVISOR = 16;
    UART_CONTROL = 3; /* both ways */
    TICK_RELOAD = 0xFFFFFF;
    TICK_CONTROL = 5; /* at the processor's clock, no interrupt */
    get(&asked, sizeof asked);
    if (asked.size != sizeof(tq_real) || asked.samples > MOST_SAMPLES || !asked.hold
        || !asked.per_call || asked.per_call > MOST_PER_CALL)
        return 1;
    get(hand, (asked.samples + asked.hold - 1) / asked.hold * sizeof hand[0]);
    ticks[0] = ticks_of_a_million();
    ticks[1] = render(&asked);
    put(ticks, sizeof ticks);
    put(out, asked.samples * sizeof out[0]);
    check = ~crc;
    put(&check, sizeof check);
    return 0;
}
