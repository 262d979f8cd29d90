// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator.hpp"

namespace sim_core {

/// Implicit Euler: v₁ = v₀ + h v̇₁, q₁ = q₀ + h v₁ (Hairer & Wanner 1996, Solving Ordinary Differential Equations II,
/// § IV.3). First order, spectral radius 0 at infinite frequency. It conserves momentum and can only lose
/// energy, also where a line snaps taut; it remembers no acceleration from the step before.
class BackwardEuler : public SingleSolve {
  public:
    double end_share() const override { return 1.0; }
    Rates rates(double h) const override { return {1.0, 1.0 / h, 1.0 / (h * h)}; }
    void predict(State& state, double h) const override;
    void correct(State& state, const std::vector<Vec3>& displacement, double factor, double h) const override;
};

}  // namespace sim_core
