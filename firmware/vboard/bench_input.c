// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench_input.h"

#include <stdlib.h>

void bench_input_free(bench_input *input)
{
    free(input->ring);
    *input = (bench_input){0};
}

static bool grow(bench_input *input)
{
    size_t capacity = input->capacity ? 2 * input->capacity : 64;
    bench_sample *ring = malloc(capacity * sizeof *ring);
    if (!ring)
        return false;
    for (uint64_t i = input->first; i < input->end; i++)
        ring[i & (capacity - 1)] = *bench_input_at(input, i);
    free(input->ring);
    input->ring = ring;
    input->capacity = capacity;
    return true;
}

static bool append(bench_input *input, const bench_sample *sample)
{
    if (input->end - input->first == input->capacity && !grow(input))
        return false;
    input->ring[input->end & (input->capacity - 1)] = *sample;
    input->end++;
    return true;
}

bool bench_input_push(bench_input *input, const bench_sample *sample, double now_ns)
{
    if (sample->time_ns <= now_ns)
        return false;
    if (input->end > input->first) {
        bench_sample held = *bench_input_at(input, input->end - 1);
        if (sample->time_ns <= held.time_ns)
            return false;
        if (held.time_ns < now_ns) {
            held.time_ns = now_ns;
            if (!append(input, &held))
                return false;
        }
    }
    return append(input, sample);
}

void bench_input_discard_before(bench_input *input, uint64_t index)
{
    if (index > input->first)
        input->first = index;
}
