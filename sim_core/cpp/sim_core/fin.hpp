// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "types.hpp"

namespace sim_core {

/// A lifting surface on a body, as its owner describes it.
///
/// With c the water's speed along the chord (towards the tail), w its speed along the normal, q = √(c² + w²):
///   lift  ½ρS a S(w/q) c/q · q²   across the flow; S(s) ≈ s, limited at sin(stall_angle)
///   drag  ½ρS drag · q²           along the flow
///   cross-flow drag ½ρS cross_flow_drag |w| w along the normal (broadside plate, what is left after stall)
/// The leading term is the a sin α cos α of Polhamus (1966), so that rest and flow from behind are regular.
struct Fin {
    Vec3 position = Vec3::Zero();   ///< aerodynamic centre, body axes, m
    Vec3 normal = Vec3::UnitZ();    ///< unit normal, body axes; the chord is the body's x made normal to it
    double area = 0.0;              ///< planform, m²
    double lift_slope = 0.0;        ///< per rad, three-dimensional
    double drag = 0.0;              ///< profile drag coefficient on the planform area
    double stall_angle = 0.0;       ///< rad
    double cross_flow_drag = 0.0;   ///< drag coefficient broadside
};

/// What the force needs, prepared once.
class FinForce {
  public:
    FinForce(const Fin& fin, double density);

    /// Force (N, body axes) in the local flow (m/s, body axes: water relative to the fin), and its derivative.
    void evaluate(const Vec3& flow, Vec3& force, Mat3& flow_derivative) const;

    const Vec3& position() const { return position_; }
    double half_height() const { return half_height_; }

  private:
    Vec3 position_;
    Vec3 normal_;
    Vec3 chord_;        ///< forward
    double pressure_;   ///< ½ρS, N/(m/s)²
    double lift_slope_;
    double drag_;
    double cross_flow_drag_;
    double stall_sine_;
    double half_height_;
};

}  // namespace sim_core
