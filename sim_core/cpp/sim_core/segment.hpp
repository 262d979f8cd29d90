// SPDX-License-Identifier: Apache-2.0
// One straight segment of a line: forces on its two ends and their derivatives.
#pragma once

#include <memory>

#include "curve.hpp"
#include "types.hpp"
#include "water.hpp"

namespace sim_core {

/// What the forces on a segment need to know of it, gathered once when the model is built.
/// "Half" quantities belong to one end: everything distributed is lumped half to each end.
struct SegmentConstants {
    double length;            ///< unstretched, m
    double axial_stiffness;   ///< EA, N
    double axial_damping;     ///< N·s: tension per strain rate
    double slack_tension;     ///< N: the tension is rounded off within this of its lower bound
    double buckling_force;    ///< N: the compression at which the segment gives way, π²EI/ℓ²; 0 without EI
    double length_rate;       ///< m/s, of the unstretched length: not 0 where a winch runs
    double half_mass;         ///< kg
    double half_weight;       ///< N, in air
    double half_buoyancy;     ///< N, immersed
    double half_displaced_mass;   ///< kg of water, immersed
    double half_normal_drag;      ///< ½ ρ Cn d ℓ/2, N/(m/s)²; with Cn = 1 where it follows a curve
    double half_tangential_drag;  ///< ½ ρ Ct π d ℓ/2, N/(m/s)²; likewise
    double half_lift;             ///< ½ ρ Cl d ℓ/2, N/(m/s)²
    double half_added_mass;   ///< Ca ρ (π d²/4) ℓ/2, kg, across
    double half_tangential_added_mass;  ///< and along
    double radius;            ///< of the section, m: half height of a horizontal segment
    double reynolds_per_speed;    ///< d/ν, s/m
    // Absent where EA, Cn and Ct are constant
    std::shared_ptr<const Curve> tension_curve;          ///< tension (N) over strain
    std::shared_ptr<const Curve> normal_drag_curve;      ///< Cn over ln(|u_n| d/ν)
    std::shared_ptr<const Curve> tangential_drag_curve;  ///< Ct over ln(|u_t| d/ν)
};

/// Position, velocity and acceleration of one end in tank axes.
struct EndMotion {
    const Vec3& position;
    const Vec3& velocity;
    const Vec3& acceleration;
    const WaterMotion& water;  ///< at the end
};

/// Intermediate results at one end, kept from the forces for their derivatives.
struct EndCache {
    Vec3 force;             ///< N, on the end, tank axes; inertia included
    Vec3 immersed_force;    ///< what of it scales with the immersed fraction, at fraction 1
    Vec3 normal_flow;       ///< relative water velocity across the segment, m/s
    double normal_speed;
    double tangential_flow;
    double normal_factor;         ///< drag across per normal flow, N/(m/s)
    double normal_factor_slope;   ///< its derivative with respect to the normal speed
    double tangential_factor;     ///< and the same along the segment
    double tangential_factor_slope;
    Vec3 acceleration;      ///< relative to the water's, m/s²
    double wet;             ///< immersed fraction of this half
    double wet_own;         ///< its derivative with respect to this end's height above the surface, 1/m
    double wet_other;       ///< … and to the other end's
};

struct SegmentCache {
    Vec3 tangent;           ///< from end a to end b
    double inverse_length;  ///< 1/m, stretched
    double tension;         ///< N
    double axial_stiffness; ///< N: slope of the elastic tension over the strain
    double tension_slope;   ///< d tension / d(EA ε + damping ε̇): 1 taut, 0 slack
    Vec3 normal_rate;       ///< relative velocity of the ends across the segment, m/s
    EndCache a, b;
};

/// Derivatives of the force on end i with respect to position, velocity, acceleration of end j.
struct SegmentJacobian {
    Mat3 position[2][2];
    Mat3 velocity[2][2];
    Mat3 acceleration[2];  ///< an end's force depends on its own acceleration only
};

/// Forces on both ends (F − M a, so that the sum over all neighbours of a node vanishes).
///
/// Tension EA ε + c ε̇, no compression beyond the segment's own buckling force; weight and buoyancy; drag
/// ½ρ Cn d |u_n| u_n + ½ρ Ct π d |u_t| u_t and lift ½ρ Cl d |u_n| t × u_n per length; added mass e (I − t tᵀ). Drag and added mass
/// act at each half with that end's own velocity and acceleration (trapezoidal rule along the segment),
/// so that a zigzag of neighbouring nodes is damped as well. Water that accelerates pulls with the displaced mass (its
/// pressure gradient: Froude–Krylov) and across the segment with the added mass.
void segment_forces(const SegmentConstants& constants, const EndMotion& a, const EndMotion& b, SegmentCache& cache);

/// Derivatives at the state for which `cache` was filled, with the same water everywhere.
void segment_jacobian(const SegmentConstants& constants, const SegmentCache& cache, SegmentJacobian& jacobian);

/// Adds the derivatives that come from the water's gradients at the two ends.
void add_water_gradients(const SegmentConstants& constants, const SegmentCache& cache, const WaterMotion& water_a,
                         const WaterMotion& water_b, SegmentJacobian& jacobian);

/// Elastic energy, J (of the tension without damping, rounding at slack included).
double segment_elastic_energy(const SegmentConstants& constants, const Vec3& a, const Vec3& b);

}  // namespace sim_core
