// SPDX-License-Identifier: Apache-2.0
#include "single_step_houbolt.hpp"

#include "error.hpp"

namespace sim_core {

SingleStepHoubolt::SingleStepHoubolt(double gamma_1) : AlphaFamily(weights(gamma_1)), gamma_1_(gamma_1) {}

AlphaFamily::Weights SingleStepHoubolt::weights(double gamma_1) {
    if (!(gamma_1 >= 0.5 && gamma_1 <= 1.5)) throw InvalidInput("gamma_1 must lie between 0.5 and 1.5");
    const double beta_1 = 0.5 * (0.5 + gamma_1);
    const double gamma_0 = 0.5 * (0.5 - gamma_1);
    // 2 a₁ − a₀ = v̇₁: αm = −1, αf = 0.
    return {-1.0, 0.0, (0.5 - beta_1) / beta_1, 1.0, gamma_0 / beta_1, gamma_1 / beta_1};
}

}  // namespace sim_core
