// SPDX-License-Identifier: Apache-2.0
// Where energy and momentum go in a simulation.
#pragma once

#include "forces_by_kind.hpp"

namespace sim_core {

/// Since the balance began, J. Stored energy changes by the work done on the system:
///   kinetic + potential + elastic = tow_points + buoyancy + added_mass + drag + damping + other + impact + numerical
struct EnergyBalance {
    double kinetic = 0.0;    ///< change, of the system's own mass
    double potential = 0.0;  ///< change, of weight
    double elastic = 0.0;    ///< change, of tension and bending
    double tow_points = 0.0;   ///< work of the forces that move the prescribed points
    double buoyancy = 0.0;     ///< work of each kind of force, see ForceKind
    double added_mass = 0.0;
    double drag = 0.0;
    double damping = 0.0;
    double other = 0.0;
    double impact = 0.0;     ///< what the steps of implicit Euler lose in which a line snaps (see Simulator): an inelastic impact
    double numerical = 0.0;  ///< what the integration in time makes or loses: the remainder
    /// What has passed from one of these forms to another in all, half the sum of all amounts of all steps: the measure for
    /// the remainder.
    double exchanged = 0.0;
};

/// Since the balance began, N·s, tank axes. The momentum of the system's own mass changes by the impulses of external forces:
///   change = tow_points + weight + buoyancy + added_mass + drag + other + numerical
struct MomentumBalance {
    Vec3 change = Vec3::Zero();
    Vec3 tow_points = Vec3::Zero();
    Vec3 weight = Vec3::Zero();
    Vec3 buoyancy = Vec3::Zero();
    Vec3 added_mass = Vec3::Zero();
    Vec3 drag = Vec3::Zero();
    Vec3 other = Vec3::Zero();
    Vec3 numerical = Vec3::Zero();
};

/// Adds up the balances of a simulation, step by step.
///
/// Work in a step is (1 − s) F₀·Δx + s F₁·Δx, with the share s of the end that the integrator has in the impulse of a step
/// (Integrator::end_share): to the order of the integrator the work of the true motion. Stored energies are taken from the
/// state. So the remainder is the error of the integration in time, its numerical damping included; forces that nobody has
/// classified are counted as `other`.
class Balance {
  public:
    explicit Balance(const Model& model);

    /// Starts from nought. `equations` must have been evaluated at `state`.
    void begin(const Equations& equations, const State& state);

    /// The balance of a step alone, before the attitudes are rebased; `equations` must have been evaluated at its end.
    const EnergyBalance& measure_step(const State& start, const State& end, const Equations& equations,
                                      double end_share, bool impact);

    /// Adds the step measured last. One that is not taken is measured and not added.
    void add_step();

    const EnergyBalance& energy() const { return energy_; }
    const MomentumBalance& momentum() const { return momentum_; }

  private:
    /// Kinetic energy and momentum of what moves freely, energy of weight and springs.
    struct Stored {
        double kinetic, potential, elastic;
        Vec3 momentum;
    };
    static Stored stored(const State& state);
    void measure(const Equations& equations, const State& state);
    double work(ForceKind kind) const;
    Vec3 impulse(ForceKind kind, const State& state) const;

    ForcesByKind start_forces_, end_forces_;
    std::vector<Vec3> start_tow_, end_tow_;  ///< forces on the prescribed points, N
    Stored start_, end_;
    EnergyBalance step_energy_;
    MomentumBalance step_momentum_;
    std::vector<Vec3> displacement_;         ///< per entry, m and rad
    double end_share_ = 0.5;
    double step_ = 0.0;                      ///< s
    EnergyBalance energy_;
    MomentumBalance momentum_;
};

}  // namespace sim_core
