// SPDX-License-Identifier: Apache-2.0
// Compiled twice: see wave_kernel.hpp. SIM_CORE_WAVE_KERNEL is the name of the build.
#include "wave_kernel.hpp"

#include <cstdint>

#ifndef SIM_CORE_WAVE_KERNEL
#define SIM_CORE_WAVE_KERNEL kWaveKernel
#endif

namespace sim_core {

namespace {

// Vectors of the compiler (GCC and Clang), which it cuts to what the machine has
constexpr std::size_t kLanes = kWaveLanes;
using Lanes [[gnu::vector_size(8 * kLanes)]] = double;
using Bits [[gnu::vector_size(8 * kLanes)]] = std::uint64_t;
using InMemory [[gnu::vector_size(8 * kLanes), gnu::aligned(8), gnu::may_alias]] = double;

// Added and subtracted it rounds to an integer, which stands in the last bits in between: 1.5 · 2⁵²
constexpr double kRound = 6755399441055744.0;

[[gnu::always_inline]] inline void load(const double* from, Lanes& to) {
    to = *reinterpret_cast<const InMemory*>(from);
}

[[gnu::always_inline]] inline void store(const Lanes& from, double* to) { *reinterpret_cast<InMemory*>(to) = from; }

/// Reduction to ±π/4 by Cody & Waite in three parts (π/2 as in fdlibm), then Taylor's polynomials, whose first neglected terms
/// are below 1e-17 there.
[[gnu::always_inline]] inline void sine_cosine(const Lanes& angle, Lanes& sine, Lanes& cosine) {
    constexpr double kTwoOverPi = 0.636619772367581343076;
    constexpr double kHalfPi1 = 1.57079632673412561417;  // 33 bits, so that n times it is exact
    constexpr double kHalfPi2 = 6.07710050630396597660e-11;
    constexpr double kHalfPi3 = 2.02226624879595063154e-21;
    const Lanes rounded = angle * kTwoOverPi + kRound;
    const Lanes n = rounded - kRound;
    const Lanes r = ((angle - n * kHalfPi1) - n * kHalfPi2) - n * kHalfPi3;
    const Lanes q = r * r;
    Lanes s = q * (-1.0 / 1307674368000.0) + 1.0 / 6227020800.0;
    s = s * q - 1.0 / 39916800.0;
    s = s * q + 1.0 / 362880.0;
    s = s * q - 1.0 / 5040.0;
    s = s * q + 1.0 / 120.0;
    s = s * q - 1.0 / 6.0;
    s = r + r * q * s;
    Lanes c = q * (1.0 / 20922789888000.0) - 1.0 / 87178291200.0;
    c = c * q + 1.0 / 479001600.0;
    c = c * q - 1.0 / 3628800.0;
    c = c * q + 1.0 / 40320.0;
    c = c * q - 1.0 / 720.0;
    c = c * q + 1.0 / 24.0;
    c = 1.0 - (0.5 * q - q * q * c);
    // Turn by n quarters: odd ones change sine and cosine, the second bit their signs
    const Bits quarters = reinterpret_cast<Bits>(rounded);
    const Bits s_bits = reinterpret_cast<Bits>(s);
    const Bits c_bits = reinterpret_cast<Bits>(c);
    const Bits change = (s_bits ^ c_bits) & -(quarters & 1u);
    const Bits sine_bits = (s_bits ^ change) ^ ((quarters & 2u) << 62);
    const Bits cosine_bits = (c_bits ^ change) ^ (((quarters + 1u) & 2u) << 62);
    sine = reinterpret_cast<Lanes>(sine_bits);
    cosine = reinterpret_cast<Lanes>(cosine_bits);
}

/// e^x and e^−x for x ≤ 0; below −700, where e^x is nothing, as at −700. With x = n ln 2 + r, |r| ≤ ln 2 / 2: Taylor's even
/// and odd terms, the first neglected ones below 1e-17.
[[gnu::always_inline]] inline void exponentials(const Lanes& exponent, Lanes& grow, Lanes& fall) {
    constexpr double kPerLog2 = 1.44269504088896340736;
    constexpr double kLog2Head = 6.93147180369123816490e-01;  // as in fdlibm: 32 bits, so that n times it is exact
    constexpr double kLog2Tail = 1.90821492927058770002e-10;
    constexpr double kLowest = -700.0;
    const Lanes above = exponent - kLowest;
    const Lanes lowest = Lanes{} + kLowest;
    const Bits too_low = -(reinterpret_cast<Bits>(above) >> 63);
    const Bits held = (reinterpret_cast<Bits>(exponent) & ~too_low) |
                      (reinterpret_cast<Bits>(lowest) & too_low);
    const Lanes x = reinterpret_cast<Lanes>(held);
    const Lanes rounded = x * kPerLog2 + kRound;
    const Lanes n = rounded - kRound;
    const Lanes r = (x - n * kLog2Head) - n * kLog2Tail;
    const Lanes q = r * r;
    Lanes odd = q * (1.0 / 6227020800.0) + 1.0 / 39916800.0;
    odd = odd * q + 1.0 / 362880.0;
    odd = odd * q + 1.0 / 5040.0;
    odd = odd * q + 1.0 / 120.0;
    odd = odd * q + 1.0 / 6.0;
    odd = (odd * q + 1.0) * r;
    Lanes even = q * (1.0 / 479001600.0) + 1.0 / 3628800.0;
    even = even * q + 1.0 / 40320.0;
    even = even * q + 1.0 / 720.0;
    even = even * q + 1.0 / 24.0;
    even = even * q + 0.5;
    even = even * q + 1.0;
    const Lanes one = Lanes{} + 1.0;
    const Bits shift = reinterpret_cast<Bits>(rounded) << 52;  // n in the place of the exponent
    const Bits up = reinterpret_cast<Bits>(one) + shift;
    const Bits down = reinterpret_cast<Bits>(one) - shift;
    grow = (even + odd) * reinterpret_cast<Lanes>(up);
    fall = (even - odd) * reinterpret_cast<Lanes>(down);
}

/// Sums of `of` with each row of weights, added up lane by lane.
template <int rows>
[[gnu::always_inline]] inline void add_up(const double* weights, const double* of, std::size_t count, double* sums) {
    Lanes sum[rows] = {};
    for (std::size_t i = 0; i < count; i += kLanes) {
        Lanes value;
        load(of + i, value);
        for (int row = 0; row < rows; ++row) {
            Lanes weight;
            load(weights + static_cast<std::size_t>(row) * count + i, weight);
            sum[row] += weight * value;
        }
    }
    for (int row = 0; row < rows; ++row) sums[row] = (sum[row][0] + sum[row][2]) + (sum[row][1] + sum[row][3]);
}

/// Of the first `few` rows of weights, or of all `many` of them where the water's curvature is wanted.
template <int few, int many>
[[gnu::always_inline]] inline void add_up(bool curved, const double* weights, const double* of, std::size_t count,
                                          double* sums) {
    if (curved) {
        add_up<many>(weights, of, count, sums);
    } else {
        add_up<few>(weights, of, count, sums);
    }
}

void surface(const WaveArrays& trains, double x, double y, bool curved, SurfaceSums& sums) {
    const WaveArrays t = trains;
    for (std::size_t i = 0; i < t.count; i += kLanes) {
        Lanes k_x, k_y, phase, sine, cosine;
        load(t.k_x + i, k_x);
        load(t.k_y + i, k_y);
        load(t.phase + i, phase);
        sine_cosine(k_x * x + k_y * y + phase, sine, cosine);
        store(sine, t.sine + i);
        store(cosine, t.cosine + i);
    }
    const double* weights = t.weights;
    add_up<kOfCosine, kOfCosineCurved>(curved, weights, t.cosine, t.count, sums.cosine);
    weights += kOfCosineCurved * t.count;
    add_up<kOfSine>(weights, t.sine, t.count, sums.sine);
}

void below(const WaveArrays& trains, double z, bool curved, DepthSums& sums) {
    const WaveArrays t = trains;
    for (std::size_t i = 0; i < t.count; i += kLanes) {
        Lanes k, decay, finite, sine, cosine, grow, fall;
        load(t.k + i, k);
        load(t.decay + i, decay);
        load(t.finite + i, finite);
        load(t.sine + i, sine);
        load(t.cosine + i, cosine);
        exponentials(k * z, grow, fall);
        fall *= decay;
        const Lanes C = finite * (grow + fall);
        const Lanes S = finite * (grow - fall);
        store(C * cosine, t.C_cosine + i);
        store(C * sine, t.C_sine + i);
        store(S * cosine, t.S_cosine + i);
        store(S * sine, t.S_sine + i);
    }
    const double* weights = t.weights + (kOfCosineCurved + kOfSine) * t.count;
    add_up<kOfCCosine, kOfCCosineCurved>(curved, weights, t.C_cosine, t.count, sums.C_cosine);
    weights += kOfCCosineCurved * t.count;
    add_up<kOfCSine>(weights, t.C_sine, t.count, sums.C_sine);
    weights += kOfCSine * t.count;
    add_up<kOfSCosine>(weights, t.S_cosine, t.count, sums.S_cosine);
    weights += kOfSCosine * t.count;
    add_up<kOfSSine, kOfSSineCurved>(curved, weights, t.S_sine, t.count, sums.S_sine);
}

}  // namespace

const WaveKernel SIM_CORE_WAVE_KERNEL{surface, below};

}  // namespace sim_core
