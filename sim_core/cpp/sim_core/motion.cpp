// SPDX-License-Identifier: Apache-2.0
#include "motion.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>

#include "error.hpp"

namespace sim_core {

namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

void require_finite(const char* law, std::initializer_list<double> values) {
    for (const double value : values) {
        if (!std::isfinite(value)) throw InvalidInput(std::string(law) + ": all values must be finite");
    }
}

void require(bool holds, const char* what) {
    if (!holds) throw InvalidInput(what);
}

}  // namespace

Ramp ramp(double time, double duration) {
    if (time <= 0.0 && duration > 0.0) return {0.0, 0.0, 0.0, 0.0};
    if (time >= duration) return {1.0, 0.0, 0.0, time - 0.5 * duration};
    const double s = time / duration;
    const double s2 = s * s;
    return {s2 * s * (10.0 - 15.0 * s + 6.0 * s2), 30.0 * s2 * (1.0 - s) * (1.0 - s) / duration,
            60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / (duration * duration),
            duration * s2 * s2 * (2.5 - 3.0 * s + s2)};
}

SteadyTow::SteadyTow(const Vec3& position, const Vec3& velocity, double run_up_time)
    : position_(position), velocity_(velocity), run_up_time_(run_up_time) {
    require_finite("tow", {position.sum(), velocity.sum(), run_up_time});
    require(run_up_time >= 0.0, "run_up_time must not be below 0 s");
}

MotionSample SteadyTow::at(double time) const {
    const Ramp r = ramp(time, run_up_time_);
    return {position_ + r.integral * velocity_, r.value * velocity_, r.rate * velocity_};
}

Sinusoid::Sinusoid(const Vec3& mean, const Vec3& velocity, double amplitude, double period, double phase,
                   double ramp_time, double run_up_time)
    : tow_(mean, velocity, run_up_time),
      amplitude_(amplitude),
      rate_(kTwoPi / period),
      phase_(phase),
      ramp_time_(ramp_time) {
    require_finite("sinusoid", {amplitude, period, phase, ramp_time});
    require(period > 0.0, "sinusoid: period must be above 0 s");
    require(ramp_time >= 0.0, "sinusoid: ramp_time must not be below 0 s");
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
    require(period > 0.0, "slider crank: period must be above 0 s");
    require(crank_radius >= 0.0 && rod_length > crank_radius, "slider crank: rod_length must exceed crank_radius");
    require(ramp_time >= 0.0, "slider crank: ramp_time must not be below 0 s");
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

TimeSeries::TimeSeries(std::vector<double> time, std::vector<Vec3> position, std::vector<Vec3> velocity)
    : time_(std::move(time)), position_(std::move(position)), velocity_(std::move(velocity)) {
    require(time_.size() >= 2, "time series: at least two samples are needed");
    require(position_.size() == time_.size() && velocity_.size() == time_.size(),
            "time series: time, position and velocity must have the same length");
    for (std::size_t i = 0; i < time_.size(); ++i) {
        require(std::isfinite(time_[i]) && position_[i].allFinite() && velocity_[i].allFinite(),
                "time series: all values must be finite");
        require(i == 0 || time_[i] > time_[i - 1], "time series: times must increase");
    }
}

MotionSample TimeSeries::at(double time) const {
    if (time <= time_.front()) {
        return {position_.front() + (time - time_.front()) * velocity_.front(), velocity_.front(), Vec3::Zero()};
    }
    if (time >= time_.back()) {
        return {position_.back() + (time - time_.back()) * velocity_.back(), velocity_.back(), Vec3::Zero()};
    }
    const auto after = std::upper_bound(time_.begin(), time_.end(), time) - time_.begin();
    return HermiteSegment(time_[after - 1], position_[after - 1], velocity_[after - 1], time_[after],
                          position_[after], velocity_[after])
        .at(time);
}

HermiteSegment::HermiteSegment(double start_time, const Vec3& start_position, const Vec3& start_velocity,
                               double end_time, const Vec3& end_position, const Vec3& end_velocity)
    : start_time_(start_time),
      duration_(end_time - start_time),
      position_{start_position, end_position},
      velocity_{start_velocity, end_velocity} {}

MotionSample HermiteSegment::at(double time) const {
    const double s = (time - start_time_) / duration_;
    const Vec3 chord = position_[1] - position_[0];
    const Vec3 d0 = duration_ * velocity_[0];
    const Vec3 d1 = duration_ * velocity_[1];
    // p(s) = p0 + d0 s + c2 s² + c3 s³
    const Vec3 c2 = 3.0 * chord - 2.0 * d0 - d1;
    const Vec3 c3 = d0 + d1 - 2.0 * chord;
    // Exactly the given end point at the end, so that successive cubics join without rounding.
    const Vec3 position = s == 1.0 ? position_[1] : Vec3(position_[0] + s * (d0 + s * (c2 + s * c3)));
    const Vec3 velocity = s == 1.0 ? velocity_[1] : Vec3((d0 + s * (2.0 * c2 + 3.0 * s * c3)) / duration_);
    return {position, velocity, (2.0 * c2 + 6.0 * s * c3) / (duration_ * duration_)};
}

}  // namespace sim_core
