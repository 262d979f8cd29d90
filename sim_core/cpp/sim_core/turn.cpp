// SPDX-License-Identifier: Apache-2.0
#include "turn.hpp"

#include <cmath>

namespace sim_core {

namespace {

/// Gauss–Legendre nodes and weights on −1 … 1, 8 points (Abramowitz & Stegun 1972, table 25.4).
constexpr double kNode[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
constexpr double kWeight[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};

}  // namespace

Turn::Turn(const Vec3& position, const Vec3& velocity, double start_time, double radius, double angle,
           double entry_time, double run_up_time)
    : tow_(position, velocity, run_up_time),
      start_time_(start_time),
      speed_(velocity.norm()),
      rate_(std::copysign(speed_ / radius, angle)),
      angle_(angle),
      entry_time_(entry_time),
      rise_(angle / rate_) {
    require_finite("turn", {start_time, radius, angle, entry_time});
    require_law(speed_ > 0.0 && velocity.z() == 0.0, "turn: the velocity must be level and not zero");
    require_law(radius > 0.0, "turn: radius must be above 0 m");
    require_law(angle != 0.0, "turn: angle must not be 0");
    require_law(start_time >= run_up_time, "turn: start_time must not lie in the run-up");
    require_law(entry_time >= 0.0, "turn: entry_time must not be below 0 s");
    require_law(rise_ >= entry_time, "turn: the angle is reached before the full rate of turn; shorten entry_time");
    ahead_ = velocity / speed_;
    abeam_ = Vec3::UnitZ().cross(ahead_);
    start_ = tow_.at(start_time).position;
    entry_end_ = entry_displacement(entry_time);
    exit_start_ = displacement(rise_);
    exit_end_ = displacement(rise_ + entry_time);
}

Turn::Heading Turn::heading(double time) const {
    const Ramp in = ramp(time, entry_time_);
    const Ramp out = ramp(time - rise_, entry_time_);
    if (time >= rise_ + entry_time_) return {angle_, 0.0, 0.0};
    if (time < rise_) return {rate_ * in.integral, rate_ * in.value, rate_ * in.rate};
    return {rate_ * (in.integral - out.integral), rate_ * (in.value - out.value), rate_ * (in.rate - out.rate)};
}

/// ∫ (cos ψ, sin ψ) dt over the entry, in panels short enough (ψ changes by less than 0.3 rad) that the eight-point rule
/// is exact to rounding.
Vec3 Turn::entry_displacement(double time) const {
    if (time <= 0.0) return Vec3::Zero();
    const int panels = 1 + static_cast<int>(std::abs(heading(time).angle) / 0.3);
    const double half = 0.5 * time / panels;
    Vec3 sum = Vec3::Zero();
    for (int panel = 0; panel < panels; ++panel) {
        const double middle = (2 * panel + 1) * half;
        for (int i = 0; i < 4; ++i) {
            for (const double node : {-kNode[i], kNode[i]}) {
                const double psi = rate_ * ramp(middle + half * node, entry_time_).integral;
                sum += kWeight[i] * Vec3(std::cos(psi), std::sin(psi), 0.0);
            }
        }
    }
    return speed_ * half * sum;
}

Vec3 Turn::displacement(double time) const {
    if (time <= entry_time_) return entry_displacement(time);
    const auto arc = [this](double from, double to) {
        return Vec3(speed_ / rate_ * Vec3(std::sin(to) - std::sin(from), std::cos(from) - std::cos(to), 0.0));
    };
    if (time <= rise_) return entry_end_ + arc(heading(entry_time_).angle, heading(time).angle);
    if (time <= rise_ + entry_time_) {
        // The exit is the entry run backwards: mirrored in time about the middle of the turn.
        const Vec3 left = entry_displacement(rise_ + entry_time_ - time);
        const Vec3 gone = entry_end_ - left;
        const double c = std::cos(angle_), s = std::sin(angle_);
        return exit_start_ + Vec3(c * gone.x() + s * gone.y(), s * gone.x() - c * gone.y(), 0.0);
    }
    const Vec3 along(std::cos(angle_), std::sin(angle_), 0.0);
    return exit_end_ + speed_ * (time - rise_ - entry_time_) * along;
}

MotionSample Turn::at(double time) const {
    if (time <= start_time_) return tow_.at(time);
    const double since = time - start_time_;
    const Heading h = heading(since);
    const double c = std::cos(h.angle), s = std::sin(h.angle);
    const Vec3 d = displacement(since);
    const auto to_tank = [this](double x, double y) { return Vec3(x * ahead_ + y * abeam_); };
    return {start_ + to_tank(d.x(), d.y()), speed_ * to_tank(c, s), speed_ * h.rate * to_tank(-s, c)};
}

}  // namespace sim_core
