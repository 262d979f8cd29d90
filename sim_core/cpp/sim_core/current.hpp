// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "types.hpp"

namespace sim_core {

/// Velocities over a coordinate: the piecewise cubic of Fritsch & Carlson (1980, SIAM J. Numer. Anal. 17, 238–246) with
/// the slopes of Fritsch & Butland (1984). Continuous slope, and each component never leaves what its two
/// neighbours in the table span. Constant beyond the ends.
class VelocityTable {
  public:
    /// (coordinate, velocity in m/s) in any order. Throws InvalidInput naming `name` unless there are at least two, finite,
    /// with different coordinates.
    VelocityTable(const std::string& name, std::vector<std::pair<double, Vec3>> rows);

    /// The velocity and its derivative with respect to the coordinate.
    void at(double coordinate, Vec3& velocity, Vec3& slope) const;

    /// Its second derivative, which jumps at the rows.
    Vec3 curvature(double coordinate) const;

    const std::vector<std::pair<double, Vec3>>& rows() const { return rows_; }

  private:
    /// A piece of the table: Hermite's cubic start + s rise + s (1 − s) [(1 − s) bend0 + s bend1], s from 0 to 1.
    struct Piece {
        double width;
        double s;
        Vec3 start, rise, bend0, bend1;
    };
    bool is_beyond(double coordinate) const;
    Piece piece(double coordinate) const;

    std::vector<std::pair<double, Vec3>> rows_;
    std::vector<Vec3> slopes_;
};

/// A current: a uniform and steady one, a profile over the height and a series over time, added up.
struct Current {
    Vec3 uniform = Vec3::Zero();           ///< m/s, tank axes
    std::optional<VelocityTable> profile;  ///< over z, m
    std::optional<VelocityTable> series;   ///< over time, s

    bool is_uniform_and_steady() const { return !profile && !series; }

    /// Its velocity (m/s) at a height (m) and a time (s).
    Vec3 at(double z, double time) const;
};

}  // namespace sim_core
