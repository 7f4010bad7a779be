/* The one clock of all processes of a rig: the computer's, or one that is given from outside.

   Why a given one: a rig lets go after 20 ms without a tick and counts a hand as gone after 100 ms. Whether
   it does so cannot be seen on a computer that itself stands still for longer. A given clock goes no faster
   than the computer's, and stands still while anybody who takes part in it is late: time goes on once all
   of them wait for it. A busy computer makes it slow; order and durations stay. It is for what is simulated
   (docs/method/live.md#clock): nothing that can push or play a real device accepts it.

   It is a file in memory, of whose path TACTILEQ_CLOCK tells a process. Linux only.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_CLOCK_H
#define TQ_CLOCK_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>
#ifdef _WIN32
#include <windows.h>
#elif defined __APPLE__
#include <mach/mach_time.h>
#include <poll.h>
#include <sched.h>
#else
#include <time.h>
#endif

#define TQ_INNER static inline /* of C alone */

/* Seconds on the computer's clock: that of Python's time.perf_counter. */
TQ_INNER double tq_computer_now(void)
{
#ifdef _WIN32
    LARGE_INTEGER now, rate;
    QueryPerformanceCounter(&now);
    QueryPerformanceFrequency(&rate);
    return (double)now.QuadPart / (double)rate.QuadPart;
#elif defined __APPLE__
    mach_timebase_info_data_t base;
    mach_timebase_info(&base);
    return (double)mach_absolute_time() * base.numer / base.denom * 1e-9;
#else
    struct timespec now; /* no system call, but a page that the kernel maps */
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
#endif
}

/* A time of tq_now, written and read whole. */
TQ_INNER void tq_put_time(uint64_t *place, double time_s)
{
    uint64_t word;
    memcpy(&word, &time_s, 8);
    __atomic_store_n(place, word, __ATOMIC_RELEASE);
}

TQ_INNER double tq_take_time(const uint64_t *place)
{
    uint64_t word = __atomic_load_n(place, __ATOMIC_ACQUIRE);
    double time_s;
    memcpy(&time_s, &word, 8);
    return time_s;
}

#ifndef __linux__
static inline int tq_clock_take(const char *path)
{
    return path != NULL;
}

static inline int tq_clock_given(void)
{
    return 0;
}

static inline double tq_now(void)
{
    return tq_computer_now();
}

static inline int tq_take_part(int takes)
{
    (void)takes;
    return 0;
}

TQ_INNER double tq_expect(double time_s)
{
    return time_s;
}

TQ_INNER void tq_know_place(void)
{
}

static inline void tq_called(double next_s)
{
    (void)next_s;
}

/* Returns at the moment, or soon after. */
static inline void tq_sleep_until(double time_s)
{
    while (tq_now() < time_s) {
#ifdef _WIN32
        Sleep(0);
#else
        sched_yield();
#endif
    }
}
#ifndef _WIN32
/* Waits until one of some descriptors is as wanted, or the moment has come; as poll. */
TQ_INNER int tq_poll_until(struct pollfd *on, nfds_t count, double time_s)
{
    double left_s = time_s - tq_now(), wait_s = left_s < 2e6 ? left_s : 2e6; /* in ms an int */
    return poll(on, count, left_s > 0 ? 1 + (int)(1e3 * wait_s) : 0);
}
#endif

static inline int tq_wait_readable(int one, int other, double time_s)
{
    (void)one, (void)other, (void)time_s;
    return 0;
}

static inline size_t tq_clock_size(void)
{
    return 0;
}

static inline void tq_clock_start(void *clock)
{
    (void)clock;
}

static void tq_clock_run(void *clock)
{
    (void)clock;
}

static inline void tq_clock_end(void *clock)
{
    (void)clock;
}

static inline uint64_t tq_clock_hung(const void *clock)
{
    (void)clock;
    return 0;
}
#else

#include <errno.h>
#include <fcntl.h>
#include <linux/futex.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#define TQ_PLACES 64
#define TQ_SLICE_S 1e-3   /* who waits for another process looks as often at least */
#define TQ_LEAST_S 1e-5   /* each wait: who asks again and again whether it is time lets it pass */
#define TQ_HANGS_S 60.0   /* who is late for so long, by the computer's clock, is waited for no longer */
#define TQ_BEHIND_S 0.01  /* a computer that is late for no longer costs no time */
#define TQ_CALLED_S 3.0   /* who is called by others, for so long: a sound server may have died */
#define TQ_LOOK 32 /* so often the clock is looked at before who is suspended is */
#define TQ_UNKNOWN_S 0.02 /* who is late for so long may have ended, or be suspended on purpose */

/* Who takes part: a thread, and until when it needs nothing. */
struct tq_place {
    uint64_t who;   /* process << 32 | thread; 0: free */
    uint64_t until; /* by tq_put_time */
    uint32_t woken, called; /* called: it does not come by itself */
};
typedef struct tq_place tq_place;

struct tq_clock {
    uint64_t now;     /* by tq_put_time */
    uint64_t ahead;   /* of the computer's clock, once it is ended */
    uint64_t ended, hung; /* hung: who was waited for in vain */
    uint64_t giver;       /* the process that lets it go on */
    tq_place place[TQ_PLACES];
};
typedef struct tq_clock tq_clock;

static tq_clock *tq_the_clock;
static __thread tq_place *tq_own_place;

/* Takes the clock at this path from now on, or the computer's (NULL); not 0 where there is none. Each
   library that a process loads has to be told. */
static inline int tq_clock_take(const char *path)
{
    int file = path ? open(path, O_RDWR | O_CLOEXEC) : -1;
    void *memory;
    tq_the_clock = NULL, tq_own_place = NULL;
    if (file < 0)
        return path != NULL;
    memory = mmap(NULL, sizeof(tq_clock), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    close(file);
    tq_the_clock = memory == MAP_FAILED ? NULL : (tq_clock *)memory;
    return tq_the_clock == NULL;
}

/* Whether the clock is given from outside. */
static inline int tq_clock_given(void)
{
    return tq_the_clock != NULL;
}

/* Ends it: all that follow it go on with the computer's clock, from the same moment. */
static inline void tq_clock_end(void *clock)
{
    tq_clock *c = (tq_clock *)clock;
    tq_put_time(&c->ahead, tq_take_time(&c->now) - tq_computer_now());
    __atomic_store_n(&c->ended, 1, __ATOMIC_RELEASE);
}

static inline double tq_now(void)
{
    const tq_clock *clock = tq_the_clock;
    if (!clock)
        return tq_computer_now();
    if (__atomic_load_n(&clock->ended, __ATOMIC_ACQUIRE))
        return tq_computer_now() + tq_take_time(&clock->ahead);
    return tq_take_time(&clock->now);
}

TQ_INNER uint64_t tq_this_thread(void)
{
    return (uint64_t)getpid() << 32 | (uint64_t)syscall(SYS_gettid);
}

/* Has this library, too, know whether this thread is waited for: each has pointers of its own. */
TQ_INNER void tq_know_place(void)
{
    tq_clock *clock = tq_the_clock;
    uint64_t who = clock ? tq_this_thread() : 0;
    int n;
    tq_own_place = NULL;
    for (n = 0; clock && n < TQ_PLACES; n++)
        if (__atomic_load_n(&clock->place[n].who, __ATOMIC_ACQUIRE) == who)
            tq_own_place = &clock->place[n];
}

/* From now on this thread is waited for (1; 2 where it is called by others), or no longer (0); whether that
   is new. */
static inline int tq_take_part(int takes)
{
    tq_clock *clock = tq_the_clock;
    uint64_t who;
    int n;
    if (!clock || !takes == !tq_own_place)
        return 0;
    who = tq_this_thread();
    if (!takes) {
        __atomic_store_n(&tq_own_place->who, 0, __ATOMIC_RELEASE);
        tq_own_place = NULL;
        return 1;
    }
    for (n = 0; n < TQ_PLACES; n++) {
        uint64_t nobody = 0;
        if (__atomic_load_n(&clock->place[n].who, __ATOMIC_RELAXED))
            continue;
        tq_put_time(&clock->place[n].until, tq_now() + 1e9); /* until it says more */
        if (__atomic_compare_exchange_n(&clock->place[n].who, &nobody, who, 0, __ATOMIC_ACQ_REL, __ATOMIC_RELAXED)) {
            tq_own_place = &clock->place[n];
            tq_own_place->called = takes == 2;
            tq_put_time(&tq_own_place->until, tq_now());
            return 1;
        }
    }
    return 0;
}

/* This thread comes back by then, or a little later, and is waited for if it does not; when. */
TQ_INNER double tq_expect(double time_s)
{
    double least_s = tq_now() + TQ_LEAST_S;
    time_s = time_s < least_s ? least_s : time_s;
    if (tq_own_place)
        tq_put_time(&tq_own_place->until, time_s);
    return time_s;
}

TQ_INNER void tq_doze(long nanoseconds)
{
    struct timespec wait = { 0, nanoseconds };
    nanosleep(&wait, NULL);
}

/* Seconds as the system has them: none below 0, and at most 63 years. */
TQ_INNER struct timespec tq_timespec(double seconds)
{
    struct timespec time;
    seconds = seconds > 0 ? seconds < 2e9 ? seconds : 2e9 : 0;
    time.tv_sec = (time_t)seconds;
    time.tv_nsec = (long)(1e9 * (seconds - (double)time.tv_sec));
    return time;
}

/* Returns at the moment, or soon after. */
static inline void tq_sleep_until(double time_s)
{
    const struct timespec longest = { 0, 20000000 };
    if (!tq_the_clock) {
        const struct timespec until = tq_timespec(time_s);
        while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL) == EINTR) {
        }
        return;
    }
    time_s = tq_expect(time_s);
    while (tq_now() < time_s) {
        if (kill((pid_t)tq_the_clock->giver, 0) && errno == ESRCH && !tq_the_clock->ended)
            tq_clock_end(tq_the_clock); /* it was killed */
        if (tq_own_place && !__atomic_load_n(&tq_the_clock->ended, __ATOMIC_ACQUIRE)) {
            uint32_t woken = __atomic_load_n(&tq_own_place->woken, __ATOMIC_ACQUIRE);
            if (tq_now() < time_s)
                syscall(SYS_futex, &tq_own_place->woken, FUTEX_WAIT, woken, &longest, NULL, 0);
        } else {
            tq_doze(300000);
        }
    }
}

/* Waits until one of some descriptors is as wanted, or the moment has come; as poll. On a given clock it
   returns once a slice, too. */
TQ_INNER int tq_poll_until(struct pollfd *on, nfds_t count, double time_s)
{
    double left_s = time_s - tq_now();
    struct timespec wait = { 0, 0 };
    int found;
    if (!tq_the_clock) {
        wait = tq_timespec(left_s);
        return (int)syscall(SYS_ppoll, on, count, &wait, NULL, 0);
    }
    /* Once before and once after: each look at a pseudo-terminal waits for a thread of the kernel. */
    found = (int)syscall(SYS_ppoll, on, count, &wait, NULL, 0);
    if (found)
        return found;
    tq_sleep_until(left_s > TQ_SLICE_S ? time_s - left_s + TQ_SLICE_S : time_s);
    wait.tv_nsec = 0;
    return (int)syscall(SYS_ppoll, on, count, &wait, NULL, 0);
}

/* Waits for one of two descriptors (-1: none) to be readable until a moment: 1 and 2, both, or 0. */
static inline int tq_wait_readable(int one, int other, double time_s)
{
    struct pollfd on[2];
    memset(on, 0, sizeof on);
    on[0].fd = one, on[1].fd = other;
    on[0].events = on[1].events = POLLIN;
    for (;;) {
        int found = tq_poll_until(on, 2, time_s);
        if (found < 0 && errno == EINTR)
            return 0;
        if (found || tq_now() >= time_s)
            return (on[0].revents != 0) | (on[1].revents != 0) << 1;
    }
}

/* Who is called by others, like a sound card, tells when the next call is due. */
static inline void tq_called(double next_s)
{
    tq_take_part(2);
    tq_expect(next_s);
}

/* --- Who gives the clock ------------------------------------------------------------------------- */

static inline size_t tq_clock_size(void)
{
    return sizeof(tq_clock);
}

/* Whether a thread that is late can come: it is neither gone nor suspended. */
TQ_INNER int tq_can_come(uint64_t who, char *state)
{
    char path[64], text[512], *end;
    int file;
    ssize_t size;
    snprintf(path, sizeof path, "/proc/%u/task/%u/stat", (unsigned)(who >> 32), (unsigned)who);
    file = open(path, O_RDONLY | O_CLOEXEC);
    size = file < 0 ? 0 : read(file, text, sizeof text - 1);
    if (file >= 0)
        close(file);
    text[size < 0 ? 0 : size] = 0;
    end = strrchr(text, ')');
    *state = size > 0 && end && end[1] ? end[2] : 'X';
    return !strchr("XZTt", *state);
}

/* For whom nobody waits: what it last waited for; if suspended, how often the clock was looked at since. */
typedef struct {
    double until_s;
    unsigned suspended;
} tq_absent;

/* The earliest moment for which somebody has to be waited for. Nobody waits for who is gone or hangs, until
   that waits for something else, nor for who is suspended, until that goes on. */
TQ_INNER double tq_earliest(tq_clock *clock, tq_absent *absent, double now_s, double late_s)
{
    double first_s = now_s + 1;
    int n;
    for (n = 0; n < TQ_PLACES; n++) {
        tq_place *place = &clock->place[n];
        uint64_t who = __atomic_load_n(&place->who, __ATOMIC_ACQUIRE);
        double until_s = tq_take_time(&place->until);
        char state = 0;
        if (!who || until_s >= first_s)
            continue;
        if (until_s == absent[n].until_s) {
            if (!absent[n].suspended || ++absent[n].suspended % TQ_LOOK || !tq_can_come(who, &state))
                continue;
            absent[n].until_s = 0;
        }
        if (until_s <= now_s && late_s > TQ_UNKNOWN_S) {
            int comes = tq_can_come(who, &state), called = place->called && late_s > TQ_CALLED_S;
            int hangs = comes && late_s > TQ_HANGS_S;
            if (!comes || hangs || called) {
                absent[n].until_s = until_s;
                absent[n].suspended = state == 'T' || state == 't';
                if (hangs)
                    __atomic_store_n(&clock->hung, who, __ATOMIC_RELEASE);
                if (state == 'X' || state == 'Z')
                    __atomic_store_n(&place->who, 0, __ATOMIC_RELEASE);
                continue;
            }
        }
        first_s = until_s;
    }
    return first_s;
}

TQ_INNER void tq_wake(tq_clock *clock, double now_s, double before_s)
{
    int n;
    for (n = 0; n < TQ_PLACES; n++) {
        tq_place *place = &clock->place[n];
        double until_s = tq_take_time(&place->until);
        if (!__atomic_load_n(&place->who, __ATOMIC_ACQUIRE) || until_s > now_s || until_s <= before_s)
            continue;
        __atomic_add_fetch(&place->woken, 1, __ATOMIC_RELEASE);
        syscall(SYS_futex, &place->woken, FUTEX_WAKE, 1, NULL, NULL, 0);
    }
}

/* Lets the clock at an address go on, until it is ended. It begins at the computer's time. */
static void tq_clock_run(void *clock)
{
    tq_clock *c = (tq_clock *)clock;
    double now_s = tq_take_time(&c->now), seen_s = tq_computer_now(), late_s = 0, behind_s = 0, step_s;
    tq_absent absent[TQ_PLACES] = { 0 };
    while (!__atomic_load_n(&c->ended, __ATOMIC_ACQUIRE)) {
        double first_s = tq_earliest(c, absent, now_s, late_s), real_s = tq_computer_now(), before_s = now_s;
        behind_s += real_s - seen_s; /* the computer's clock; a little of it is caught up */
        step_s = behind_s < TQ_SLICE_S ? behind_s : TQ_SLICE_S;
        if (first_s <= now_s) {
            late_s += real_s - seen_s;
            seen_s = real_s;
            /* Who waits for others must not keep the computer busy. */
            tq_doze(late_s < 1e-3 ? 30000 : late_s < TQ_UNKNOWN_S ? 200000 : 2000000);
            behind_s = behind_s < TQ_BEHIND_S ? behind_s : TQ_BEHIND_S;
            continue;
        }
        late_s = 0, seen_s = real_s;
        now_s = now_s + step_s < first_s ? now_s + step_s : first_s;
        behind_s -= now_s - before_s;
        behind_s = behind_s < TQ_BEHIND_S ? behind_s : TQ_BEHIND_S;
        tq_put_time(&c->now, now_s);
        tq_wake(c, now_s, before_s);
        if (now_s < first_s)
            tq_doze((long)(1e9 * (first_s - now_s < 2e-4 ? first_s - now_s : 2e-4)));
    }
}

/* Begins one in memory of zeros. */
static inline void tq_clock_start(void *clock)
{
    ((tq_clock *)clock)->giver = (uint64_t)getpid();
    tq_put_time(&((tq_clock *)clock)->now, tq_computer_now());
}

/* The last that was waited for in vain, process << 32 | thread; 0 for nobody. */
static inline uint64_t tq_clock_hung(const void *clock)
{
    return __atomic_load_n(&((const tq_clock *)clock)->hung, __ATOMIC_ACQUIRE);
}
#endif

#endif
