// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "equations.hpp"
#include "state.hpp"

namespace sim_core {

/// A one-step implicit scheme, solved for the positions at the end of the step.
///
/// The equations of motion F(q₁, v₁, v̇₁) = 0 hold at the end of each step; a scheme says how v₁ and v̇₁ follow
/// q₁. Rotations advance by the rotation vector of the step in body axes (q₁ = q₀ exp(turn)), with the angular
/// velocity and its rate in body axes, so that all blocks of unknowns are treated alike.
class Integrator {
  public:
    virtual ~Integrator() = default;

    /// dv₁/dq₁ and dv̇₁/dq₁ for a step of size h (s).
    virtual Rates rates(double h) const = 0;

    /// First guess at the end of a step, from the state at its start. Moves free sites and bodies.
    virtual void predict(State& state, double h) const = 0;

    /// Adds factor times a displacement (per block of unknowns) and what follows from it to the state at the end.
    virtual void correct(State& state, const std::vector<Vec3>& displacement, double factor, double h) const = 0;
};

}  // namespace sim_core
