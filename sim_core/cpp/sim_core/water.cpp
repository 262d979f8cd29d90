// SPDX-License-Identifier: Apache-2.0
#include "water.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "motion.hpp"
#include "sine_cosine.hpp"

namespace sim_core {

Water Water::calm(double time) const {
    Water still = *this;
    still.waves.reset();
    if (current.series) {
        Vec3 velocity, slope;
        current.series->at(time, velocity, slope);
        still.current.uniform += velocity;
        still.current.series.reset();
    }
    return still;
}

WaterProbe::WaterProbe(const Water& water) : current_(water.current) {
    const Eigen::Index n = water.waves ? static_cast<Eigen::Index>(water.waves->trains().size()) : 0;
    for (Array* array : {&k_, &k_x_, &k_y_, &frequency_, &phase_, &decay_, &finite_, &phase_now_, &cosine_, &sine_,
                         &grow_, &C_, &S_}) {
        array->setZero(n);
    }
    elevation_.resize(1, n);
    slope_.resize(2, n);
    for (auto* weights : {&C_cosine_, &C_sine_}) weights->resize(5, n);
    for (auto* weights : {&S_cosine_, &S_sine_}) weights->resize(3, n);
    if (n > 0) {
        depth_ = water.waves->depth();
        ramp_time_ = water.waves->ramp_time();
    }
    for (Eigen::Index i = 0; i < n; ++i) {
        const WaveTrain& w = water.waves->trains()[static_cast<std::size_t>(i)];
        const double x = std::cos(w.direction);
        const double y = std::sin(w.direction);
        k_[i] = w.wave_number;
        k_x_[i] = w.wave_number * x;
        k_y_[i] = w.wave_number * y;
        frequency_[i] = w.frequency;
        phase_[i] = w.phase;
        decay_[i] = std::exp(-2.0 * w.wave_number * depth_);
        finite_[i] = 1.0 / (1.0 - decay_[i]);
        // With C, S = cosh, sinh k(z' + d) / sinh kd and θ = k·x − ωt + ε, per train:
        //   ζ = a cos θ,  u_h = aω C cos θ n,  w = aω S sin θ,  n the direction of travel
        const double speed = w.amplitude * w.frequency;
        const double rate = speed * w.wave_number;
        elevation_(i) = w.amplitude;
        slope_.col(i) << -w.amplitude * k_x_[i], -w.amplitude * k_y_[i];
        // u, v; gradient of ∂u/∂t: xx, xy, yy
        C_cosine_.col(i) << speed * x, speed * y, rate * w.frequency * x * x, rate * w.frequency * x * y,
            rate * w.frequency * y * y;
        // ∂u/∂t, ∂v/∂t; gradient of u: xx, xy, yy
        C_sine_.col(i) << speed * w.frequency * x, speed * w.frequency * y, -rate * x * x, -rate * x * y,
            -rate * y * y;
        // ∂w/∂t; gradient of u: xz, yz
        S_cosine_.col(i) << -speed * w.frequency, rate * x, rate * y;
        // w; gradient of ∂u/∂t: xz, yz
        S_sine_.col(i) << speed, rate * w.frequency * x, rate * w.frequency * y;
    }
    set_time(0.0);
}

void WaterProbe::set_time(double time) {
    if (current_.series) current_.series->at(time, series_velocity_, series_acceleration_);
    if (k_.size() == 0) return;
    for (Eigen::Index i = 0; i < k_.size(); ++i) {
        phase_now_[i] = std::remainder(phase_[i] - time * frequency_[i], 2.0 * std::numbers::pi);
    }
    const Ramp r = ramp(time, ramp_time_);
    strength_ = r.value;
    strength_rate_ = r.rate;
}

void WaterProbe::at(const Vec3& position, WaterMotion& motion) {
    motion = WaterMotion();
    motion.velocity = current_.uniform + series_velocity_;
    motion.acceleration = series_acceleration_;
    if (k_.size() > 0) add_waves(position, motion);
    if (current_.profile) {
        Vec3 velocity, slope;
        current_.profile->at(position.z(), velocity, slope);
        motion.velocity += velocity;
        motion.velocity_gradient.col(2) += slope;
    }
}

void WaterProbe::add_waves(const Vec3& position, WaterMotion& motion) {
    C_ = k_x_ * position.x() + k_y_ * position.y() + phase_now_;  // room for θ
    sine_cosine(C_, sine_, cosine_);
    motion.elevation = strength_ * elevation_.dot(cosine_.matrix());
    const Eigen::Vector2d slope = strength_ * (slope_ * sine_.matrix());
    motion.elevation_x = slope.x();
    motion.elevation_y = slope.y();

    // Wheeler's height and its derivatives with respect to z and ζ
    const double height = position.z() - motion.elevation;
    double z, z_z, z_elevation;
    if (std::isinf(depth_)) {
        z = height;
        z_z = 1.0;
        z_elevation = -1.0;
    } else {
        const double stretch = depth_ / std::max(depth_ + motion.elevation, 1e-3 * depth_);
        z = height * stretch;
        z_z = stretch;
        z_elevation = -stretch * stretch * (depth_ + position.z()) / depth_;
    }
    if (z > 0.0 || z < -depth_) {
        z = std::clamp(z, -depth_, 0.0);
        z_z = z_elevation = 0.0;
    }

    grow_ = (k_ * z).exp();
    // The two parts of cosh and sinh; the second vanishes in deep water
    S_ = finite_ * (decay_ / grow_.max(1e-300));
    C_ = finite_ * grow_ + S_;
    S_ = C_ - 2.0 * S_;
    grow_ = C_ * cosine_;
    const Eigen::Matrix<double, 5, 1> c_cos = C_cosine_ * grow_.matrix();
    grow_ = C_ * sine_;
    const Eigen::Matrix<double, 5, 1> c_sin = C_sine_ * grow_.matrix();
    grow_ = S_ * cosine_;
    const Vec3 s_cos = S_cosine_ * grow_.matrix();
    grow_ = S_ * sine_;
    const Vec3 s_sin = S_sine_ * grow_.matrix();

    // Gradients in still coordinates: symmetric (no vorticity) and without trace (continuity)
    const auto gradient = [](double xx, double xy, double yy, double xz, double yz) {
        Mat3 g;
        g << xx, xy, xz, xy, yy, yz, xz, yz, -xx - yy;
        return g;
    };
    const Vec3 u(c_cos[0], c_cos[1], s_sin[0]);
    const Vec3 rate(c_sin[0], c_sin[1], s_cos[0]);
    Mat3 u_gradient = gradient(c_sin[2], c_sin[3], c_sin[4], s_cos[1], s_cos[2]);
    Mat3 rate_gradient = gradient(c_cos[2], c_cos[3], c_cos[4], s_sin[1], s_sin[2]);
    for (Mat3* g : {&u_gradient, &rate_gradient}) {
        const Vec3 along_z = g->col(2);
        g->col(0) += (z_elevation * motion.elevation_x) * along_z;
        g->col(1) += (z_elevation * motion.elevation_y) * along_z;
        g->col(2) = z_z * along_z;
    }
    motion.velocity += strength_ * u;
    motion.acceleration += strength_ * rate + strength_rate_ * u;
    motion.velocity_gradient += strength_ * u_gradient;
    motion.acceleration_gradient += strength_ * rate_gradient + strength_rate_ * u_gradient;
}

}  // namespace sim_core
