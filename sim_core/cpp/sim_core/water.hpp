// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "types.hpp"

namespace sim_core {

/// Still or uniformly moving water below z = 0 (tank axes: x along the run, z up).
struct Water {
    double density = 1000.0;         ///< kg/m³
    double gravity = 9.81;           ///< m/s²
    Vec3 current = Vec3::Zero();     ///< m/s, tank axes

    /// Velocity of the water at a place in tank axes, m/s.
    Vec3 velocity_at(const Vec3& /*position*/) const { return current; }
};

/// Immersed fraction of something that reaches `half_height` up and down from its centre.
///
/// The cubic is the immersed volume of a sphere, exactly. Used for every shape: it is smooth
/// (continuous slope), which the Newton iteration needs, and right in the mean for any other
/// symmetric section.
struct Wetness {
    double fraction;  ///< 0 dry … 1 immersed
    double slope;     ///< derivative with respect to the dimensionless depth
};

/// `depth` is that of the centre below the surface divided by the half height.
inline Wetness wetness(double depth) {
    if (depth >= 1.0) return {1.0, 0.0};
    if (depth <= -1.0) return {0.0, 0.0};
    return {0.5 + depth * (0.75 - 0.25 * depth * depth), 0.75 * (1.0 - depth * depth)};
}

}  // namespace sim_core
