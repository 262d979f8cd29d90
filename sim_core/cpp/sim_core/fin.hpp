// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "types.hpp"

namespace sim_core {

/// A lifting surface on a body, as its owner describes it.
///
/// With c the water's speed along the chord (towards the tail), w its speed along the normal, q = √(c² + w²):
///   lift  ½ρS a S(w/q) c/q · q²   across the flow; S(s) ≈ s, limited at sin(stall_angle)
///   drag  ½ρS drag · q²           along the flow
///   induced drag  ½ρS C_L²/(πA) · q²  along the flow, with C_L = a S(w/q) c/q: the lift's, stalled or not
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
    /// A of the induced drag, times its efficiency if the lift is not elliptic: infinite for none. Left out, that of the
    /// straight fin with this lift_slope (aspect_ratio_of).
    std::optional<double> aspect_ratio;
};

/// The aspect ratio of a straight fin with a lift slope (1/rad): Helmbold's a = 2πA/(2 + √(4 + A²)) solved for A; infinite
/// from the slope of an aerofoil, 2π, on.
double aspect_ratio_of(double lift_slope);

/// A fin in the downwash of another one ahead of it.
///
/// The flow at the rear fin is turned by ε = slope · S(w/q) of the front fin (see Fin: its incidence up to stall, since
/// the downwash comes with the lift) against the front fin's normal: by ε c, with c the rear fin's own chordwise speed; not at all when
/// the flow comes from behind. The wake is in place at once; the time that the water takes from fin to fin is left out.
/// Source: Etkin & Reid, Dynamics of Flight (1996), section 2.3. Several front fins add up.
struct Downwash {
    int front = 0;       ///< index into the body's fins
    int rear = 0;
    double slope = 0.0;  ///< dε/dα
};

/// What the force needs, prepared once.
class FinForce {
  public:
    FinForce(const Fin& fin, double density);

    /// Force (N, body axes) in the local flow (m/s, body axes: water relative to the fin), and its derivative.
    void evaluate(const Vec3& flow, Vec3& force, Mat3& flow_derivative) const;

    /// The sine of the incidence, level beyond stall as the lift is, and its derivative with respect to the flow.
    double incidence(const Vec3& flow, Vec3& flow_derivative) const;

    const Vec3& position() const { return position_; }
    const Vec3& normal() const { return normal_; }
    const Vec3& chord() const { return chord_; }
    double half_height() const { return half_height_; }

  private:
    /// S(s) and its derivative.
    double level_off(double s, double& slope) const;

    Vec3 position_;
    Vec3 normal_;
    Vec3 chord_;        ///< forward
    double pressure_;   ///< ½ρS, N/(m/s)²
    double lift_slope_;
    double drag_;
    double induced_;    ///< a²/(πA)
    double cross_flow_drag_;
    double stall_sine_;
    double half_height_;
};

}  // namespace sim_core
