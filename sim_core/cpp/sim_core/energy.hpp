// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "state.hpp"

namespace sim_core {

/// Mechanical energy of everything that moves freely, J.
struct Energy {
    double kinetic;  ///< of the mass and of the added mass
    double gravity;  ///< weight minus buoyancy times height; exact for what is all dry or all immersed
    double elastic;  ///< of the tension
    double bending;
};

Energy energy(const State& state);

}  // namespace sim_core
