// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "state.hpp"

namespace sim_core {

/// The shape of a steady tow: everything moves with the constant `velocity` (m/s, tank axes; zero for a
/// system hanging at rest), the prescribed points at `positions` (m, in the order of Model::prescribed_point).
///
/// Solved by pseudo-transient continuation (Kelley & Keyes 1998, SIAM J. Numer. Anal. 35, 508–523): implicit
/// steps of a motion that starts each step from rest, with steps that grow from 0.05 s until the inertia term is
/// negligible. It is first done with soft lines, which are then stiffened to what they are: it needs no good first guess
/// and passes through slack and near-zero tension. Where nothing draws the system to rest (a fish that swings), the
/// equilibrium next to the first guess is taken. A direction without any stiffness (the heading of a body hanging at
/// rest) stays where the guess put it: forward.
///
/// Water that changes in time is taken without its waves and with its current as it is at time 0.
///
/// Throws ConvergenceError naming the place with the largest residual.
State steady_tow(std::shared_ptr<const Model> model, const std::vector<Vec3>& positions, const Vec3& velocity);

}  // namespace sim_core
