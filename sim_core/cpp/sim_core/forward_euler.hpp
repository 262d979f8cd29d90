// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator.hpp"

namespace sim_core {

/// Explicit Euler: q₁ = q₀ + h v₀, v₁ = v₀ + h v̇₀ (Hairer, Nørsett & Wanner 1993, Solving Ordinary Differential
/// Equations I, § I.7). First order. It makes energy: a mode of frequency ω and damping ratio ζ < 1 grows unless
/// h ≤ 2ζ/ω, an undamped one always. The mass matrix is not diagonal, so there is still a linear system to solve.
/// Solved for the accelerations at the end, in which F is linear: one Newton iteration.
class ForwardEuler : public SingleSolve {
  public:
    /// An unstable step makes lines snap: implicit Euler there would hide it.
    bool damps_snaps() const override { return false; }
    double end_share() const override { return 0.0; }
    /// Its step follows from stability, of which the estimate knows nothing.
    bool adaptive() const override { return false; }
    Rates rates(double) const override { return {0.0, 0.0, 1.0}; }
    void predict(State& state, double h) const override;
    void correct(State& state, const std::vector<Vec3>& acceleration, double factor, double h) const override;
};

}  // namespace sim_core
