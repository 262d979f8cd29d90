// SPDX-License-Identifier: Apache-2.0
#include "newmark.hpp"

#include <cmath>

#include "error.hpp"

namespace sim_core {

Newmark::Newmark(double beta, double gamma) : AlphaFamily(weights(beta, gamma)), beta_(beta), gamma_(gamma) {}

AlphaFamily::Weights Newmark::weights(double beta, double gamma) {
    if (!(2.0 * beta >= gamma && gamma >= 0.5) || !std::isfinite(beta)) {
        throw InvalidInput("beta and gamma must be finite with 2 beta >= gamma >= 0.5, or Newmark is not stable");
    }
    return newmark_weights(0.0, 0.0, beta, gamma);
}

}  // namespace sim_core
