// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

namespace sim_core {

/// A uniform line between two named points.
struct LineProperties {
    double length = 0.0;            ///< unstretched, m
    double diameter = 0.0;          ///< hydrodynamic, m
    double mass_per_length = 0.0;   ///< kg/m, in air
    double axial_stiffness = 0.0;   ///< EA, N
    double axial_damping = 0.0;     ///< N·s: tension per strain rate
    double normal_drag = 1.2;       ///< Cn on the diameter
    double tangential_drag = 0.01;  ///< Ct on the skin π d
    double added_mass = 1.0;        ///< Ca across the line, of π d²/4
    std::optional<double> displaced_area;  ///< m² for buoyancy; default π d²/4
    std::optional<double> slack_tension;   ///< N; default 1 % of the line's weight in air
};

}  // namespace sim_core
