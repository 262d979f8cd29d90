// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "backward_euler.hpp"
#include "forward_euler.hpp"

namespace sim_core {

/// The box scheme (Ablow & Schechter 1983, Ocean Eng. 10, 443–457), centred in space and time. For lumped masses,
/// which are discrete in space, it is the implicit midpoint rule:
///
///   F(q, v, v̇) = 0 at q = ½ (q₀ + q₁), v = ½ (v₀ + v₁), v̇ = (v₁ − v₀)/h,   with q₁ = q₀ + h v
///
/// Second order, no damping at any frequency (on a linear system the trapezoidal rule), symplectic: energy stays bounded
/// as long as the step resolves the motion. What it does not resolve alternates from step to step, the Crank–Nicolson
/// noise (Gobat & Grosenbaugh 2001, Comput. Methods Appl. Mech. Eng. 190, 4817–4829). Taken as implicit Euler to the middle of the step and
/// explicit Euler from there, which is the same; the latter also gives the accelerations at the end.
class Box : public Integrator {
  public:
    int substeps() const override { return 2; }
    Substep substep(int index) const override {
        if (index == 0) return {to_middle_, 0.5};
        return {from_middle_, 0.5};
    }

  private:
    BackwardEuler to_middle_;
    ForwardEuler from_middle_;
};

}  // namespace sim_core
