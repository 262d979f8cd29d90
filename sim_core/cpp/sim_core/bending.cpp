// SPDX-License-Identifier: Apache-2.0
#include "bending.hpp"

#include <algorithm>
#include <cmath>

namespace sim_core {

namespace {

/// In a folded line sin θ is 0 and θ is not; this much keeps the quotients defined.
constexpr double kSmallestSine = 1e-9;

/// θ/sin θ and (sin θ − θ cos θ)/sin³θ.
struct AngleRatios {
    double first, second;
};

AngleRatios angle_ratios(double sine, double cosine) {
    const double angle = std::atan2(sine, cosine);
    if (angle < 0.02) {  // series, to θ⁶: below, the difference in the second loses digits
        const double a = angle * angle;
        return {1.0 + a * (1.0 / 6.0 + a * (7.0 / 360.0)), 1.0 / 3.0 + a * (2.0 / 15.0 + a * (2.0 / 63.0))};
    }
    const double s = std::max(sine, kSmallestSine);
    return {angle / s, (sine - angle * cosine) / (s * s * s)};
}

}  // namespace

void bend(double stiffness, const Vec3& first_span, const Vec3& second_span, BendingCache& b) {
    const Vec3* spans[2] = {&first_span, &second_span};
    for (int i = 0; i < 2; ++i) {
        b.inverse_length[i] = 1.0 / std::max(spans[i]->norm(), 1e-12);
        b.tangent[i] = b.inverse_length[i] * *spans[i];
    }
    b.cosine = b.tangent[0].dot(b.tangent[1]);
    const AngleRatios ratios = angle_ratios(b.tangent[0].cross(b.tangent[1]).norm(), b.cosine);
    b.slope = -stiffness * ratios.first;
    b.curvature = stiffness * ratios.second;
    for (int i = 0; i < 2; ++i) {
        b.cosine_slope[i] = b.inverse_length[i] * (b.tangent[1 - i] - b.cosine * b.tangent[i]);
        b.energy_slope[i] = b.slope * b.cosine_slope[i];
    }
}

void bending_jacobian(const BendingCache& b, BendingJacobian& jacobian) {
    Mat3* own[2] = {&jacobian.first, &jacobian.second};
    for (int i = 0; i < 2; ++i) {
        const Vec3& t = b.tangent[i];
        const Vec3& g = b.cosine_slope[i];
        const double l = b.inverse_length[i];
        *own[i] = b.curvature * g * g.transpose() -
                  (b.slope * l) * (t * g.transpose() + g * t.transpose() +
                                   (b.cosine * l) * (Mat3::Identity() - t * t.transpose()));
    }
    const double lengths = b.inverse_length[0] * b.inverse_length[1];
    const Vec3& t0 = b.tangent[0];
    const Vec3& t1 = b.tangent[1];
    const Mat3 turn = Mat3::Identity() - t1 * t1.transpose() - t0 * (t0 - b.cosine * t1).transpose();
    jacobian.mixed = b.curvature * b.cosine_slope[0] * b.cosine_slope[1].transpose() + (b.slope * lengths) * turn;
}

double bending_energy(double stiffness, const Vec3& first_span, const Vec3& second_span) {
    const double angle = std::atan2(first_span.cross(second_span).norm(), first_span.dot(second_span));
    return 0.5 * stiffness * angle * angle;
}

}  // namespace sim_core
