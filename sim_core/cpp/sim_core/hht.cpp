// SPDX-License-Identifier: Apache-2.0
#include "hht.hpp"

#include "error.hpp"

namespace sim_core {

Hht::Hht(double alpha) : AlphaFamily(weights(alpha)), alpha_(alpha) {}

AlphaFamily::Weights Hht::weights(double alpha) {
    // No literal is −⅓ exactly: one rounding beyond it is meant to be it.
    if (!(alpha >= -1.0 / 3.0 - 1e-12 && alpha <= 0.0)) throw InvalidInput("alpha must lie between -1/3 and 0");
    return newmark_weights(0.0, -alpha, 0.25 * (1.0 - alpha) * (1.0 - alpha), 0.5 - alpha);
}

}  // namespace sim_core
