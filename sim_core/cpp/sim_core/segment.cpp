// SPDX-License-Identifier: Apache-2.0
#include "segment.hpp"

#include <algorithm>
#include <cmath>

namespace sim_core {

namespace {

/// Tension above its lower bound: linear above +s, zero below −s, a parabola between (continuous slope).
inline void round_off(double linear_tension, double s, double& tension, double& slope) {
    if (linear_tension >= s) {
        tension = linear_tension;
        slope = 1.0;
    } else if (linear_tension <= -s) {
        tension = 0.0;
        slope = 0.0;
    } else {
        const double above = linear_tension + s;
        tension = above * above / (4.0 * s);
        slope = above / (2.0 * s);
    }
}

/// Immersed fraction of the half segment next to `own`, centred at a quarter of the segment. Heights above the surface.
inline void half_wetness(double own_z, double other_z, double radius, EndCache& end) {
    if (std::max(own_z, other_z) + radius <= 0.0) {
        end.wet = 1.0;
        end.wet_own = end.wet_other = 0.0;
        return;
    }
    const double quarter_rise = 0.25 * (other_z - own_z);
    const double half_height = std::sqrt(quarter_rise * quarter_rise + radius * radius);
    const double depth = -(own_z + quarter_rise) / half_height;
    const Wetness w = wetness(depth);
    end.wet = w.fraction;
    const double height_slope = 0.25 * quarter_rise / half_height;  // d half_height / d other_z
    end.wet_own = w.slope * (-0.75 + depth * height_slope) / half_height;
    end.wet_other = w.slope * (-0.25 - depth * height_slope) / half_height;
}

inline void end_forces(const SegmentConstants& c, const EndMotion& motion, const Vec3& t, EndCache& end) {
    const Vec3 acceleration = motion.acceleration - motion.water.acceleration;
    end.acceleration = acceleration;
    const Vec3 flow = motion.water.velocity - motion.velocity;
    end.tangential_flow = flow.dot(t);
    end.normal_flow = flow - end.tangential_flow * t;
    end.normal_speed = end.normal_flow.norm();
    end.immersed_force =
        (c.half_normal_drag * end.normal_speed) * end.normal_flow +
        (c.half_tangential_drag * std::abs(end.tangential_flow) * end.tangential_flow +
         c.half_added_mass * acceleration.dot(t)) * t -
        c.half_added_mass * acceleration + c.half_displaced_mass * motion.water.acceleration;
    end.immersed_force.z() += c.half_buoyancy;
    end.force = end.wet * end.immersed_force - c.half_mass * motion.acceleration;
    end.force.z() -= c.half_weight;
}

}  // namespace

void segment_forces(const SegmentConstants& c, const EndMotion& a, const EndMotion& b, SegmentCache& cache) {
    const Vec3 span = b.position - a.position;
    // The tiny term keeps the tangent defined when the two ends of a slack segment meet.
    const double length = std::sqrt(span.squaredNorm() + 1e-18 * c.length * c.length);
    cache.inverse_length = 1.0 / length;
    cache.tangent = span * cache.inverse_length;
    const Vec3& t = cache.tangent;

    const Vec3 rate = b.velocity - a.velocity;
    const double stretching = t.dot(rate);
    cache.normal_rate = rate - stretching * t;
    const double linear_tension =
        (c.axial_stiffness * (length - c.length) + c.axial_damping * stretching) / c.length;
    round_off(linear_tension + c.buckling_force, c.slack_tension, cache.tension, cache.tension_slope);
    cache.tension -= c.buckling_force;

    const double height_a = a.position.z() - a.water.elevation;
    const double height_b = b.position.z() - b.water.elevation;
    half_wetness(height_a, height_b, c.radius, cache.a);
    half_wetness(height_b, height_a, c.radius, cache.b);
    end_forces(c, a, t, cache.a);
    end_forces(c, b, t, cache.b);
    const Vec3 pull = cache.tension * t;
    cache.a.force += pull;
    cache.b.force -= pull;
}

void segment_jacobian(const SegmentConstants& c, const SegmentCache& cache, SegmentJacobian& jacobian) {
    const Vec3& t = cache.tangent;
    const Mat3 along = t * t.transpose();
    const Mat3 across = Mat3::Identity() - along;
    const double inverse_length = cache.inverse_length;

    const double stiffness = cache.tension_slope * c.axial_stiffness / c.length;
    const double damping = cache.tension_slope * c.axial_damping / c.length;
    // d(T t)/d(x_b), and minus that for x_a
    Mat3 tension = stiffness * along + (cache.tension * inverse_length) * across;
    if (damping != 0.0) tension += (damping * inverse_length) * t * cache.normal_rate.transpose();
    const Mat3 tension_rate = damping * along;

    const EndCache* ends[2] = {&cache.a, &cache.b};
    for (int i = 0; i < 2; ++i) {
        const EndCache& end = *ends[i];
        const double u_t = end.tangential_flow;
        const double abs_t = std::abs(u_t);
        const double inverse_speed = end.normal_speed > 0.0 ? 1.0 / end.normal_speed : 0.0;
        const double k_n = end.wet * c.half_normal_drag;
        const double k_t = end.wet * c.half_tangential_drag;
        const double e = end.wet * c.half_added_mass;
        const Mat3 flow_flow = (k_n * inverse_speed) * end.normal_flow * end.normal_flow.transpose();

        // Turning of the segment: δt = (I − t tᵀ) δ(x_b − x_a) / length
        const double a_t = end.acceleration.dot(t);
        const Vec3 row = (2.0 * k_t * abs_t - k_n * end.normal_speed) * end.normal_flow +
                         e * (end.acceleration - a_t * t);
        Mat3 turning = t * row.transpose() - u_t * flow_flow +
                       (k_t * abs_t * u_t - k_n * end.normal_speed * u_t + e * a_t) * across;
        turning *= inverse_length;

        const Mat3 drag_rate = flow_flow + (k_n * end.normal_speed) * across + (2.0 * k_t * abs_t) * along;

        const int other = 1 - i;
        const double sign = i == 0 ? 1.0 : -1.0;  // the tension pulls end a along +t, end b along −t
        Mat3& to_b = jacobian.position[i][1];
        to_b = sign * tension + turning;
        jacobian.position[i][0] = -to_b;
        if (end.wet_own != 0.0 || end.wet_other != 0.0) {
            jacobian.position[i][i].col(2) += end.wet_own * end.immersed_force;
            jacobian.position[i][other].col(2) += end.wet_other * end.immersed_force;
        }
        jacobian.velocity[i][other] = tension_rate;
        jacobian.velocity[i][i] = -tension_rate - drag_rate;
        jacobian.acceleration[i] = -c.half_mass * Mat3::Identity() - e * across;
    }
}

void add_water_gradients(const SegmentConstants& c, const SegmentCache& cache, const WaterMotion& water_a,
                         const WaterMotion& water_b, SegmentJacobian& jacobian) {
    const EndCache* ends[2] = {&cache.a, &cache.b};
    const WaterMotion* water[2] = {&water_a, &water_b};
    for (int i = 0; i < 2; ++i) {
        const EndCache& end = *ends[i];
        const int other = 1 - i;
        // Drag sees the water's velocity as it sees the end's, but for the sign; tension, which sees the ends' alone,
        // cancels in the sum. Likewise with the accelerations.
        const Mat3 drag_rate = -(jacobian.velocity[i][i] + jacobian.velocity[i][other]);
        const Mat3 pull = (end.wet * c.half_displaced_mass - c.half_mass) * Mat3::Identity() - jacobian.acceleration[i];
        jacobian.position[i][i] += drag_rate * water[i]->velocity_gradient + pull * water[i]->acceleration_gradient;
        if (end.wet_own != 0.0 || end.wet_other != 0.0) {
            const Vec3 own_slope = end.wet_own * water[i]->height_slope();
            const Vec3 other_slope = end.wet_other * water[other]->height_slope();
            jacobian.position[i][i].leftCols<2>() += end.immersed_force * own_slope.head<2>().transpose();
            jacobian.position[i][other].leftCols<2>() += end.immersed_force * other_slope.head<2>().transpose();
        }
    }
}

double segment_elastic_energy(const SegmentConstants& c, const Vec3& a, const Vec3& b) {
    const double stiffness = c.axial_stiffness / c.length;
    const double linear_tension = stiffness * ((b - a).norm() - c.length);
    // With u the tension above its lower bound −F: ∫ T dℓ = ∫ (u − F) dℓ
    const double s = c.slack_tension;
    const double F = c.buckling_force;
    const double above = linear_tension + F;
    double energy = -F * (linear_tension + 0.5 * F);
    if (above > -s) {
        const double in_parabola = std::min(above, s) + s;
        energy += in_parabola * in_parabola * in_parabola / (12.0 * s);
    }
    if (above > s) energy += 0.5 * (above * above - s * s);
    return energy / stiffness;
}

}  // namespace sim_core
