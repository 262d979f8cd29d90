// SPDX-License-Identifier: Apache-2.0
// Force and moment on a hull from a table over angle of attack and sideslip.
#pragma once

#include <array>
#include <vector>

#include "types.hpp"

namespace sim_core {

/// Coefficients of a hull's force and moment in steady flow, as a towing tank or CFD gives them.
///
/// With v the hull's velocity through the water at the origin, in body axes (x forward, y to port, z up):
///   angle of attack α = atan2(−v_z, v_x), positive nose up; sideslip β = asin(v_y/|v|), positive when the body drifts
///   to port.
/// Coefficients, in this order: drag against v, side force, lift; moments about body x, y, z (a positive pitching
/// moment about y turns the nose down). Lift is normal to v in the plane of symmetry turned by α, side force normal to
/// both (to port); all on ½ρ|v|² `area`, moments also × `length`.
///
/// Between the nodes bicubic Hermite patches with the slopes of parabolas through three nodes: continuous slope,
/// exact for polynomials of second degree in each angle. Beyond the range of the table, which is for transients only,
/// drag stays and the rest fades: linearly in α round the back from one end of the range to the other; linearly in β to flow
/// along y, where the drag is the mean over α at that edge of the range and the rest is zero. Continuous there, and it
/// takes out energy as long as the drag coefficients are positive.
struct HullTable {
    std::vector<double> attack;    ///< rad, ascending, within ±π (exclusive); at least 3
    std::vector<double> sideslip;  ///< rad, ascending, within ±π/2 (exclusive); at least 3
    std::vector<std::array<double, 6>> coefficients;  ///< for each α all β
    double area = 0.0;             ///< m²
    double length = 0.0;           ///< m
};

/// What the force needs, prepared once.
class HullTableForce {
  public:
    using Coefficients = Eigen::Array<double, 6, 1>;

    /// Throws InvalidInput if the table is impossible.
    HullTableForce(const HullTable& table, double density);

    /// The coefficients at α and β, and their derivatives.
    void interpolate(double attack, double sideslip, Coefficients& c, Coefficients& c_attack,
                     Coefficients& c_sideslip) const;

    /// Force (N) and moment (N·m) at the velocity v through the water, all in body axes, and their derivatives.
    void evaluate(const Vec3& v, Vec3& force, Vec3& moment, Mat3& force_v, Mat3& moment_v) const;

  private:
    struct Node {
        Coefficients value, attack_slope, sideslip_slope, twist;
    };
    const Node& node(std::size_t i, std::size_t j) const { return nodes_[i * sideslip_.size() + j]; }

    std::vector<double> attack_;    ///< of the table, with −π and π added
    std::vector<double> sideslip_;  ///< of the table, with −π/2 and π/2 added
    std::vector<Node> nodes_;
    double pressure_area_;          ///< ½ρS, N/(m/s)²
    double length_;
};

}  // namespace sim_core
