// SPDX-License-Identifier: Apache-2.0
// Whatever this machine can do, the water moves by the same bits; and the kernel's functions are as exact as they say.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "sim_core/water.hpp"

namespace {

int failures = 0;

void check(bool holds, const char* what) {
    std::printf("%s: %s\n", holds ? "ok" : "FAILED", what);
    if (!holds) ++failures;
}

using namespace sim_core;

void test_kernels_give_the_same_bits() {
#ifdef SIM_CORE_AVX2
    if (!__builtin_cpu_supports("avx2")) {
        std::printf("this machine has no AVX2: nothing to compare\n");
        return;
    }
    std::mt19937_64 generator(1);
    std::uniform_real_distribution<double> place(-50.0, 5.0);
    bool same = true;
    for (const double depth : {60.0, std::numeric_limits<double>::infinity()}) {
        Jonswap spectrum;
        spectrum.significant_height = 1.0;
        spectrum.peak_period = 4.0;
        spectrum.components = 201;  // not a multiple of the lanes
        spectrum.spreading = 2.0;
        Water water;
        water.waves = jonswap_sea(spectrum, depth, water.gravity, 0.0);
        WaterProbe any(water, kWaveKernel);
        WaterProbe wide(water, kWaveKernelAvx2);
        for (int i = 0; i < 2000; ++i) {
            const Vec3 at(place(generator), place(generator), place(generator));
            any.set_time(7.0 * i);
            wide.set_time(7.0 * i);
            WaterMotion one, other;
            any.at(at, one, true);
            wide.at(at, other, true);
            same = same && std::memcmp(&one, &other, sizeof one) == 0;
        }
    }
    check(same, "both kernels give the same bits");
#endif
}

void test_functions_are_exact() {
    // Single trains against the library's functions: sines and cosines within 2e-16, exponentials within 5e-16 of themselves
    double worst_angle = 0.0;
    double worst_growth = 0.0;
    std::mt19937_64 generator(2);
    std::uniform_real_distribution<double> angle(-1000.0, 1000.0), height(-1000.0, 0.0);
    std::vector<double> zero(kWaveLanes, 0.0), one(kWaveLanes, 1.0), phase(kWaveLanes), k(kWaveLanes, 1.0);
    std::vector<double> weights(kWaveRows * kWaveLanes, 0.0), room(6 * kWaveLanes);
    const WaveArrays trains{kWaveLanes, k.data(), zero.data(), zero.data(), phase.data(), zero.data(), one.data(),
                            weights.data(), &room[0], &room[kWaveLanes], &room[2 * kWaveLanes], &room[3 * kWaveLanes],
                            &room[4 * kWaveLanes], &room[5 * kWaveLanes]};
    SurfaceSums surface;
    DepthSums depth;
    for (int i = 0; i < 100000; ++i) {
        for (double& p : phase) p = angle(generator);
        const double z = height(generator);
        kWaveKernel.surface(trains, 0.0, 0.0, false, surface);
        for (std::size_t lane = 0; lane < kWaveLanes; ++lane) {
            const long double exact = phase[lane];
            worst_angle = std::max(worst_angle, static_cast<double>(std::abs(std::cos(exact) - trains.cosine[lane])));
            worst_angle = std::max(worst_angle, static_cast<double>(std::abs(std::sin(exact) - trains.sine[lane])));
        }
        std::fill_n(trains.cosine, kWaveLanes, 1.0);
        kWaveKernel.below(trains, z, false, depth);
        const long double grown = std::exp(static_cast<long double>(std::max(z, -700.0)));
        worst_growth =
            std::max(worst_growth, static_cast<double>(std::abs((trains.C_cosine[0] - grown) / grown)));
    }
    std::printf("sine and cosine within %.2g, exponential within %.2g\n", worst_angle, worst_growth);
    check(worst_angle < 2e-16, "sines and cosines are exact to rounding");
    check(worst_growth < 5e-16, "and exponentials");
}

}  // namespace

int main() {
    test_kernels_give_the_same_bits();
    test_functions_are_exact();
    return failures == 0 ? 0 : 1;
}
