// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "equations.hpp"
#include "state.hpp"

namespace sim_core {

/// One solution of the equations of motion F(q₁, v₁, v̇₁) = 0 at the end of a span of time; a scheme says how
/// q₁, v₁ and v̇₁ follow one vector of unknowns, and Newton's iteration finds it (see newton.hpp).
///
/// Rotations advance by the rotation vector of the step in body axes (q₁ = q₀ exp(turn)), with the angular velocity
/// and its rate in body axes, so that all blocks of unknowns are treated alike.
class Scheme {
  public:
    virtual ~Scheme() = default;

    /// How q₁, v₁ and v̇₁ follow the unknowns over a span of h (s).
    virtual Rates rates(double h) const = 0;

    /// First guess at the end of the span, from the state at its start. Moves free sites and bodies.
    virtual void predict(State& state, double h) const = 0;

    /// Adds factor times a change of the unknowns (per block) and what follows from it to the state at the end.
    virtual void correct(State& state, const std::vector<Vec3>& change, double factor, double h) const = 0;
};

/// A part of a step: a scheme and the fraction of the step that it spans.
struct Substep {
    const Scheme& scheme;
    double fraction;
};

/// A one-step time integrator: the substeps that make up a step, one after the other.
class Integrator {
  public:
    virtual ~Integrator() = default;

    virtual int substeps() const = 0;
    virtual Substep substep(int index) const = 0;

    /// The share of the end's forces in the impulse of a step, the rest is the start's.
    virtual double end_share() const { return 0.5; }

    /// Whether the simulator may choose the step by an estimate of its error (see StepControl).
    virtual bool adaptive() const { return true; }

    /// Whether the simulator may take a step with implicit Euler instead where a line snaps unresolved (see Simulator).
    virtual bool damps_snaps() const { return true; }
};

/// An integrator whose step is one solution of the equations of motion.
class SingleSolve : public Integrator, public Scheme {
  public:
    int substeps() const final { return 1; }
    Substep substep(int) const final { return {*this, 1.0}; }
};

}  // namespace sim_core
