// SPDX-License-Identifier: Apache-2.0
#include "heave.hpp"

#include <cmath>
#include <numbers>

namespace sim_core {

namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

}  // namespace

Sinusoid::Sinusoid(const Vec3& mean, const Vec3& velocity, double amplitude, double period, double phase,
                   double ramp_time, double run_up_time)
    : tow_(mean, velocity, run_up_time),
      amplitude_(amplitude),
      rate_(kTwoPi / period),
      phase_(phase),
      ramp_time_(ramp_time) {
    require_finite("sinusoid", {amplitude, period, phase, ramp_time});
    require_law(period > 0.0, "sinusoid: period must be above 0 s");
    require_law(ramp_time >= 0.0, "sinusoid: ramp_time must not be below 0 s");
}

MotionSample Sinusoid::at(double time) const {
    MotionSample sample = tow_.at(time);
    const Ramp r = ramp(time, ramp_time_);
    const double sine = amplitude_ * std::sin(rate_ * time + phase_);
    const double cosine = amplitude_ * std::cos(rate_ * time + phase_);
    sample.position.z() += r.value * sine;
    sample.velocity.z() += r.rate * sine + r.value * rate_ * cosine;
    sample.acceleration.z() += (r.rate2 - r.value * rate_ * rate_) * sine + 2.0 * r.rate * rate_ * cosine;
    return sample;
}

SliderCrank::SliderCrank(const Vec3& mean, const Vec3& velocity, double crank_radius, double rod_length,
                         double period, double phase, double ramp_time, double run_up_time)
    : tow_(mean, velocity, run_up_time),
      crank_radius_(crank_radius),
      rod_length_(rod_length),
      rate_(kTwoPi / period),
      phase_(phase),
      ramp_time_(ramp_time) {
    require_finite("slider crank", {crank_radius, rod_length, period, phase, ramp_time});
    require_law(period > 0.0, "slider crank: period must be above 0 s");
    require_law(crank_radius >= 0.0 && rod_length > crank_radius, "slider crank: rod_length must exceed crank_radius");
    require_law(ramp_time >= 0.0, "slider crank: ramp_time must not be below 0 s");
}

MotionSample SliderCrank::at(double time) const {
    MotionSample sample = tow_.at(time);
    const Ramp r = ramp(time, ramp_time_);
    const double theta = phase_ + rate_ * r.integral;
    const double theta_rate = rate_ * r.value;
    const double theta_acceleration = rate_ * r.rate;
    const double sine = std::sin(theta);
    const double cosine = std::cos(theta);
    const double k = (crank_radius_ / rod_length_) * (crank_radius_ / rod_length_);
    const double root = std::sqrt(1.0 - k * sine * sine);
    const double z = -crank_radius_ * cosine + rod_length_ * (1.0 - root);
    const double dz = crank_radius_ * sine + rod_length_ * k * sine * cosine / root;
    const double ddz = crank_radius_ * cosine +
                       rod_length_ * k * ((cosine * cosine - sine * sine) / root +
                                          k * sine * sine * cosine * cosine / (root * root * root));
    sample.position.z() += z;
    sample.velocity.z() += dz * theta_rate;
    sample.acceleration.z() += ddz * theta_rate * theta_rate + dz * theta_acceleration;
    return sample;
}

}  // namespace sim_core
