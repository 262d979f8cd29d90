// SPDX-License-Identifier: Apache-2.0
#include "water.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "motion.hpp"

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

namespace {

/// The widest build of the kernel that this machine runs: all give the same bits.
const WaveKernel& best_kernel() {
#ifdef SIM_CORE_AVX2
    if (__builtin_cpu_supports("avx2")) return kWaveKernelAvx2;
#endif
    return kWaveKernel;
}

}  // namespace

WaterProbe::WaterProbe(const Water& water) : WaterProbe(water, best_kernel()) {}

WaterProbe::WaterProbe(const Water& water, const WaveKernel& kernel) : current_(water.current), kernel_(kernel) {
    const std::size_t trains = water.waves ? water.waves->trains().size() : 0;
    const std::size_t n = (trains + kWaveLanes - 1) / kWaveLanes * kWaveLanes;
    for (std::vector<double>* array : {&k_, &k_x_, &k_y_, &frequency_, &phase_, &decay_, &finite_, &phase_now_}) {
        array->assign(n, 0.0);
    }
    weights_.assign(kWaveRows * n, 0.0);
    room_.assign(6 * n, 0.0);
    if (trains > 0) {
        depth_ = water.waves->depth();
        ramp_time_ = water.waves->ramp_time();
    }
    for (std::size_t i = 0; i < trains; ++i) {
        const WaveTrain& w = water.waves->trains()[i];
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
        const double bend = rate * w.wave_number;
        const double of_train[kWaveRows] = {
            // cos θ: ζ; its curvature xx, xy, yy
            w.amplitude, -w.amplitude * k_x_[i] * k_x_[i], -w.amplitude * k_x_[i] * k_y_[i],
            -w.amplitude * k_y_[i] * k_y_[i],
            // sin θ: slopes of ζ
            -w.amplitude * k_x_[i], -w.amplitude * k_y_[i],
            // C cos θ: u, v; gradient of ∂u/∂t: xx, xy, yy; curvature of u: xxx, xxy, xyy, yyy
            speed * x, speed * y, rate * w.frequency * x * x, rate * w.frequency * x * y, rate * w.frequency * y * y,
            -bend * x * x * x, -bend * x * x * y, -bend * x * y * y, -bend * y * y * y,
            // C sin θ: ∂u/∂t, ∂v/∂t; gradient of u: xx, xy, yy
            speed * w.frequency * x, speed * w.frequency * y, -rate * x * x, -rate * x * y, -rate * y * y,
            // S cos θ: ∂w/∂t; gradient of u: xz, yz
            -speed * w.frequency, rate * x, rate * y,
            // S sin θ: w; gradient of ∂u/∂t: xz, yz; curvature of u: xxz, xyz, yyz
            speed, rate * w.frequency * x, rate * w.frequency * y, -bend * x * x, -bend * x * y, -bend * y * y};
        for (std::size_t row = 0; row < kWaveRows; ++row) weights_[row * n + i] = of_train[row];
    }
    set_time(0.0);
}

void WaterProbe::set_time(double time) {
    if (current_.series) current_.series->at(time, series_velocity_, series_acceleration_);
    if (k_.empty()) return;
    for (std::size_t i = 0; i < k_.size(); ++i) {
        phase_now_[i] = std::remainder(phase_[i] - time * frequency_[i], 2.0 * std::numbers::pi);
    }
    const Ramp r = ramp(time, ramp_time_);
    strength_ = r.value;
    strength_rate_ = r.rate;
}

void WaterProbe::at(const Vec3& position, WaterMotion& motion, bool curved) {
    motion = WaterMotion();
    motion.velocity = current_.uniform + series_velocity_;
    motion.acceleration = series_acceleration_;
    if (!k_.empty()) add_waves(position, motion, curved);
    if (current_.profile) {
        Vec3 velocity, slope;
        current_.profile->at(position.z(), velocity, slope);
        motion.velocity += velocity;
        motion.velocity_gradient.col(2) += slope;
        if (curved) motion.velocity_curvature[2].col(2) += current_.profile->curvature(position.z());
    }
}

void WaterProbe::add_waves(const Vec3& position, WaterMotion& motion, bool curved) {
    const std::size_t n = k_.size();
    double* room = room_.data();
    const WaveArrays trains{n, k_.data(), k_x_.data(), k_y_.data(), phase_now_.data(), decay_.data(), finite_.data(),
                            weights_.data(), room, room + n, room + 2 * n, room + 3 * n, room + 4 * n, room + 5 * n};
    SurfaceSums surface;
    kernel_.surface(trains, position.x(), position.y(), curved, surface);
    motion.elevation = strength_ * surface.cosine[0];
    motion.elevation_x = strength_ * surface.sine[0];
    motion.elevation_y = strength_ * surface.sine[1];

    // Wheeler's height and its derivatives with respect to z and ζ
    const double height = position.z() - motion.elevation;
    double z = height;
    double z_z = 1.0;
    double z_elevation = -1.0;
    double z_z_elevation = 0.0;
    double z_elevation_elevation = 0.0;
    if (!std::isinf(depth_)) {
        const double stretch = depth_ / std::max(depth_ + motion.elevation, 1e-3 * depth_);
        const double above_floor = (depth_ + position.z()) / depth_;
        z = height * stretch;
        z_z = stretch;
        z_elevation = -stretch * stretch * above_floor;
        z_z_elevation = -stretch * stretch / depth_;
        z_elevation_elevation = 2.0 * stretch * stretch * stretch * above_floor / depth_;
    }
    if (z > 0.0 || z < -depth_) {
        z = std::clamp(z, -depth_, 0.0);
        z_z = z_elevation = z_z_elevation = z_elevation_elevation = 0.0;
    }

    DepthSums sums;
    kernel_.below(trains, z, curved, sums);
    const double(&c_cos)[kOfCCosineCurved] = sums.C_cosine;
    const double(&c_sin)[kOfCSine] = sums.C_sine;
    const double(&s_cos)[kOfSCosine] = sums.S_cosine;
    const double(&s_sin)[kOfSSineCurved] = sums.S_sine;

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
    const Vec3 z_slope(z_elevation * motion.elevation_x, z_elevation * motion.elevation_y, z_z);  // gradient of z'
    if (curved) {
        const double xxx = c_cos[5], xxy = c_cos[6], xyy = c_cos[7], yyy = c_cos[8];
        const double xxz = s_sin[3], xyz = s_sin[4], yyz = s_sin[5];
        const Mat3 still[3] = {gradient(xxx, xxy, xyy, xxz, xyz), gradient(xxy, xyy, yyy, xyz, yyz),
                               gradient(xxz, xyz, yyz, -xxx - xyy, -xxy - yyy)};
        const Vec3 slope(motion.elevation_x, motion.elevation_y, 0.0);
        Mat3 z_curvature = z_elevation_elevation * slope * slope.transpose();
        z_curvature(0, 0) += z_elevation * strength_ * surface.cosine[1];
        z_curvature(0, 1) += z_elevation * strength_ * surface.cosine[2];
        z_curvature(1, 0) += z_elevation * strength_ * surface.cosine[2];
        z_curvature(1, 1) += z_elevation * strength_ * surface.cosine[3];
        z_curvature.col(2) += z_z_elevation * slope;
        z_curvature.row(2) += z_z_elevation * slope.transpose();
        for (int j = 0; j < 3; ++j) {
            for (int k = 0; k < 3; ++k) {
                Vec3 second = (z_slope[j] * z_slope[k]) * still[2].col(2) + z_curvature(j, k) * u_gradient.col(2);
                if (j < 2) second += z_slope[k] * still[j].col(2);
                if (k < 2) second += z_slope[j] * still[k].col(2);
                if (j < 2 && k < 2) second += still[j].col(k);
                motion.velocity_curvature[j].col(k) += strength_ * second;
            }
        }
    }
    for (Mat3* g : {&u_gradient, &rate_gradient}) {
        const Vec3 along_z = g->col(2);
        g->col(2).setZero();
        *g += along_z * z_slope.transpose();
    }
    motion.velocity += strength_ * u;
    motion.acceleration += strength_ * rate + strength_rate_ * u;
    motion.velocity_gradient += strength_ * u_gradient;
    motion.acceleration_gradient += strength_ * rate_gradient + strength_rate_ * u_gradient;
}

}  // namespace sim_core
