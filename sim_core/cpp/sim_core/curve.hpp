// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace sim_core {

/// Pairs (abscissa, value) of a measured characteristic.
using Table = std::vector<std::pair<double, double>>;

/// A smooth curve through the points of a table: piecewise cubic, with a continuous slope, which the Newton iteration needs, and
/// without extremes between the points (Fritsch & Carlson 1980, SIAM J. Numer. Anal. 17, 238–246; slopes by
/// Fritsch & Butland 1984, SIAM J. Sci. Stat. Comput. 5, 300–304).
class Curve {
  public:
    struct Value {
        double value;
        double slope;
    };

    /// Beyond its ends the curve goes on straight. Two points make a straight line.
    static Curve straight_beyond(const Table& table, const std::string& where);
    /// Beyond its ends the curve is level, and has no slope there.
    static Curve level_beyond(const Table& table, const std::string& where);

    Value at(double x) const;

    const std::vector<double>& abscissas() const { return x_; }
    double largest_slope() const;

  private:
    /// Throws InvalidInput naming `where` unless there are two points at least, all finite, with increasing abscissas.
    Curve(const Table& table, const std::string& where);
    double secant(std::size_t i) const { return (y_[i + 1] - y_[i]) / (x_[i + 1] - x_[i]); }

    std::vector<double> x_, y_, slope_;
};

}  // namespace sim_core
