// SPDX-License-Identifier: GPL-3.0-or-later
//
// A quadrature encoder that follows the bench's angle: one edge at a time, each at the instant at which the
// straight line between two samples crosses a count. The count at every sample is exactly
// floor(angle · counts per revolution / 2π), relative to the first sample's.
#ifndef VBOARD_ENCODER_H
#define VBOARD_ENCODER_H

#include "bench_input.h"

typedef struct encoder {
    const bench_input *input;
    int which;  // ENCODER_CRANK or ENCODER_CARRIAGE
    double counts_per_rad;

    uint64_t cursor;  // index of the sample at the start of the current piece
    bool follows;     // the first sample after (re)start has fixed the origin
    double offset;    // floor(angle · counts_per_rad) − counts at the first sample
    int64_t counts;   // net edges since power-on
    uint64_t edges;   // all edges since power-on
    double last_edge_ns;
} encoder;

void encoder_init(encoder *self, const bench_input *input, int which, uint32_t counts_per_revolution);

// Forgets the angle: the next sample becomes the present count.
void encoder_restart(encoder *self);

// The next edge in the samples known so far: its instant and its direction (±1). False if there is none yet.
bool encoder_next_edge(encoder *self, double *time_ns, int *direction);

// Takes that edge.
void encoder_step(encoder *self, double time_ns, int direction);

// Levels of the two lines; A leads B when the counts rise.
static inline bool encoder_a(const encoder *self)
{
    return (self->counts + 1) & 2;
}
static inline bool encoder_b(const encoder *self)
{
    return self->counts & 2;
}

#endif
