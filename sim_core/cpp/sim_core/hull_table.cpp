// SPDX-License-Identifier: Apache-2.0
#include "hull_table.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "error.hpp"

namespace sim_core {

namespace {

void require(bool holds, const char* what) {
    if (!holds) throw InvalidInput(std::string("hull table: ") + what);
}

void require_angles(const std::vector<double>& angles, double limit, const char* what) {
    require(angles.size() >= 3, what);
    for (std::size_t i = 0; i < angles.size(); ++i) {
        require(std::abs(angles[i]) < limit && (i == 0 || angles[i] > angles[i - 1]), what);
    }
}

/// Slope at x[i] of the parabola through the three nodes nearest to it; `f` gives the value at a node.
template <class Values>
HullTableForce::Coefficients parabola_slope(const std::vector<double>& x, std::size_t i, Values f) {
    const std::size_t a = std::clamp<std::size_t>(i, 1, x.size() - 2) - 1;
    const double x0 = x[a], x1 = x[a + 1], x2 = x[a + 2], at = x[i];
    return f(a) * ((2.0 * at - x1 - x2) / ((x0 - x1) * (x0 - x2))) +
           f(a + 1) * ((2.0 * at - x0 - x2) / ((x1 - x0) * (x1 - x2))) +
           f(a + 2) * ((2.0 * at - x0 - x1) / ((x2 - x0) * (x2 - x1)));
}

/// How the two ends of a cell count, by value and by slope, and the derivatives of that.
struct Weights {
    std::size_t cell;
    double value[2], slope[2];
    double value_rate[2], slope_rate[2];
};

/// Cubic Hermite inside the table; linear in the first and the last cell, which are beyond it.
Weights weights(const std::vector<double>& x, double at) {
    const auto above = std::upper_bound(x.begin() + 1, x.end() - 1, at);
    Weights w{};
    w.cell = static_cast<std::size_t>(above - x.begin()) - 1;
    const double h = x[w.cell + 1] - x[w.cell];
    const double t = (at - x[w.cell]) / h;
    if (w.cell == 0 || w.cell + 2 == x.size()) {
        w.value[0] = 1.0 - t;
        w.value[1] = t;
        w.value_rate[0] = -1.0 / h;
        w.value_rate[1] = 1.0 / h;
        return w;
    }
    w.value[1] = t * t * (3.0 - 2.0 * t);
    w.value[0] = 1.0 - w.value[1];
    w.slope[0] = h * t * (1.0 - t) * (1.0 - t);
    w.slope[1] = -h * t * t * (1.0 - t);
    w.value_rate[1] = 6.0 * t * (1.0 - t) / h;
    w.value_rate[0] = -w.value_rate[1];
    w.slope_rate[0] = (1.0 - t) * (1.0 - 3.0 * t);
    w.slope_rate[1] = t * (3.0 * t - 2.0);
    return w;
}

}  // namespace

HullTableForce::HullTableForce(const HullTable& table, double density)
    : pressure_area_(0.5 * density * table.area), length_(table.length) {
    constexpr double kHalfTurn = std::numbers::pi;
    require_angles(table.attack, kHalfTurn, "attack must ascend within -pi and pi, with 3 angles at least");
    require_angles(table.sideslip, 0.5 * kHalfTurn, "sideslip must ascend within -pi/2 and pi/2, with 3 angles at least");
    require(table.area > 0.0 && table.length > 0.0 && std::isfinite(table.area) && std::isfinite(table.length),
            "area and length must be above 0 and finite");
    const std::size_t rows = table.attack.size();
    const std::size_t columns = table.sideslip.size();
    require(table.coefficients.size() == rows * columns, "there must be 6 coefficients for each attack and sideslip");
    for (const auto& six : table.coefficients) {
        for (const double c : six) require(std::isfinite(c), "coefficients must be finite");
    }
    const auto given = [&](std::size_t i, std::size_t j) {
        return Eigen::Map<const Coefficients>(table.coefficients[i * columns + j].data());
    };

    attack_ = table.attack;
    attack_.insert(attack_.begin(), -kHalfTurn);
    attack_.push_back(kHalfTurn);
    sideslip_ = table.sideslip;
    sideslip_.insert(sideslip_.begin(), -0.5 * kHalfTurn);
    sideslip_.push_back(0.5 * kHalfTurn);
    const Coefficients zero = Coefficients::Zero();
    nodes_.assign(attack_.size() * sideslip_.size(), {zero, zero, zero, zero});
    const auto at = [this](std::size_t i, std::size_t j) -> Node& { return nodes_[i * sideslip_.size() + j]; };

    for (std::size_t i = 0; i < rows; ++i) {
        for (std::size_t j = 0; j < columns; ++j) {
            const auto attack_slope = [&](std::size_t column) {
                return parabola_slope(table.attack, i, [&](std::size_t row) { return Coefficients(given(row, column)); });
            };
            Node& n = at(i + 1, j + 1);
            n.value = given(i, j);
            n.attack_slope = attack_slope(j);
            n.sideslip_slope =
                parabola_slope(table.sideslip, j, [&](std::size_t column) { return Coefficients(given(i, column)); });
            n.twist = parabola_slope(table.sideslip, j, attack_slope);
        }
    }
    // Round the back: −π and π are the same flow, between the two ends of the range by distance.
    const double to_last = kHalfTurn - table.attack.back();
    const double to_first = table.attack.front() + kHalfTurn;
    const double last_share = to_first / (to_first + to_last);
    for (std::size_t j = 1; j <= columns; ++j) {
        const Node& first = at(1, j);
        const Node& last = at(rows, j);
        Node& back = at(0, j);
        back.value = last_share * last.value + (1.0 - last_share) * first.value;
        back.sideslip_slope = last_share * last.sideslip_slope + (1.0 - last_share) * first.sideslip_slope;
        at(rows + 1, j) = back;
    }
    // Flow along y: only drag, the same at every α.
    for (const std::size_t j : {std::size_t{0}, columns + 1}) {
        const std::size_t edge = j == 0 ? 1 : columns;
        double drag = 0.0;
        for (std::size_t i = 1; i <= rows; ++i) drag += at(i, edge).value[0];
        for (std::size_t i = 0; i < attack_.size(); ++i) at(i, j).value[0] = drag / static_cast<double>(rows);
    }
}

void HullTableForce::interpolate(double attack, double sideslip, Coefficients& c, Coefficients& c_attack,
                                 Coefficients& c_sideslip) const {
    const Weights a = weights(attack_, attack);
    const Weights b = weights(sideslip_, sideslip);
    c.setZero();
    c_attack.setZero();
    c_sideslip.setZero();
    for (std::size_t i = 0; i < 2; ++i) {
        for (std::size_t j = 0; j < 2; ++j) {
            const Node& n = node(a.cell + i, b.cell + j);
            const Coefficients across = b.value[j] * n.value + b.slope[j] * n.sideslip_slope;
            const Coefficients across_slope = b.value[j] * n.attack_slope + b.slope[j] * n.twist;
            c += a.value[i] * across + a.slope[i] * across_slope;
            c_attack += a.value_rate[i] * across + a.slope_rate[i] * across_slope;
            c_sideslip += a.value[i] * (b.value_rate[j] * n.value + b.slope_rate[j] * n.sideslip_slope) +
                          a.slope[i] * (b.value_rate[j] * n.attack_slope + b.slope_rate[j] * n.twist);
        }
    }
}

void HullTableForce::evaluate(const Vec3& v, Vec3& force, Vec3& moment, Mat3& force_v, Mat3& moment_v) const {
    const double square = v.squaredNorm();
    if (square < 1e-18) {
        force.setZero();
        moment.setZero();
        force_v.setZero();
        moment_v.setZero();
        return;
    }
    const double speed = std::sqrt(square);
    const double level = std::sqrt(v.x() * v.x() + v.z() * v.z());
    const bool sideways = level < 1e-9 * speed;  // α has no meaning, and nothing depends on it
    const double attack = sideways ? 0.0 : std::atan2(-v.z(), v.x());
    const double sideslip = std::atan2(v.y(), level);
    Vec3 attack_v = Vec3::Zero();
    Vec3 sideslip_v = Vec3::Zero();
    Vec3 ahead = Vec3::UnitX();  // of the plane of α
    if (!sideways) {
        attack_v = Vec3(v.z(), 0.0, -v.x()) / (level * level);
        ahead = Vec3(v.x(), 0.0, v.z()) / level;
        sideslip_v = (level * Vec3::UnitY() - v.y() * ahead) / square;
    }
    const Vec3 along = v / speed;
    const Vec3 lift(-ahead.z(), 0.0, ahead.x());
    const Vec3 side = lift.cross(along);

    Coefficients c, c_attack, c_sideslip;
    interpolate(attack, sideslip, c, c_attack, c_sideslip);
    const double q = pressure_area_ * square;
    const Vec3 direction = -c[0] * along + c[1] * side + c[2] * lift;
    force = q * direction;
    moment = (q * length_) * c.tail<3>().matrix();

    // d along/dα = cos β · d ahead/dα, d ahead/dα = −lift, d lift/dα = ahead, d side/dα = sin β lift;
    // d along/dβ = side, d side/dβ = −along
    const double sine = v.y() / speed;
    const double cosine = level / speed;
    const Vec3 force_attack = -c_attack[0] * along + c_attack[1] * side + c_attack[2] * lift +
                              c[0] * cosine * lift + c[1] * sine * lift + c[2] * ahead;
    const Vec3 force_sideslip =
        -c_sideslip[0] * along + c_sideslip[1] * side + c_sideslip[2] * lift - c[0] * side - c[1] * along;
    const Vec3 q_v = (2.0 * pressure_area_) * v;
    force_v = direction * q_v.transpose() + q * (force_attack * attack_v.transpose() + force_sideslip * sideslip_v.transpose());
    moment_v = length_ * (c.tail<3>().matrix() * q_v.transpose() +
                          q * (c_attack.tail<3>().matrix() * attack_v.transpose() +
                               c_sideslip.tail<3>().matrix() * sideslip_v.transpose()));
}

}  // namespace sim_core
