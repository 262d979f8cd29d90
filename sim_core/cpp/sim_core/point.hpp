// SPDX-License-Identifier: Apache-2.0
// Forces on a point with mass: a junction, or a depressor.
#pragma once

#include <variant>

#include "types.hpp"
#include "water.hpp"

namespace sim_core {

/// How a point resists the water, at one instant: the coefficients of
///   drag ½ρ A_i |u| u_i  and added mass m_i along each tank axis i, u the flow past the point.
struct Resistance {
    Vec3 drag_area;           ///< Cd A, m²
    Vec3 added_mass;          ///< kg
    double drag_area_slope;   ///< derivative of the two horizontal drag areas with respect to u_x² + u_y², s²
    double added_mass_slope;  ///< … of the two horizontal added masses, kg s²/m²
};

/// A point whose drag areas and added masses belong to the tank axes; a sphere if all three are alike.
struct FixedAxes {
    Vec3 drag_area = Vec3::Zero();   ///< Cd A along x, y, z, m²
    Vec3 added_mass = Vec3::Zero();  ///< kg

    Resistance at(const Vec3& flow) const;
};

/// A depressor with a fin, which turns its axis into the horizontal flow past it.
///
/// Its heading is no unknown: the fin is taken to be fast, so that there is no sideslip. The horizontal flow then meets
/// the body along its axis, and in a turn its axis turns with the flow, so that the water's impulse is the
/// added mass along the axis times the velocity: both act alike in all horizontal directions. Only flow much slower than
/// `turning_speed` cannot turn it; there the heading is unknown, and the mean of along and across counts:
///   A = A_along + ½ (A_across − A_along) / (1 + (u_x² + u_y²) / turning_speed²), and so the added mass.
struct Weathervane {
    Vec3 drag_area = Vec3::Zero();   ///< Cd A along the axis, across it, vertical, m²
    Vec3 added_mass = Vec3::Zero();  ///< along, across, vertical, kg
    double turning_speed = 0.05;     ///< m/s

    Resistance at(const Vec3& flow) const;
};

/// A point with mass that moves freely.
struct FreePoint {
    double mass = 0.0;    ///< kg
    double volume = 0.0;  ///< m³, immersed as a sphere
    std::variant<FixedAxes, Weathervane> shape;

    /// Its resistance in the flow past it (m/s, tank axes).
    Resistance resistance(const Vec3& flow) const {
        return std::visit([&flow](const auto& s) { return s.at(flow); }, shape);
    }
};

/// Intermediate results of a point's force, kept for its derivatives.
struct PointCache {
    Vec3 force;             ///< N, tank axes; inertia included (F − M a)
    Vec3 immersed;          ///< what of it scales with the immersed fraction, at fraction 1
    Vec3 flow;              ///< velocity of the water relative to the point, m/s
    Vec3 acceleration;      ///< of the point relative to the water's, m/s²
    double speed;           ///< of the flow, m/s
    double fraction;        ///< immersed
    double fraction_z;      ///< its derivative with respect to the height above the surface, 1/m
    Resistance resistance;
};

/// Derivatives of the force with respect to the point's own position, velocity and acceleration.
struct PointJacobian {
    Mat3 position, velocity, acceleration;
};

/// Weight, buoyancy, drag and inertia in water that moves as `here` at the point.
void point_force(const FreePoint& point, const Water& water, const WaterMotion& here, const Vec3& position,
                 const Vec3& velocity, const Vec3& acceleration, PointCache& cache);

/// Derivatives at the state for which `cache` was filled.
void point_jacobian(const FreePoint& point, const Water& water, const WaterMotion& here, const PointCache& cache,
                    PointJacobian& jacobian);

}  // namespace sim_core
