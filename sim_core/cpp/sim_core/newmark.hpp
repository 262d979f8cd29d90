// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alpha_family.hpp"

namespace sim_core {

/// Newmark's method (Newmark 1959, J. Eng. Mech. Div. ASCE 85 EM3, 67–94). β = ¼, γ = ½ is the average
/// acceleration (trapezoidal rule): second order, without any damping. γ > ½ damps, at first order. Only
/// the unconditionally stable methods, 2β ≥ γ ≥ ½ (Hughes 2000, The Finite Element Method, § 9.1).
class Newmark : public AlphaFamily {
  public:
    /// Throws InvalidInput unless 2 beta ≥ gamma ≥ ½ and both are finite.
    explicit Newmark(double beta = 0.25, double gamma = 0.5);

    double beta() const { return beta_; }
    double gamma() const { return gamma_; }

  private:
    static Weights weights(double beta, double gamma);
    double beta_;
    double gamma_;
};

}  // namespace sim_core
