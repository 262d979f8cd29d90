// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "equations.hpp"
#include "state.hpp"

namespace sim_core {

/// What the forces in the equations of motion come from. For every place they sum up to the force that
/// Equations::evaluate finds there.
enum class ForceKind {
    weight,
    inertia,      ///< of the system's own mass
    elastic,      ///< tension without damping, bending
    damping,      ///< structural: what of the tension depends on the rate of strain
    buoyancy,     ///< of what rests in the water: with waves, their pressure too
    added_mass,   ///< what depends on accelerations, beside the system's own mass
    drag,         ///< what depends on velocities through the water: drag, lift, Munk moment
    other,        ///< everything else; nothing goes missing
};
inline constexpr int kForceKinds = 8;

/// Forces of each kind per entry of State: on sites and bodies in tank axes (N), moments of bodies about their origin in
/// body axes (N·m). Forces of a line on a body stand at the site where it is attached.
class ForcesByKind {
  public:
    explicit ForcesByKind(const Model& model);

    /// Takes the forces apart. `equations` must have been evaluated at `state`.
    ///
    /// No formula is written twice: each part of the system is evaluated again with its velocity through the water, its
    /// accelerations or its damping taken away, and a kind is what that changes. A new term lands in the kind that it depends
    /// on alike, and what is no part of these at all in `other`. Nothing is allocated.
    void evaluate(const Equations& equations, const State& state);

    const std::vector<Vec3>& of(ForceKind kind) const { return forces_[static_cast<int>(kind)]; }

  private:
    std::vector<Vec3>& at(ForceKind kind) { return forces_[static_cast<int>(kind)]; }
    void add_segments(const Equations& equations, const State& state);
    void add_points(const Equations& equations, const State& state);
    void add_bodies(const Equations& equations, const State& state);
    void add_bending(const State& state);
    void add_joints(const State& state);
    void find_other(const Equations& equations, const State& state);

    std::array<std::vector<Vec3>, kForceKinds> forces_;
    std::vector<WaterMotion> resting_water_;  ///< along one body: room for the water there without its velocity
};

}  // namespace sim_core
