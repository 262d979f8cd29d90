// SPDX-License-Identifier: Apache-2.0
#include "generalized_alpha.hpp"

#include "error.hpp"

namespace sim_core {

GeneralizedAlpha::GeneralizedAlpha(double rho_inf) : AlphaFamily(weights(rho_inf)), rho_inf_(rho_inf) {}

AlphaFamily::Weights GeneralizedAlpha::weights(double rho_inf) {
    if (!(rho_inf >= 0.0 && rho_inf <= 1.0)) throw InvalidInput("rho_inf must lie between 0 and 1");
    const double alpha_m = (2.0 * rho_inf - 1.0) / (rho_inf + 1.0);
    const double alpha_f = rho_inf / (rho_inf + 1.0);
    const double sum = 1.0 + alpha_f - alpha_m;
    return newmark_weights(alpha_m, alpha_f, 0.25 * sum * sum, 0.5 + alpha_f - alpha_m);
}

}  // namespace sim_core
