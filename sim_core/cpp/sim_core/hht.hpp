// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alpha_family.hpp"

namespace sim_core {

/// HHT-α (Hilber, Hughes & Taylor 1977, Earthq. Eng. Struct. Dyn. 5, 283–292): second order, unconditionally stable
/// for linear systems, spectral radius (1 + α)/(1 − α) at infinite frequency; α = 0 is the trapezoidal rule.
///
///   M a₁ = (1 + α) F₁ − α F₀,   γ = ½ (1 − 2α),   β = ¼ (1 − α)²
class Hht : public AlphaFamily {
  public:
    /// Throws InvalidInput unless −⅓ ≤ alpha ≤ 0.
    explicit Hht(double alpha = -0.1);

    double alpha() const { return alpha_; }

  private:
    static Weights weights(double alpha);
    double alpha_;
};

}  // namespace sim_core
