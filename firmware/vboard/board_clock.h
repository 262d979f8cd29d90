// SPDX-License-Identifier: GPL-3.0-or-later
//
// The map between the board's cycles and true time. Inside the virtual board, times are doubles in
// nanoseconds since power-on: 2^53 ns are 104 days, and a fraction of a cycle is still resolved after weeks.
#ifndef VBOARD_BOARD_CLOCK_H
#define VBOARD_BOARD_CLOCK_H

#include <math.h>
#include <stdint.h>

#include "board_protocol.h"

typedef struct board_clock {
    double cycles_per_ns;
    uint64_t anchor_cycle;  // the rate holds from here
    double anchor_ns;
} board_clock;

static inline double board_clock_ns(const board_clock *clock, uint64_t cycle)
{
    return clock->anchor_ns + ((double)cycle - (double)clock->anchor_cycle) / clock->cycles_per_ns;
}

// The first cycle at or after an instant.
static inline uint64_t board_clock_cycle(const board_clock *clock, double ns)
{
    double cycles = ceil((ns - clock->anchor_ns) * clock->cycles_per_ns);
    return cycles > 0.0 ? clock->anchor_cycle + (uint64_t)cycles : clock->anchor_cycle;
}

// Changes the rate from a cycle on; time stays continuous.
static inline void board_clock_set_ppm(board_clock *clock, uint64_t cycle, double ppm)
{
    if (clock->cycles_per_ns > 0.0)
        clock->anchor_ns = board_clock_ns(clock, cycle);
    clock->anchor_cycle = cycle;
    clock->cycles_per_ns = (double)BOARD_CLOCK_HZ * (1.0 + ppm * 1e-6) * 1e-9;
}

#endif
