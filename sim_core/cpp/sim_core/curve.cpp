// SPDX-License-Identifier: Apache-2.0
#include "curve.hpp"

#include <algorithm>
#include <cmath>

#include "error.hpp"

namespace sim_core {

Curve::Curve(const Table& table, const std::string& where) {
    if (table.size() < 2) throw InvalidInput(where + ": a table needs at least two points");
    for (const auto& [x, y] : table) {
        if (!std::isfinite(x) || !std::isfinite(y)) throw InvalidInput(where + ": a table must be finite");
        if (!x_.empty() && !(x > x_.back())) throw InvalidInput(where + ": the first numbers of a table must increase");
        x_.push_back(x);
        y_.push_back(y);
    }
    slope_.assign(x_.size(), 0.0);
    for (std::size_t i = 1; i + 1 < x_.size(); ++i) {
        const double before = secant(i - 1);
        const double after = secant(i);
        if (before * after <= 0.0) continue;  // an extreme stays one
        const double h0 = x_[i] - x_[i - 1];
        const double h1 = x_[i + 1] - x_[i];
        slope_[i] = 3.0 * (h0 + h1) / ((2.0 * h1 + h0) / before + (h1 + 2.0 * h0) / after);
    }
}

Curve Curve::straight_beyond(const Table& table, const std::string& where) {
    Curve curve(table, where);
    curve.slope_.front() = curve.secant(0);
    curve.slope_.back() = curve.secant(table.size() - 2);
    return curve;
}

Curve Curve::level_beyond(const Table& table, const std::string& where) { return Curve(table, where); }

Curve::Value Curve::at(double x) const {
    if (x <= x_.front()) return {y_.front() + slope_.front() * (x - x_.front()), slope_.front()};
    if (x >= x_.back()) return {y_.back() + slope_.back() * (x - x_.back()), slope_.back()};
    const std::size_t i = std::upper_bound(x_.begin(), x_.end(), x) - x_.begin() - 1;
    const double h = x_[i + 1] - x_[i];
    const double s = (x - x_[i]) / h;
    const double chord = secant(i);
    // y = y₀ + h (d₀ s + c₂ s² + c₃ s³)
    const double c2 = 3.0 * chord - 2.0 * slope_[i] - slope_[i + 1];
    const double c3 = slope_[i] + slope_[i + 1] - 2.0 * chord;
    return {y_[i] + h * s * (slope_[i] + s * (c2 + s * c3)), slope_[i] + s * (2.0 * c2 + s * 3.0 * c3)};
}

double Curve::largest_slope() const {
    double largest = 0.0;
    for (std::size_t i = 0; i < x_.size(); ++i) {
        largest = std::max(largest, slope_[i]);
        if (i + 1 < x_.size()) largest = std::max(largest, 1.5 * secant(i));  // the most between two points
    }
    return largest;
}

}  // namespace sim_core
