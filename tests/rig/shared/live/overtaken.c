/* A reader of the shared memory whom the writer overtakes, at every moment of a copy in turn.

   Prints at how many moments, the fewest and the most rows that were left, and how many of them held
   something else than their own number. */

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

static void moment(void);
#define __atomic_load_n(place, order) (moment(), __atomic_load_n(place, order))
#include "live.h"

enum { ROWS = 4, BEGUN_WORDS = 3 };

static tq_live live;
static long moments, overtaken_at;

static tq_reading row_of(uint64_t number)
{
    double n = (double)number;
    tq_reading row = {n, n, n, n, n, n, (uint32_t)number, 0};
    return row;
}

static void write_row(uint64_t number)
{
    double n = (double)number;
    tq_write_reading(&live, n, n, n, n, n, n, (uint32_t)number);
}

/* At the chosen one the writer writes a whole row, and the beginning of the next. */
static void moment(void)
{
    uint64_t next = live.readings;
    tq_reading begun = row_of(next + 1);
    if (moments++ != overtaken_at)
        return;
    write_row(next);
    tq_put(live.reading[(next + 1) & (TQ_RING - 1)], &begun, BEGUN_WORDS);
}

int main(void)
{
    tq_reading rows[ROWS], wanted;
    uint64_t first, i;
    size_t count, fewest = ROWS, most = 0;
    long last, torn = 0;
    overtaken_at = -1;
    do {
        memset(&live, 0, sizeof live);
        moments = 0, last = overtaken_at, overtaken_at = -1;
        for (i = 0; i < TQ_RING + 100; i++)
            write_row(i);
        moments = 0, overtaken_at = last + 1;
        count = tq_readings(&live, 0, rows, ROWS, &first);
        for (i = 0; i < count; i++)
            wanted = row_of(first + i), torn += memcmp(&rows[i], &wanted, sizeof wanted) != 0;
        fewest = count < fewest ? count : fewest, most = count > most ? count : most;
    } while (moments > overtaken_at);
    printf("%ld %zu %zu %ld\n", overtaken_at, fewest, most, torn);
    return 0;
}
