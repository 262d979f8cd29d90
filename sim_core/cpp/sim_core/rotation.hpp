// SPDX-License-Identifier: Apache-2.0
// Rotations as unit quaternions with increments as rotation vectors in body axes.
#pragma once

#include <cmath>

#include "types.hpp"

namespace sim_core {

/// The matrix of the cross product: skew(a) b = a × b.
inline Mat3 skew(const Vec3& a) {
    Mat3 m;
    m << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
    return m;
}

/// The rotation by the angle |theta| (rad) about theta: the exponential map of SO(3).
inline Quat rotation_from_vector(const Vec3& theta) {
    const double angle_squared = theta.squaredNorm();
    double half_sinc;  // sin(angle / 2) / angle
    double cosine;
    if (angle_squared < 1e-8) {  // series, exact to rounding below 1e-4 rad
        half_sinc = 0.5 - angle_squared / 48.0;
        cosine = 1.0 - angle_squared / 8.0 + angle_squared * angle_squared / 384.0;
    } else {
        const double angle = std::sqrt(angle_squared);
        half_sinc = std::sin(0.5 * angle) / angle;
        cosine = std::cos(0.5 * angle);
    }
    return {cosine, half_sinc * theta.x(), half_sinc * theta.y(), half_sinc * theta.z()};
}

/// The right Jacobian of the exponential map: exp(theta + d) = exp(theta) exp(J d) to first order in d.
/// (Arnold & Brüls 2007 call it the tangent operator.)
inline Mat3 right_jacobian(const Vec3& theta) {
    const double angle_squared = theta.squaredNorm();
    double first;   // (1 - cos) / angle²
    double second;  // (angle - sin) / angle³
    if (angle_squared < 1e-4) {
        first = 0.5 - angle_squared / 24.0 + angle_squared * angle_squared / 720.0;
        second = 1.0 / 6.0 - angle_squared / 120.0 + angle_squared * angle_squared / 5040.0;
    } else {
        const double angle = std::sqrt(angle_squared);
        first = (1.0 - std::cos(angle)) / angle_squared;
        second = (angle - std::sin(angle)) / (angle_squared * angle);
    }
    const Mat3 s = skew(theta);
    return Mat3::Identity() - first * s + second * s * s;
}

}  // namespace sim_core
