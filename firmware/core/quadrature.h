// SPDX-License-Identifier: Apache-2.0
//
// Quadrature decoding: every edge of A or B counts one. A leads B when the count rises.
// Inline, because the edge interrupts have only microseconds.
#ifndef QUADRATURE_H
#define QUADRATURE_H

#include <stdint.h>

struct quadrature {
    uint8_t state;          // levels seen last: A in bit 0, B in bit 1
    int32_t count;
    uint8_t edges;          // of either direction; passes its end
    uint32_t illegal_steps; // both channels changed at once: direction unknown, not counted
};

static inline void quadrature_step(struct quadrature *encoder, uint8_t levels)
{
    enum { ILLEGAL = 2 };
    // Indexed by old levels · 4 + new levels. Rising sequence BA: 00 01 11 10 00.
    static const int8_t steps[16] = {
        0,       +1,      -1,      ILLEGAL, //
        -1,      0,       ILLEGAL, +1,      //
        +1,      ILLEGAL, 0,       -1,      //
        ILLEGAL, -1,      +1,      0,       //
    };
    int8_t step = steps[(uint8_t)(encoder->state << 2 | levels)];
    encoder->state = levels;
    encoder->edges++;
    if (step == ILLEGAL)
        encoder->illegal_steps++;
    else
        encoder->count += step;
}

#endif
