// SPDX-License-Identifier: Apache-2.0
#include "segment.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "rotation.hpp"

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

struct DragFactor {
    double value;  ///< force per speed, N/(m/s)
    double slope;  ///< its derivative with respect to the speed
};

/// Drag over speed, half_drag · C · speed; `curve` gives C over the logarithm of the Reynolds number, if there is one.
inline DragFactor drag_factor(double half_drag, const Curve* curve, double reynolds_per_speed, double speed) {
    if (!curve) return {half_drag * speed, half_drag};
    constexpr double kSlowest = 1e-100;  // keeps the logarithm finite; coefficients are level there
    const Curve::Value c = curve->at(std::log(std::max(reynolds_per_speed * speed, kSlowest)));
    return {half_drag * c.value * speed, half_drag * (c.value + c.slope)};
}

inline void end_forces(const SegmentConstants& c, const EndMotion& motion, const Vec3& t, EndCache& end) {
    const Vec3 acceleration = motion.acceleration - motion.water.acceleration;
    end.acceleration = acceleration;
    const Vec3 flow = motion.water.velocity - motion.velocity;
    end.tangential_flow = flow.dot(t);
    end.normal_flow = flow - end.tangential_flow * t;
    end.normal_speed = end.normal_flow.norm();
    const DragFactor normal =
        drag_factor(c.half_normal_drag, c.normal_drag_curve.get(), c.reynolds_per_speed, end.normal_speed);
    const DragFactor tangential = drag_factor(c.half_tangential_drag, c.tangential_drag_curve.get(),
                                              c.reynolds_per_speed, std::abs(end.tangential_flow));
    end.normal_factor = normal.value;
    end.normal_factor_slope = normal.slope;
    end.tangential_factor = tangential.value;
    end.tangential_factor_slope = tangential.slope;
    end.immersed_force = normal.value * end.normal_flow +
                         (tangential.value * end.tangential_flow +
                          (c.half_added_mass - c.half_tangential_added_mass) * acceleration.dot(t)) * t -
                         c.half_added_mass * acceleration + c.half_displaced_mass * motion.water.acceleration;
    if (c.half_lift != 0.0) end.immersed_force += (c.half_lift * end.normal_speed) * t.cross(end.normal_flow);
    end.immersed_force.z() += c.half_buoyancy;
    end.force = end.wet * end.immersed_force - c.half_mass * motion.acceleration;
    end.force.z() -= c.half_weight;
}

/// Derivatives of the lift with respect to a turn of the segment (times its length) and to the flow.
void add_lift(const SegmentConstants& c, const EndCache& end, const Vec3& t, const Mat3& across, Mat3& turning,
              Mat3& flow_rate) {
    if (end.normal_speed == 0.0) return;
    const double k = end.wet * c.half_lift;
    const Vec3 along_flow = end.normal_flow / end.normal_speed;
    const Mat3 side = t.cross(end.normal_flow) * along_flow.transpose();
    const Vec3 flow = end.normal_flow + end.tangential_flow * t;
    flow_rate += k * (side + end.normal_speed * skew(t));
    turning -= k * (end.tangential_flow * side + end.normal_speed * skew(flow) * across);
}

/// Where a curve that rises reaches a value; beyond its ends it is straight.
double strain_at(const Curve& curve, double tension) {
    double low = curve.abscissas().front() - 1.0;
    double high = curve.abscissas().back() + 1.0;
    while (curve.at(low).value > tension) low -= 2.0 * (high - low);
    while (curve.at(high).value < tension) high += 2.0 * (high - low);
    for (int i = 0; i < 100; ++i) {
        const double middle = 0.5 * (low + high);
        (curve.at(middle).value < tension ? low : high) = middle;
    }
    return high;
}

/// ∫ T dε of the rounded tension from fully slack (T = −F) up to `strain`. Exact: between the points of the curve and the
/// bounds of the rounding the integrand is a polynomial of the sixth degree, and four Gauss points suffice. As for
/// constant EA, the zero is chosen so that without rounding there is none at zero strain.
double integrate_curve(const Curve& curve, double strain, double s, double F) {
    constexpr double kPoint[2] = {0.3399810435848563, 0.8611363115940526};
    constexpr double kWeight[2] = {0.6521451548625461, 0.3478548451374538};
    std::vector<double> bounds = curve.abscissas();
    bounds.push_back(strain_at(curve, -s - F));
    bounds.push_back(strain_at(curve, s - F));
    bounds.push_back(strain);
    std::sort(bounds.begin(), bounds.end());
    const double slack = strain_at(curve, -s - F);
    const double from = std::min(slack, strain);
    const double to = std::max(slack, strain);
    const auto above = [&](double at) {
        double tension = 0.0;
        double slope = 0.0;
        round_off(curve.at(at).value + F, s, tension, slope);
        return tension;
    };
    double sum = 0.0;
    for (std::size_t i = 0; i + 1 < bounds.size(); ++i) {
        if (bounds[i] < from || bounds[i + 1] > to) continue;
        const double middle = 0.5 * (bounds[i] + bounds[i + 1]);
        const double half = 0.5 * (bounds[i + 1] - bounds[i]);
        for (int k = 0; k < 2; ++k) {
            sum += half * kWeight[k] * (above(middle - half * kPoint[k]) + above(middle + half * kPoint[k]));
        }
    }
    // what −F adds, from zero strain; below the curve's first point it is straight
    const double buckled = F / curve.at(curve.abscissas().front()).slope;
    return sum - F * (strain + 0.5 * buckled);
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
    cache.axial_stiffness = c.axial_stiffness;
    double elastic = c.axial_stiffness * (length - c.length) / c.length;
    if (c.tension_curve) {
        const Curve::Value curve = c.tension_curve->at((length - c.length) / c.length);
        elastic = curve.value;
        cache.axial_stiffness = curve.slope;
    }
    double extension_rate = stretching;
    if (c.length_rate != 0.0) {
        extension_rate -= length * c.length_rate / c.length;
        cache.axial_stiffness -= c.axial_damping * c.length_rate / c.length;
    }
    const double unlimited_tension = elastic + c.axial_damping * extension_rate / c.length;
    round_off(unlimited_tension + c.buckling_force, c.slack_tension, cache.tension, cache.tension_slope);
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

    const double stiffness = cache.tension_slope * cache.axial_stiffness / c.length;
    const double damping = cache.tension_slope * c.axial_damping / c.length;
    // d(T t)/d(x_b), and minus that for x_a
    Mat3 tension = stiffness * along + (cache.tension * inverse_length) * across;
    if (damping != 0.0) tension += (damping * inverse_length) * t * cache.normal_rate.transpose();
    const Mat3 tension_rate = damping * along;

    const EndCache* ends[2] = {&cache.a, &cache.b};
    for (int i = 0; i < 2; ++i) {
        const EndCache& end = *ends[i];
        const double u_t = end.tangential_flow;
        const double inverse_speed = end.normal_speed > 0.0 ? 1.0 / end.normal_speed : 0.0;
        const double k_n = end.wet * end.normal_factor;
        const double k_t = end.wet * end.tangential_factor;
        const double e = end.wet * c.half_added_mass;
        const double e_t = end.wet * c.half_tangential_added_mass;
        const Mat3 flow_flow = (end.wet * end.normal_factor_slope * inverse_speed) * end.normal_flow *
                               end.normal_flow.transpose();
        // d(tangential drag)/d(tangential flow)
        const double along_rate = k_t + end.wet * end.tangential_factor_slope * std::abs(u_t);

        // Turning of the segment: δt = (I − t tᵀ) δ(x_b − x_a) / length
        const double a_t = end.acceleration.dot(t);
        const Vec3 row = (along_rate - k_n) * end.normal_flow + (e - e_t) * (end.acceleration - a_t * t);
        Mat3 turning = t * row.transpose() - u_t * flow_flow + ((k_t - k_n) * u_t + (e - e_t) * a_t) * across;
        Mat3 drag_rate = flow_flow + k_n * across + along_rate * along;
        if (c.half_lift != 0.0) add_lift(c, end, t, across, turning, drag_rate);
        turning *= inverse_length;

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
        jacobian.acceleration[i] = -c.half_mass * Mat3::Identity() - e * across - e_t * along;
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
    const double strain = ((b - a).norm() - c.length) / c.length;
    const double s = c.slack_tension;
    const double F = c.buckling_force;
    if (c.tension_curve) return c.length * integrate_curve(*c.tension_curve, strain, s, F);
    // With u the tension above its lower bound −F: ∫ T dℓ = ∫ (u − F) dℓ
    const double linear_tension = c.axial_stiffness * strain;
    const double above = linear_tension + F;
    double energy = -F * (linear_tension + 0.5 * F);
    if (above > -s) {
        const double in_parabola = std::min(above, s) + s;
        energy += in_parabola * in_parabola * in_parabola / (12.0 * s);
    }
    if (above > s) energy += 0.5 * (above * above - s * s);
    return energy * c.length / c.axial_stiffness;
}

}  // namespace sim_core
