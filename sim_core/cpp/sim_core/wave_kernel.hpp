// SPDX-License-Identifier: Apache-2.0
// The sums over wave trains, which are nearly all that waves cost. Compiled for every machine, and once more for the wider
// registers of AVX2: the same operations in the same order on the same four lanes, so that both give the same bits.
// No inline function of a library may come in here: the linker could take the version of the wider machine for all.
#pragma once

#include <cstddef>

namespace sim_core {

/// Wave trains as arrays, each of `count` numbers, a multiple of kWaveLanes (trains of no amplitude fill it up).
/// θ = k_x x + k_y y + phase; C, S = cosh, sinh k(z + d) / sinh kd = finite (e^kz ± decay e^−kz).
struct WaveArrays {
    std::size_t count;
    const double* k;         ///< 1/m
    const double* k_x;
    const double* k_y;
    const double* phase;     ///< at the instant, rad
    const double* decay;     ///< e^−2kd
    const double* finite;    ///< 1/(1 − decay)
    const double* weights;   ///< rows of `count`: what each sum below takes of each train
    double* cosine;          ///< room, from one call to the next
    double* sine;
    double* C_cosine;
    double* C_sine;
    double* S_cosine;
    double* S_sine;
};

inline constexpr std::size_t kWaveLanes = 4;

/// Rows of weights, and how many sums of each kind: without and with those that only a curved motion needs.
inline constexpr int kOfCosine = 1, kOfCosineCurved = 4;
inline constexpr int kOfSine = 2;
inline constexpr int kOfCCosine = 5, kOfCCosineCurved = 9;
inline constexpr int kOfCSine = 5;
inline constexpr int kOfSCosine = 3;
inline constexpr int kOfSSine = 3, kOfSSineCurved = 6;
inline constexpr int kWaveRows =
    kOfCosineCurved + kOfSine + kOfCCosineCurved + kOfCSine + kOfSCosine + kOfSSineCurved;

struct SurfaceSums {
    double cosine[kOfCosineCurved];
    double sine[kOfSine];
};

struct DepthSums {
    double C_cosine[kOfCCosineCurved];
    double C_sine[kOfCSine];
    double S_cosine[kOfSCosine];
    double S_sine[kOfSSineCurved];
};

/// One build of the kernel. `surface` finds sines and cosines of all trains at a place; `below` goes on with them at a
/// height z ≤ 0. Sines and cosines are within 2e-16 up to θ = 1e6, exponentials within 5e-16 of themselves.
struct WaveKernel {
    void (*surface)(const WaveArrays& trains, double x, double y, bool curved, SurfaceSums& sums);
    void (*below)(const WaveArrays& trains, double z, bool curved, DepthSums& sums);
};

extern const WaveKernel kWaveKernel;
extern const WaveKernel kWaveKernelAvx2;  ///< where SIM_CORE_AVX2 is defined, for machines that have it

}  // namespace sim_core
