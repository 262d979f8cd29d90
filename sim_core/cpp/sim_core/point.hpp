// SPDX-License-Identifier: Apache-2.0
// Forces on a point with mass: a junction, or a sphere-like depressor.
#pragma once

#include "types.hpp"
#include "water.hpp"

namespace sim_core {

/// A point with mass that moves freely: a junction, or a sphere-like depressor.
struct FreePoint {
    double mass = 0.0;        ///< kg
    double volume = 0.0;      ///< m³
    double drag_area = 0.0;   ///< Cd A, m²
    double added_mass = 0.0;  ///< kg, the same in every direction
};

/// Intermediate results of a point's force, kept for its derivatives.
struct PointCache {
    Vec3 force;          ///< N, tank axes; inertia included (F − M a)
    Vec3 immersed;       ///< what of it scales with the immersed fraction, at fraction 1
    Vec3 flow;           ///< velocity of the water relative to the point, m/s
    double speed;        ///< m/s
    double fraction;     ///< immersed
    double fraction_z;   ///< its derivative with respect to the height, 1/m
    double drag;         ///< ½ ρ Cd A, N/(m/s)²
};

/// Derivatives of the force with respect to the point's own position, velocity and acceleration.
struct PointJacobian {
    Mat3 position, velocity, acceleration;
};

/// Weight, buoyancy, drag and inertia, immersed as a sphere.
void point_force(const FreePoint& point, const Water& water, const Vec3& position, const Vec3& velocity,
                 const Vec3& acceleration, PointCache& cache);

/// Derivatives at the state for which `cache` was filled.
void point_jacobian(const FreePoint& point, const PointCache& cache, PointJacobian& jacobian);

}  // namespace sim_core
