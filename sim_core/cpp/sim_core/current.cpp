// SPDX-License-Identifier: Apache-2.0
#include "current.hpp"

#include <algorithm>
#include <cmath>

#include "error.hpp"

namespace sim_core {

namespace {

/// Slope at a row between two pieces with the secants s0 and s1 over the widths h0 and h1: their weighted harmonic mean, or
/// zero where they point apart.
double inner_slope(double h0, double s0, double h1, double s1) {
    if (s0 * s1 <= 0.0) return 0.0;
    const double w0 = 2.0 * h1 + h0;
    const double w1 = h1 + 2.0 * h0;
    return (w0 + w1) / (w0 / s0 + w1 / s1);
}

/// Slope at an end, from the piece there (h0, s0) and the next one: that of the parabola through three rows, kept from
/// overshooting.
double end_slope(double h0, double s0, double h1, double s1) {
    const double slope = ((2.0 * h0 + h1) * s0 - h0 * s1) / (h0 + h1);
    if (slope * s0 <= 0.0) return 0.0;
    if (s0 * s1 <= 0.0 && std::abs(slope) > 3.0 * std::abs(s0)) return 3.0 * s0;
    return slope;
}

}  // namespace

VelocityTable::VelocityTable(const std::string& name, std::vector<std::pair<double, Vec3>> rows)
    : rows_(std::move(rows)), slopes_(rows_.size()) {
    const auto require = [&name](bool holds, const char* what) {
        if (!holds) throw InvalidInput(name + ": " + what);
    };
    require(rows_.size() >= 2, "there must be at least two rows");
    for (const auto& [coordinate, velocity] : rows_) {
        require(std::isfinite(coordinate) && velocity.allFinite(), "all values must be finite");
    }
    std::sort(rows_.begin(), rows_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    const std::size_t pieces = rows_.size() - 1;
    const auto width = [&](std::size_t i) { return rows_[i + 1].first - rows_[i].first; };
    for (std::size_t i = 0; i < pieces; ++i) require(width(i) > 0.0, "no two rows may be for the same place or time");
    for (int axis = 0; axis < 3; ++axis) {
        const auto secant = [&](std::size_t i) {
            return (rows_[i + 1].second[axis] - rows_[i].second[axis]) / width(i);
        };
        if (pieces == 1) {
            slopes_[0][axis] = slopes_[1][axis] = secant(0);
            continue;
        }
        slopes_[0][axis] = end_slope(width(0), secant(0), width(1), secant(1));
        for (std::size_t i = 1; i < pieces; ++i) {
            slopes_[i][axis] = inner_slope(width(i - 1), secant(i - 1), width(i), secant(i));
        }
        slopes_[pieces][axis] =
            end_slope(width(pieces - 1), secant(pieces - 1), width(pieces - 2), secant(pieces - 2));
    }
}

bool VelocityTable::is_beyond(double coordinate) const {
    return coordinate < rows_.front().first || coordinate > rows_.back().first;
}

VelocityTable::Piece VelocityTable::piece(double coordinate) const {
    const auto above = std::upper_bound(rows_.begin() + 1, rows_.end() - 1, coordinate,
                                        [](double value, const auto& row) { return value < row.first; });
    const std::size_t i = static_cast<std::size_t>(above - rows_.begin()) - 1;
    const double h = rows_[i + 1].first - rows_[i].first;
    const Vec3 rise = rows_[i + 1].second - rows_[i].second;
    return {h, (coordinate - rows_[i].first) / h, rows_[i].second, rise, h * slopes_[i] - rise, rise - h * slopes_[i + 1]};
}

void VelocityTable::at(double coordinate, Vec3& velocity, Vec3& slope) const {
    if (is_beyond(coordinate)) {
        velocity = (coordinate < rows_.front().first ? rows_.front() : rows_.back()).second;
        slope.setZero();
        return;
    }
    const Piece p = piece(coordinate);
    const double s = p.s;
    velocity = p.start + s * p.rise + (s * (1.0 - s)) * ((1.0 - s) * p.bend0 + s * p.bend1);
    slope = (p.rise + ((1.0 - s) * (1.0 - 3.0 * s)) * p.bend0 + (s * (2.0 - 3.0 * s)) * p.bend1) / p.width;
}

Vec3 VelocityTable::curvature(double coordinate) const {
    if (is_beyond(coordinate)) return Vec3::Zero();
    const Piece p = piece(coordinate);
    return ((6.0 * p.s - 4.0) * p.bend0 + (2.0 - 6.0 * p.s) * p.bend1) / (p.width * p.width);
}

Vec3 Current::at(double z, double time) const {
    Vec3 sum = uniform;
    Vec3 part, slope;
    if (profile) {
        profile->at(z, part, slope);
        sum += part;
    }
    if (series) {
        series->at(time, part, slope);
        sum += part;
    }
    return sum;
}

}  // namespace sim_core
