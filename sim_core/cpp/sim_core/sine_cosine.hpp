// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include <Eigen/Dense>

namespace sim_core {

/// Sines and cosines of many angles (rad, up to 1e6) at once, within 2e-16 of the exact values.
///
/// A plain loop without branches, which compilers vectorise; the library's functions take one angle at a time, and may
/// differ in the last bit from machine to machine. Reduction to ±π/4 by Cody & Waite in three parts (π/2 as in fdlibm),
/// then Taylor's polynomials, whose first neglected terms are below 1e-17 there.
inline void sine_cosine(const Eigen::ArrayXd& angle, Eigen::ArrayXd& sine, Eigen::ArrayXd& cosine) {
    constexpr double kRound = 6755399441055744.0;  // 1.5 · 2⁵²: adding and subtracting it rounds to an integer
    constexpr double kTwoOverPi = 0.636619772367581343076;
    constexpr double kHalfPi1 = 1.57079632673412561417;  // 33 bits, so that n times it is exact
    constexpr double kHalfPi2 = 6.07710050630396597660e-11;
    constexpr double kHalfPi3 = 2.02226624879595063154e-21;
    const Eigen::Index count = angle.size();
    const double* in = angle.data();
    double* out_sine = sine.data();
    double* out_cosine = cosine.data();
    for (Eigen::Index i = 0; i < count; ++i) {
        const double n = (in[i] * kTwoOverPi + kRound) - kRound;
        const double r = ((in[i] - n * kHalfPi1) - n * kHalfPi2) - n * kHalfPi3;
        const double q = r * r;
        double s = -1.0 / 1307674368000.0;
        s = s * q + 1.0 / 6227020800.0;
        s = s * q - 1.0 / 39916800.0;
        s = s * q + 1.0 / 362880.0;
        s = s * q - 1.0 / 5040.0;
        s = s * q + 1.0 / 120.0;
        s = s * q - 1.0 / 6.0;
        s = r + r * q * s;
        double c = 1.0 / 20922789888000.0;
        c = c * q - 1.0 / 87178291200.0;
        c = c * q + 1.0 / 479001600.0;
        c = c * q - 1.0 / 3628800.0;
        c = c * q + 1.0 / 40320.0;
        c = c * q - 1.0 / 720.0;
        c = c * q + 1.0 / 24.0;
        c = 1.0 - (0.5 * q - q * q * c);
        // Turn by n quarters: the quarter in −½ … ½ of a turn, then its cosine and sine, which are 0 or ±1
        const double turns = 0.25 * n;
        const double quarter = turns - ((turns + kRound) - kRound);
        const double away = 4.0 * std::abs(quarter);
        const double cosine_n = 1.0 - away;
        const double sine_n = 4.0 * quarter * (2.0 - away);
        out_sine[i] = sine_n * c + cosine_n * s;
        out_cosine[i] = cosine_n * c - sine_n * s;
    }
}

}  // namespace sim_core
