// SPDX-License-Identifier: Apache-2.0
// The tow-fish: a rigid body with six degrees of freedom in water (Kirchhoff's equations).
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "fin.hpp"
#include "hull_table.hpp"
#include "types.hpp"
#include "water.hpp"

namespace sim_core {

/// Description of a body. Body axes: x forward, y to port, z up; origin at mid-hull. The hull is a straight cylinder of
/// `length` and `diameter` about the x axis. What the hull encloses, water included, belongs to it: it adds to mass,
/// inertia and volume alike, and does not run out where the hull leaves the water.
struct Body {
    double mass = 0.0;                          ///< kg, enclosed water included
    Mat3 inertia = Mat3::Zero();                ///< about the origin, kg·m²
    Vec3 centre_of_gravity = Vec3::Zero();      ///< m
    double volume = 0.0;                        ///< m³, enclosed water included
    Vec3 centre_of_buoyancy = Vec3::Zero();     ///< m
    double diameter = 0.0;                      ///< m
    double length = 0.0;                        ///< m
    /// Symmetric, about the origin, for (velocity, angular velocity) in body axes: [M Dᵀ; D J], in kg, kg·m, kg·m².
    Mat6 added_mass = Mat6::Zero();
    double axial_drag = 0.0;                    ///< coefficient on the frontal area π d²/4
    double cross_flow_drag = 0.0;               ///< coefficient on d·dx of each strip
    /// Drag of what is neither hull nor fins, symmetric, body axes: force ½ρ |u| A u at the origin with the water's
    /// velocity u past it (A = Cd·A, m²), moment −½ρ |ω| B ω (m⁵).
    Mat3 drag_area = Mat3::Zero();
    Mat3 turning_drag = Mat3::Zero();
    /// Share of the convective part of the added-mass wrench, from 0 to 1. At 1 Kirchhoff's equations
    /// hold in full, Munk moment included. At 0 the added mass resists acceleration
    /// in tank axes and nothing else (Morison's form): neither the Munk moment nor the forces that come with it.
    double munk_moment = 1.0;
    int strips = 20;                            ///< along the hull, for cross-flow drag and immersion
    std::vector<Fin> fins;
    std::vector<Downwash> downwash;             ///< of front fins on rear fins
    /// Steady force and moment of the hull instead of axial and cross-flow drag. The table holds the Munk moment: axial_drag and
    /// munk_moment must be 0. The strips then only damp rotation: each has its cross-flow drag less what it would be
    /// without rotation.
    std::optional<HullTable> hull_table;
    std::map<std::string, Vec3> places;         ///< of sensors and the like, body axes, m
};

/// Position and motion of a body: translation in tank axes, rotation in body axes.
struct BodyMotion {
    const Vec3& position;               ///< of the origin, m
    const Mat3& rotation;               ///< body axes → tank axes
    const Vec3& velocity;               ///< m/s, tank axes
    const Vec3& acceleration;           ///< m/s², tank axes
    const Vec3& angular_velocity;       ///< rad/s, body axes
    const Vec3& angular_acceleration;   ///< rad/s², body axes
};

/// Derivatives of (force in tank axes, moment in body axes) with respect to (position, rotation vector
/// in body axes), (velocity, angular velocity), (acceleration, angular acceleration).
struct BodyJacobian {
    Mat6 position;
    Mat6 velocity;
    Mat6 acceleration;
};

/// A body in its water, prepared for evaluation.
class BodyForce {
  public:
    /// Throws InvalidInput naming `name` if the description is impossible.
    BodyForce(const std::string& name, const Body& body, const Water& water);

    /// Sum of external and inertia forces (F − M a) without the lines': force in tank axes, moment about the
    /// origin in body axes; and their derivatives. `along` is what the water does at each of the water places;
    /// one motion for all of them if it is uniform and steady. With its curvature if feels_curvature().
    void evaluate(const Water& water, const std::vector<WaterMotion>& along, const BodyMotion& motion, Vec3& force,
                  Vec3& moment, BodyJacobian& jacobian) const;

    /// Where the water's motion counts: the middles of the strips along the hull, then the fins. Body axes, m.
    int water_places() const { return body_.strips + static_cast<int>(fins_.size()); }
    Vec3 water_place(int i) const {
        if (i < body_.strips) return {(i + 0.5) * strip_length_ - 0.5 * body_.length, 0.0, 0.0};
        return fins_[i - body_.strips].position();
    }

    /// Whether it takes WaterMotion::velocity_curvature along the hull: with convective terms of the added mass.
    bool feels_curvature() const { return body_.munk_moment > 0.0 && !body_.added_mass.isZero(0.0); }

    const Body& body() const { return body_; }

    /// Cd A (m²) of the body in flow along its axis, fins left out.
    double drag_area() const;

  private:
    /// Turns the flow at a fin by the downwash of those ahead of it. Gives the derivatives of the change with respect
    /// to v and w.
    void turn_by_downwash(std::size_t rear, const Vec3& v, const Vec3& w, Vec3& flow, Mat3& change_v,
                          Mat3& change_w) const;

    Body body_;
    std::vector<FinForce> fins_;
    std::vector<std::vector<Downwash>> ahead_;  ///< per fin, of the fins ahead of it
    std::optional<HullTableForce> hull_table_;
    Mat3 added_mass_, added_coupling_, added_inertia_;  ///< M, D, J of Body::added_mass
    bool coupled_;                                      ///< D is not zero
    bool bluff_;                                        ///< it has a drag_area or a turning_drag
    Mat3 bluff_drag_, bluff_turning_drag_;              ///< ½ρ A and ½ρ B
    double strip_length_;
    double strip_drag_;      ///< ½ρ Cd d Δx, N/(m/s)²
    double displaced_mass_;  ///< kg of water, immersed
    double buoyancy_;        ///< N, fully immersed
    double axial_drag_;      ///< ½ρ Cd π d²/4, N/(m/s)²
};

}  // namespace sim_core
