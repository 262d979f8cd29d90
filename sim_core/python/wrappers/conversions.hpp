// SPDX-License-Identifier: Apache-2.0
// How Python's arguments become the library's.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/eigen/dense.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "sim_core/error.hpp"
#include "sim_core/model.hpp"
#include "sim_core/motion.hpp"
#include "sim_core/simulator.hpp"

// Numbers in a row may as well come as an array: nanobind takes one, only the type in the stubs leaves it out.
namespace nanobind::detail {

template <class Caster>
struct RowCaster : Caster {
    static constexpr auto Name = io_name(
        "collections.abc.Sequence[float] | numpy.typing.NDArray[numpy.float64]", "list[float]");
};

template <std::size_t size>
struct type_caster<std::array<double, size>>
    : RowCaster<array_caster<std::array<double, size>, double, size>> {};

template <>
struct type_caster<std::vector<double>>
    : RowCaster<list_caster<std::vector<double>, double>> {};

}  // namespace nanobind::detail

namespace sim_core::python {

namespace nb = nanobind;

/// Any Python sequence of three numbers: tuple, list or array.
using Triple = std::array<double, 3>;

using OptionalTriple = std::optional<Triple>;

inline Vec3 to_vec3(const Triple& t) { return {t[0], t[1], t[2]}; }
inline std::optional<Vec3> to_vec3(const OptionalTriple& t) {
    return t ? std::optional<Vec3>(to_vec3(*t)) : std::nullopt;
}

/// One number for all axes, or one for each.
using PerAxis = std::variant<double, Triple>;
inline Vec3 to_vec3(const PerAxis& p) {
    if (const double* one = std::get_if<double>(&p)) return Vec3::Constant(*one);
    return to_vec3(std::get<Triple>(p));
}

inline Triple to_triple(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

/// A square matrix as Python gives it: its diagonal, or its rows.
template <std::size_t size>
using SquareArgument = std::variant<std::array<double, size>, std::array<std::array<double, size>, size>>;

template <std::size_t size>
Eigen::Matrix<double, static_cast<int>(size), static_cast<int>(size)> to_matrix(const SquareArgument<size>& given) {
    Eigen::Matrix<double, static_cast<int>(size), static_cast<int>(size)> matrix;
    matrix.setZero();
    for (std::size_t i = 0; i < size; ++i) {
        if (const auto* diagonal = std::get_if<std::array<double, size>>(&given)) {
            matrix(i, i) = (*diagonal)[i];
        } else {
            for (std::size_t j = 0; j < size; ++j) {
                matrix(i, j) = std::get<std::array<std::array<double, size>, size>>(given)[i][j];
            }
        }
    }
    return matrix;
}

using Rows3 = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// The constant model as Python holds it; states and simulators share it.
struct SharedModel {
    std::shared_ptr<const Model> model;
};

/// One value for the only prescribed point of a model, or one per prescribed point by name, in the model's order.
template <class Value>
std::vector<Value> per_prescribed_point(const Model& model,
                                        const std::variant<Value, std::map<std::string, Value>>& given,
                                        const char* what) {
    if (const Value* one = std::get_if<Value>(&given)) {
        if (model.prescribed_sites != 1) {
            throw InvalidInput(std::string("the model has ") + std::to_string(model.prescribed_sites) +
                               " prescribed points: give a dict with one " + what + " for each name");
        }
        return {*one};
    }
    const auto& by_name = std::get<std::map<std::string, Value>>(given);
    std::vector<Value> values;
    for (int i = 0; i < model.prescribed_sites; ++i) {
        const auto found = by_name.find(model.prescribed_point(i).name);
        if (found == by_name.end()) {
            throw InvalidInput(std::string("no ") + what + " for the prescribed point '" +
                               model.prescribed_point(i).name + "'");
        }
        values.push_back(found->second);
    }
    for (const auto& [name, value] : by_name) {
        if (!model.points[model.point_index(name)].prescribed) {
            throw InvalidInput("point '" + name + "' is free: it takes no " + what);
        }
    }
    return values;
}

/// A ContactEvent with the names of what touched.
struct Contact {
    std::string place;
    std::string side;
    Vec3 position;
    double time;
    double released;
};

void bind_sea(nb::module_& module);
void bind_tank(nb::module_& module);
void bind_water(nb::module_& module);
void bind_lines(nb::module_& module);
void bind_bodies(nb::module_& module);
void bind_model(nb::module_& module);
void bind_motion(nb::module_& module);
void bind_ship_response(nb::module_& module);
void bind_simulation(nb::module_& module);
void bind_winches(nb::module_& module);
void bind_values(nb::module_& module);

}  // namespace sim_core::python
