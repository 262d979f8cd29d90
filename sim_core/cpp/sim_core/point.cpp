// SPDX-License-Identifier: Apache-2.0
#include "point.hpp"

#include <cmath>
#include <numbers>

namespace sim_core {

Resistance FixedAxes::at(const Vec3& /*flow*/) const { return {drag_area, added_mass, 0.0, 0.0}; }

Resistance Weathervane::at(const Vec3& flow) const {
    const double turning = turning_speed * turning_speed;
    const double unturned = turning / (turning + flow.x() * flow.x() + flow.y() * flow.y());
    const double unturned_slope = -unturned * unturned / turning;
    const auto horizontal = [&](const Vec3& a) { return a.x() + 0.5 * (a.y() - a.x()) * unturned; };
    const double area = horizontal(drag_area);
    const double mass = horizontal(added_mass);
    return {{area, area, drag_area.z()},
            {mass, mass, added_mass.z()},
            0.5 * (drag_area.y() - drag_area.x()) * unturned_slope,
            0.5 * (added_mass.y() - added_mass.x()) * unturned_slope};
}

void point_force(const FreePoint& point, const Water& water, const WaterMotion& here, const Vec3& position,
                 const Vec3& velocity, const Vec3& acceleration, PointCache& f) {
    const double radius = std::cbrt(0.75 / std::numbers::pi * point.volume);
    const double height = position.z() - here.elevation;
    if (radius > 0.0) {
        const Wetness w = wetness(-height / radius);
        f.fraction = w.fraction;
        f.fraction_z = -w.slope / radius;
    } else {
        f.fraction = height < 0.0 ? 1.0 : 0.0;
        f.fraction_z = 0.0;
    }
    f.flow = here.velocity - velocity;
    f.speed = f.flow.norm();
    f.acceleration = acceleration - here.acceleration;
    f.resistance = point.resistance(f.flow);
    const Resistance& r = f.resistance;
    f.immersed = 0.5 * water.density * f.speed * r.drag_area.cwiseProduct(f.flow) -
                 r.added_mass.cwiseProduct(f.acceleration) + water.density * point.volume * here.acceleration;
    f.immersed.z() += water.density * water.gravity * point.volume;
    f.force = f.fraction * f.immersed - point.mass * acceleration;
    f.force.z() -= point.mass * water.gravity;
}

void point_jacobian(const FreePoint& point, const Water& water, const WaterMotion& here, const PointCache& f,
                    PointJacobian& jacobian) {
    const Resistance& r = f.resistance;
    const double pressure = 0.5 * water.density;
    Mat3 flow = (pressure * f.speed) * r.drag_area.asDiagonal();
    if (f.speed > 0.0) flow += (pressure / f.speed) * r.drag_area.cwiseProduct(f.flow) * f.flow.transpose();
    if (r.drag_area_slope != 0.0 || r.added_mass_slope != 0.0) {
        const Vec3 level(f.flow.x(), f.flow.y(), 0.0);
        const Vec3 level_acceleration(f.acceleration.x(), f.acceleration.y(), 0.0);
        flow += 2.0 * (pressure * f.speed * r.drag_area_slope * level - r.added_mass_slope * level_acceleration) *
                level.transpose();
    }
    jacobian.velocity = -f.fraction * flow;
    jacobian.acceleration = Mat3((-point.mass - f.fraction * r.added_mass.array()).matrix().asDiagonal());
    const Vec3 pull = r.added_mass.array() + water.density * point.volume;
    jacobian.position = f.fraction * (flow * here.velocity_gradient + pull.asDiagonal() * here.acceleration_gradient) +
                        f.fraction_z * f.immersed * here.height_slope().transpose();
}

}  // namespace sim_core
