// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "curve.hpp"
#include "types.hpp"

namespace sim_core {

/// A constant, or a table of it over Reynolds number (see Curve::level_beyond; interpolated over the logarithm).
using DragCoefficient = std::variant<double, Table>;

/// A uniform line between two named points, or a uniform section of one.
struct LineProperties {
    double length = 0.0;            ///< unstretched, m
    double diameter = 0.0;          ///< hydrodynamic, m
    double mass_per_length = 0.0;   ///< kg/m, in air
    /// EA, N, or a table of tension (N) over strain from (0, 0) on, increasing (see Curve::straight_beyond).
    std::variant<double, Table> axial_stiffness = 0.0;
    double axial_damping = 0.0;     ///< N·s: tension per strain rate
    double bending_stiffness = 0.0; ///< EI, N·m²; with it a segment also carries compression, up to π²EI/ℓ²
    DragCoefficient normal_drag = 1.2;       ///< Cn on the diameter; over |u_n| d/ν
    DragCoefficient tangential_drag = 0.01;  ///< Ct on the skin π d; over |u_t| d/ν
    double lift = 0.0;              ///< Cl on the diameter, of a faired section: side force along t × u_n
    double added_mass = 1.0;        ///< Ca across the line, of π d²/4
    double tangential_added_mass = 0.0;  ///< Ca along the line, of π d²/4
    std::optional<double> displaced_area;  ///< m² for buoyancy; default π d²/4
    std::optional<double> slack_tension;   ///< N; default 1 % of the whole line's weight in air
};

/// A uniform stretch of a line and the number of segments it is divided into.
struct LineSection {
    LineProperties properties;
    int segments = 0;
};

/// Where and how one end of a line is held.
struct LineEnd {
    std::string at;                 ///< name of a point or a body
    std::optional<Vec3> attachment; ///< m in body axes, needed exactly where the end is at a body
    /// The end is clamped: the line leaves it in this direction of growing length (from the line's start to
    /// its end), in tank axes at a prescribed point, in body axes at a body. Without it the end is free of moment.
    std::optional<Vec3> direction;
};

}  // namespace sim_core
