/* uart() of an STM32's board file, against its UART as RM0090 and RM0410 have it, while two bytes complete before any
   two accesses to registers. Prints how often an interrupt remained for ever, and how often bytes that the UART had
   taken, or that were to be sent, differ from those that arrived.

   -DBOARD: the board's file. */

#define TQ_CORTEX_M_H
#include "board.h"

#include <stdio.h>

static volatile uint32_t *touched(uintptr_t address);
#define REGISTER(address) (*touched((uintptr_t)(address)))
#define INTERRUPTS_ON(number) (void)(number)
#define BARRIER() (void)0

static void begin_ticks(uint32_t hz) { (void)hz; }
static uint32_t start_number(void) { return 1; }
static void stack_top(void) {}
static void start(void) {}
static void crashed(void) {}

#include BOARD

enum { UNREAD = 0x100, AT_MOST = 12, TO_SEND = 3 };
static volatile uint32_t state, data, control, clears, other, sends;
static volatile uint32_t *last;
static int full, overrun, seen, touches, due[2];
static uint8_t held, taken[8], got[8], sent[8];
static int taken_count, got_count, sent_count, next;

static void complete(uint8_t byte)
{
    if (overrun) /* nothing is received until it is cleared */
        return;
    if (full)
        overrun = 1;
    else
        full = 1, held = taken[taken_count++] = byte;
}

/* What the last access did: of a register for both ways a value shows whether it was written. */
static void settle(void)
{
    if (last == &data && data == (held | UNREAD)) {
        full = 0;
        if (seen) /* by a read of the state before */
            overrun = seen = 0;
    } else if (last == &data || last == &sends) {
        sent[sent_count++] = (uint8_t)*last;
    } else if (last == &clears && clears & OVERRUN) {
        overrun = 0;
    }
    last = NULL;
}

static volatile uint32_t *touched(uintptr_t address)
{
    const uintptr_t offset = address - UART_ADDRESS;
    int n;
    settle();
    touches++;
    for (n = 0; n < 2; n++)
        if (due[n] == touches)
            complete((uint8_t)('b' + n));
    last = offset == STATE ? &state : offset == RECEIVE ? &data : offset == SEND ? &sends : offset == CONTROL ? &control : &other;
#ifdef UART_CLEARS
    if (offset == UART_CLEARS)
        last = &clears;
    clears = 0;
#else
    seen = last == &state ? overrun : seen;
#endif
    state = (full ? CAME : 0u) | (overrun ? OVERRUN : 0u) | EMPTY, data = held | UNREAD;
    return last;
}

void firmware_byte(uint8_t byte) { got[got_count++ % 8] = byte; }
int firmware_next(uint8_t *byte) { return next < TO_SEND ? *byte = (uint8_t)('x' + next++), 1 : 0; }
void firmware_tick(void) {}

int main(void)
{
    int scenarios = 0, storms = 0, wrong = 0, calls, first, second;
    for (first = 1; first <= AT_MOST; first++)
        for (second = first; second <= AT_MOST; second++, scenarios++) {
            full = overrun = seen = touches = taken_count = got_count = sent_count = next = 0;
            last = NULL, control = CAME, due[0] = first, due[1] = second;
            complete('a');
            board_kick();
            for (calls = 0; calls < 100; calls++) {
                settle();
                if (!(full || overrun || control & EMPTY)) {
                    if (touches >= second)
                        break;
                    (void)touched(0); /* time passes */
                } else {
                    uart();
                }
            }
            storms += calls == 100;
            wrong += got_count != taken_count || memcmp(got, taken, (size_t)taken_count) || sent_count != TO_SEND
                     || memcmp(sent, "xyz", TO_SEND);
        }
    printf("scenarios %d storms %d wrong %d\n", scenarios, storms, wrong);
    return 0;
}
