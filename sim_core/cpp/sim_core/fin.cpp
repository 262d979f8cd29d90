// SPDX-License-Identifier: Apache-2.0
#include "fin.hpp"

#include <cmath>

#include "error.hpp"

namespace sim_core {

FinForce::FinForce(const Fin& fin, double density)
    : position_(fin.position),
      pressure_(0.5 * density * fin.area),
      lift_slope_(fin.lift_slope),
      drag_(fin.drag),
      cross_flow_drag_(fin.cross_flow_drag),
      stall_sine_(std::sin(fin.stall_angle)),
      half_height_(0.5 * std::sqrt(fin.area)) {
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
    const double lift = lift_slope_ * level_off(w / q, slope);
    const double lift_ds = lift_slope_ * slope;
    const double s_c = -w * c / (q * q * q);
    const double s_w = c * c / (q * q * q);

    // components along the normal (n) and the forward chord (x), in units of ½ρS
    const double n = lift * c * c + drag_ * q * w + cross_flow_drag_ * std::abs(w) * w;
    const double x = lift * c * w - drag_ * q * c;
    const double n_c = lift_ds * s_c * c * c + 2.0 * lift * c + drag_ * c * w / q;
    const double n_w = lift_ds * s_w * c * c + drag_ * (q + w * w / q) + 2.0 * cross_flow_drag_ * std::abs(w);
    const double x_c = lift_ds * s_c * c * w + lift * w - drag_ * (q + c * c / q);
    const double x_w = lift_ds * s_w * c * w + lift * c - drag_ * c * w / q;

    force = pressure_ * (n * normal_ + x * chord_);
    flow_derivative = pressure_ * ((n_w * normal_ + x_w * chord_) * normal_.transpose() -
                                   (n_c * normal_ + x_c * chord_) * chord_.transpose());
}

}  // namespace sim_core
