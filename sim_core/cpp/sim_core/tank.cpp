// SPDX-License-Identifier: Apache-2.0
#include "tank.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "error.hpp"
#include "state.hpp"

namespace sim_core {

namespace {

void require(bool holds, const char* what) {
    if (!holds) throw InvalidInput(std::string("tank: ") + what);
}

double depth_behind(const TankSide& side, double radius, const Vec3& position) {
    return radius + side.offset - side.normal.dot(position);
}

}  // namespace

std::vector<TankSide> tank_sides(const Tank& tank) {
    require(tank.stiffness >= 0.0 && std::isfinite(tank.stiffness), "stiffness must not be below 0 N/m");
    require(tank.bed_stiffness >= 0.0 && std::isfinite(tank.bed_stiffness), "bed_stiffness must not be below 0 Pa/m");
    require(tank.stiffness > 0.0 || (tank.bed_stiffness > 0.0 && !tank.width && !tank.ends),
            "stiffness must be above 0 N/m, but for a floor alone with a bed_stiffness");
    require(tank.damping >= 0.0 && std::isfinite(tank.damping), "damping must not be below 0 s/m");
    require(tank.friction >= 0.0 && std::isfinite(tank.friction), "friction must not be below 0");
    require(tank.onset > 0.0 && std::isfinite(tank.onset), "onset must be above 0 m");
    require(tank.sliding_speed > 0.0 && std::isfinite(tank.sliding_speed), "sliding_speed must be above 0 m/s");
    std::vector<TankSide> sides;
    if (tank.floor) {
        require(std::isfinite(*tank.floor), "floor must be finite");
        sides.push_back({"floor", Vec3::UnitZ(), *tank.floor, tank.bed_stiffness});
    }
    if (tank.width) {
        require(*tank.width > 0.0 && std::isfinite(*tank.width), "width must be above 0 m");
        sides.push_back({"port wall", -Vec3::UnitY(), -0.5 * *tank.width, 0.0});
        sides.push_back({"starboard wall", Vec3::UnitY(), -0.5 * *tank.width, 0.0});
    }
    if (tank.ends) {
        const auto [aft, forward] = *tank.ends;
        require(std::isfinite(aft) && std::isfinite(forward) && aft < forward,
                "ends must be the aft and the forward one");
        sides.push_back({"aft end", Vec3::UnitX(), aft, 0.0});
        sides.push_back({"forward end", -Vec3::UnitX(), -forward, 0.0});
    }
    return sides;
}

void contact_force(const Tank& tank, const std::vector<TankSide>& sides, const ContactSize& size, const Vec3& position,
                   const Vec3& velocity, ContactForce& contact) {
    contact.force.setZero();
    contact.position.setZero();
    contact.velocity.setZero();
    for (const TankSide& side : sides) {
        const Vec3& n = side.normal;
        const double depth = depth_behind(side, size.radius, position);
        if (depth <= -tank.onset) continue;
        const double speed = n.dot(velocity);
        const double damping = 1.0 - tank.damping * speed;
        if (damping <= 0.0) continue;
        const double stiffness = tank.stiffness + side.bed_stiffness * size.area;
        double spring = stiffness * depth;
        double spring_slope = stiffness;
        if (depth < tank.onset) {
            const double within = depth + tank.onset;
            spring = stiffness * within * within / (4.0 * tank.onset);
            spring_slope = stiffness * within / (2.0 * tank.onset);
        }
        const double push = spring * damping;
        const Eigen::RowVector3d push_x = -spring_slope * damping * n.transpose();
        const Eigen::RowVector3d push_v = -spring * tank.damping * n.transpose();
        const Vec3 sliding = velocity - speed * n;
        const double smooth = std::sqrt(sliding.squaredNorm() + tank.sliding_speed * tank.sliding_speed);
        const Vec3 direction = n - (tank.friction / smooth) * sliding;
        contact.force += push * direction;
        contact.position += direction * push_x;
        contact.velocity += direction * push_v -
                            (push * tank.friction / smooth) *
                                (Mat3::Identity() - n * n.transpose() -
                                 sliding * sliding.transpose() / (smooth * smooth));
    }
}

ContactWatch::ContactWatch(const Model& model)
    : open_(model.contact_places.size() * model.tank_sides.size(), kNone) {
    if (!open_.empty()) events_.reserve(kMostEvents);
}

void ContactWatch::look(const State& state) {
    const Model& model = *state.model;
    const std::size_t sides = model.tank_sides.size();
    for (std::size_t i = 0; i < open_.size(); ++i) {
        const std::size_t place = i / sides;
        const std::size_t side = i % sides;
        const Vec3& position = state.position[model.contact_places[place].site];
        const bool touches = depth_behind(model.tank_sides[side], model.contact_places[place].size.radius, position) > 0.0;
        if (touches == (open_[i] != kNone)) continue;
        if (!touches) {
            if (open_[i] != kLost) events_[static_cast<std::size_t>(open_[i])].released = state.time;
            open_[i] = kNone;
        } else if (events_.size() < kMostEvents) {
            open_[i] = static_cast<int>(events_.size());
            events_.push_back({static_cast<int>(place), static_cast<int>(side), position, state.time,
                               std::numeric_limits<double>::infinity()});
        } else {
            open_[i] = kLost;
            ++lost_;
        }
    }
}

void ContactWatch::forget() {
    std::fill(open_.begin(), open_.end(), kNone);
    events_.clear();
    lost_ = 0;
}

}  // namespace sim_core
