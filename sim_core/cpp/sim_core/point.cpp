// SPDX-License-Identifier: Apache-2.0
#include "point.hpp"

#include <cmath>
#include <numbers>

namespace sim_core {

void point_force(const FreePoint& point, const Water& water, const Vec3& position, const Vec3& velocity,
                 const Vec3& acceleration, PointCache& f) {
    const double radius = std::cbrt(0.75 / std::numbers::pi * point.volume);
    if (radius > 0.0) {
        const Wetness w = wetness(-position.z() / radius);
        f.fraction = w.fraction;
        f.fraction_z = -w.slope / radius;
    } else {
        f.fraction = position.z() < 0.0 ? 1.0 : 0.0;
        f.fraction_z = 0.0;
    }
    f.flow = water.velocity_at(position) - velocity;
    f.speed = f.flow.norm();
    f.drag = 0.5 * water.density * point.drag_area;
    f.immersed = (f.drag * f.speed) * f.flow - point.added_mass * acceleration;
    f.immersed.z() += water.density * water.gravity * point.volume;
    f.force = f.fraction * f.immersed - point.mass * acceleration;
    f.force.z() -= point.mass * water.gravity;
}

void point_jacobian(const FreePoint& point, const PointCache& f, PointJacobian& jacobian) {
    const double k = f.fraction * f.drag;
    jacobian.velocity = (-k * f.speed) * Mat3::Identity();
    if (f.speed > 0.0) jacobian.velocity -= (k / f.speed) * f.flow * f.flow.transpose();
    jacobian.acceleration = -(point.mass + f.fraction * point.added_mass) * Mat3::Identity();
    jacobian.position.setZero();
    jacobian.position.col(2) = f.fraction_z * f.immersed;
}

}  // namespace sim_core
