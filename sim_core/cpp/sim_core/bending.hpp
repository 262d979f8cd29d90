// SPDX-License-Identifier: Apache-2.0
// Torsion spring between two consecutive straight pieces of a line, on translational degrees of freedom.
#pragma once

#include "types.hpp"

namespace sim_core {

/// Intermediate results of a spring, kept from the forces for their derivatives. The energy is U = ½ k θ², θ the
/// angle between the two spans.
struct BendingCache {
    Vec3 tangent[2];
    double inverse_length[2];  ///< 1/m
    double cosine;             ///< of θ
    double slope;              ///< dU/d(cos θ) = −k θ/sin θ, N·m
    double curvature;          ///< d²U/d(cos θ)², N·m
    Vec3 cosine_slope[2];      ///< d(cos θ)/d(span), 1/m
    Vec3 energy_slope[2];      ///< dU/d(span), N
};

/// Second derivatives of U with respect to the two spans, N/m.
struct BendingJacobian {
    Mat3 first, second;
    Mat3 mixed;  ///< row: first span, column: second
};

/// A spring of `stiffness` (N·m/rad) between two spans (m). Written in cos θ, U and all its derivatives are smooth in the straight
/// line, and they are finite up to where a line folds back on itself (θ = π), where the direction of the force is lost.
void bend(double stiffness, const Vec3& first_span, const Vec3& second_span, BendingCache& cache);

/// Derivatives at the spans for which `cache` was filled.
void bending_jacobian(const BendingCache& cache, BendingJacobian& jacobian);

/// ½ k θ², J.
double bending_energy(double stiffness, const Vec3& first_span, const Vec3& second_span);

}  // namespace sim_core
