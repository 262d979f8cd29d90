// SPDX-License-Identifier: GPL-3.0-or-later
//
// Seeded random numbers (SplitMix64, Steele, Lea and Flood 2014): one small state for each use, so that
// switching one fault on does not change another's sequence or the noise.
#ifndef VBOARD_RANDOM_H
#define VBOARD_RANDOM_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

typedef struct random_source {
    uint64_t state;
} random_source;

static inline uint64_t random_u64(random_source *source)
{
    uint64_t z = source->state += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

// Uniform in (0, 1): never 0, so that its logarithm is finite.
static inline double random_uniform(random_source *source)
{
    return ((double)(random_u64(source) >> 11) + 0.5) * 0x1p-53;
}

static inline bool random_chance(random_source *source, double probability)
{
    return probability > 0.0 && random_uniform(source) < probability;
}

// Standard normal, by Box and Muller.
static inline double random_normal(random_source *source)
{
    double radius = sqrt(-2.0 * log(random_uniform(source)));
    return radius * cos(2.0 * 3.14159265358979323846 * random_uniform(source));
}

// An independent stream for each use of one seed.
static inline random_source random_stream(uint64_t seed, uint64_t stream)
{
    random_source source = {seed};
    source.state = random_u64(&source) ^ (stream * 0xD1342543DE82EF95u);
    return source;
}

#endif
