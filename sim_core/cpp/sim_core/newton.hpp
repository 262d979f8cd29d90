// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "equations.hpp"
#include "state.hpp"

namespace sim_core {

struct NewtonSettings {
    int max_iterations = 20;
    double tolerance = 1e-8;  ///< of the residual, relative to the weight in air of the whole system
};

struct NewtonResult {
    bool converged;
    int iterations;
    double residual;  ///< N
    int worst_block;
};

/// Room for one Newton solution.
struct NewtonWorkspace {
    explicit NewtonWorkspace(int blocks) : displacement(blocks), next(blocks) {}
    std::vector<Vec3> displacement;
    std::vector<Vec3> next;
};

/// The residual to reach, N. Positions carry a relative rounding of 1e-16, which the stiffest segment turns into a
/// force: no more can be asked for. Where that comes to over a thousandth of the weight, there is no solution worth the
/// name, and the iteration is left to fail.
inline double newton_tolerance(const Model& model, const State& state, const NewtonSettings& settings) {
    double reach = 1.0;
    for (const Vec3& p : state.position) reach = std::max(reach, p.squaredNorm());
    const double rounding = 8e-16 * model.stiffest_segment * std::sqrt(reach);
    return settings.tolerance * model.force_scale + std::min(rounding, 1e-3 * model.force_scale);
}

/// Solves F = 0 from the given state on, with the analytic Jacobian and a damped Newton iteration.
///
/// `correct(displacement, factor)` moves the state by factor times a displacement. A trial is accepted if it
/// lowers the residual, or if the next (simplified) Newton correction from it is shorter than this one: the natural
/// monotonicity test (Deuflhard 2011, Newton Methods for Nonlinear Problems, ch. 3). The residual alone
/// is a bad judge here, since a stiff cable that turns a little stretches a lot to second order. Otherwise the trial is
/// halved.
template <class Correct>
NewtonResult solve_newton(Equations& equations, State& state, const Rates& rates,
                          const NewtonSettings& settings, double tolerance, NewtonWorkspace& work,
                          Correct correct) {
    constexpr double kSmallestFactor = 1.0 / 256.0;
    NewtonResult result{false, 0, 0.0, 0};
    equations.evaluate(state);
    result.residual = equations.residual_norm(result.worst_block);
    while (true) {
        if (result.residual <= tolerance) {
            result.converged = true;
            return result;
        }
        if (result.iterations == settings.max_iterations || !std::isfinite(result.residual)) return result;
        ++result.iterations;
        equations.assemble(state, rates);
        equations.factor();
        equations.solve(work.displacement);
        const double length = equations.displacement_norm(work.displacement);
        if (!std::isfinite(length)) return result;

        double factor = 1.0;
        correct(work.displacement, factor);
        while (true) {
            int where = 0;
            equations.evaluate(state);
            const double residual = equations.residual_norm(where);
            bool accepted = residual <= tolerance || residual <= (1.0 - 0.5 * factor) * result.residual;
            if (!accepted && std::isfinite(residual)) {
                equations.solve(work.next);
                accepted = equations.displacement_norm(work.next) <= (1.0 - 0.25 * factor) * length;
            }
            if (accepted) {
                result.residual = residual;
                result.worst_block = where;
                break;
            }
            if (factor <= kSmallestFactor) {
                result.residual = residual;
                result.worst_block = where;
                return result;
            }
            correct(work.displacement, -0.5 * factor);
            factor *= 0.5;
        }
    }
}

}  // namespace sim_core
