// SPDX-License-Identifier: Apache-2.0
#include "fin.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "error.hpp"

namespace sim_core {

double aspect_ratio_of(double lift_slope) {
    constexpr double kAerofoil = 2.0 * std::numbers::pi;
    if (lift_slope >= kAerofoil) return std::numeric_limits<double>::infinity();
    return 4.0 * kAerofoil * lift_slope / (kAerofoil * kAerofoil - lift_slope * lift_slope);
}

FinForce::FinForce(const Fin& fin, double density)
    : position_(fin.position),
      pressure_(0.5 * density * fin.area),
      lift_slope_(fin.lift_slope),
      drag_(fin.drag),
      induced_(0.0),
      cross_flow_drag_(fin.cross_flow_drag),
      stall_sine_(std::sin(fin.stall_angle)),
      half_height_(0.5 * std::sqrt(fin.area)) {
    if (lift_slope_ > 0.0) {
        induced_ = lift_slope_ * lift_slope_ /
                   (std::numbers::pi * fin.aspect_ratio.value_or(aspect_ratio_of(lift_slope_)));
    }
    normal_ = fin.normal.normalized();
    chord_ = Vec3::UnitX() - normal_.x() * normal_;
    if (!(chord_.norm() > 1e-6)) throw InvalidInput("the fin's normal must not point along the body's x axis");
    chord_.normalize();
}

double FinForce::level_off(double s, double& slope) const {
    // S(s) = s / (1 + (s/s0)^8)^(1/8): linear to 0.05 % at half the stall angle, level at s0
    const double ratio = s / stall_sine_;
    const double ratio4 = ratio * ratio * ratio * ratio;
    const double blend = 1.0 + ratio4 * ratio4;
    const double root = std::sqrt(std::sqrt(std::sqrt(blend)));
    slope = 1.0 / (root * blend);
    return s / root;
}

double FinForce::incidence(const Vec3& flow, Vec3& flow_derivative) const {
    const double c = -flow.dot(chord_);
    const double w = flow.dot(normal_);
    const double q = std::sqrt(c * c + w * w);
    if (q < 1e-12) {
        flow_derivative.setZero();
        return 0.0;
    }
    double slope;
    const double sine = level_off(w / q, slope);
    flow_derivative = (slope * c / (q * q * q)) * (c * normal_ + w * chord_);
    return sine;
}

void FinForce::evaluate(const Vec3& flow, Vec3& force, Mat3& flow_derivative) const {
    const double c = -flow.dot(chord_);
    const double w = flow.dot(normal_);
    const double q = std::sqrt(c * c + w * w);
    if (q < 1e-12) {
        force.setZero();
        flow_derivative.setZero();
        return;
    }
    double slope;
    const double sine = level_off(w / q, slope);
    const double lift = lift_slope_ * sine;
    const double lift_ds = lift_slope_ * slope;
    const double s_c = -w * c / (q * q * q);
    const double s_w = c * c / (q * q * q);

    // Profile and induced drag over the speed, and its derivatives
    const double along = drag_ * q + induced_ * sine * sine * c * c / q;
    const double along_c = drag_ * c / q + induced_ * sine * c * (2.0 * (slope * s_c * c + sine) - sine * c * c / (q * q)) / q;
    const double along_w = drag_ * w / q + induced_ * sine * c * c * (2.0 * slope * s_w - sine * w / (q * q)) / q;

    // components along the normal (n) and the forward chord (x), in units of ½ρS
    const double n = lift * c * c + along * w + cross_flow_drag_ * std::abs(w) * w;
    const double x = lift * c * w - along * c;
    const double n_c = lift_ds * s_c * c * c + 2.0 * lift * c + along_c * w;
    const double n_w = lift_ds * s_w * c * c + along + along_w * w + 2.0 * cross_flow_drag_ * std::abs(w);
    const double x_c = lift_ds * s_c * c * w + lift * w - along - along_c * c;
    const double x_w = lift_ds * s_w * c * w + lift * c - along_w * c;

    force = pressure_ * (n * normal_ + x * chord_);
    flow_derivative = pressure_ * ((n_w * normal_ + x_w * chord_) * normal_.transpose() -
                                   (n_c * normal_ + x_c * chord_) * chord_.transpose());
}

}  // namespace sim_core
