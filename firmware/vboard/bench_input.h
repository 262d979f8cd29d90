// SPDX-License-Identifier: GPL-3.0-or-later
//
// What the bench says about the board's terminals: a queue of samples in order of time, with straight lines
// between them. Several readers go through it, each with its own index.
#ifndef VBOARD_BENCH_INPUT_H
#define VBOARD_BENCH_INPUT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "board_protocol.h"

enum { ENCODER_CRANK, ENCODER_CARRIAGE, ENCODER_COUNT };

typedef struct bench_sample {
    double time_ns;  // since power-on
    double volts[BOARD_CHANNEL_COUNT];
    double angle_rad[ENCODER_COUNT];
} bench_sample;

typedef struct bench_input {
    bench_sample *ring;
    size_t capacity;  // a power of two, or 0
    uint64_t first;   // index of the oldest sample kept
    uint64_t end;     // index behind the newest
} bench_input;

void bench_input_free(bench_input *input);

static inline const bench_sample *bench_input_at(const bench_input *input, uint64_t index)
{
    return &input->ring[index & (input->capacity - 1)];
}

// Appends a sample. False, and nothing changed, if it lies at or before `now_ns` or the newest sample. If the
// queue had run dry, the value held until now is recorded first: what the board has seen stays true.
bool bench_input_push(bench_input *input, const bench_sample *sample, double now_ns);

// Forgets the samples that no reader needs any more.
void bench_input_discard_before(bench_input *input, uint64_t index);

#endif
