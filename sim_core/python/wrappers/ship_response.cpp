// SPDX-License-Identifier: Apache-2.0
#include "sim_core/ship_response.hpp"

#include <nanobind/stl/complex.h>

#include <algorithm>
#include <complex>
#include <iterator>

#include "conversions.hpp"
#include "kept.hpp"

namespace sim_core::python {

using namespace nb::literals;

namespace {

using Rows = std::vector<std::vector<double>>;

using ByMotion = std::array<std::vector<double>, 6>;
using KeptOperators = Kept<ResponseOperators, std::vector<double>, std::vector<double>, ByMotion, ByMotion>;
using KeptShip = Kept<ShipInSea, Vec3, Vec3, Sea, KeptOperators, Vec3, double>;

constexpr const char* kShipMotions[6] = {"surge", "sway", "heave", "roll", "pitch", "yaw"};

/// Row by row for each of the six motions; those not given are zero.
ByMotion by_motion(const std::map<std::string, Rows>& given, std::size_t headings,
                                             std::size_t frequencies) {
    for (const auto& [name, rows] : given) {
        if (std::find(std::begin(kShipMotions), std::end(kShipMotions), name) == std::end(kShipMotions)) {
            throw InvalidInput("response operators: there is no motion '" + name +
                               "', but surge, sway, heave, roll, pitch, yaw");
        }
        if (rows.size() != headings) {
            throw InvalidInput("response operators: '" + name + "' needs a row for each of the " +
                               std::to_string(headings) + " headings");
        }
        for (const auto& row : rows) {
            if (row.size() != frequencies) {
                throw InvalidInput("response operators: each row of '" + name + "' needs " +
                                   std::to_string(frequencies) + " values, one for each frequency");
            }
        }
    }
    ByMotion values;
    for (int i = 0; i < 6; ++i) {
        const auto found = given.find(kShipMotions[i]);
        if (found == given.end()) {
            values[i].assign(headings * frequencies, 0.0);
            continue;
        }
        for (const auto& row : found->second) values[i].insert(values[i].end(), row.begin(), row.end());
    }
    return values;
}

std::map<std::string, Rows> by_name(const ByMotion& values, std::size_t frequencies) {
    std::map<std::string, Rows> named;
    for (int i = 0; i < 6; ++i) {
        Rows& rows = named[kShipMotions[i]];
        for (auto row = values[i].begin(); row != values[i].end(); row += frequencies) {
            rows.emplace_back(row, row + frequencies);
        }
    }
    return named;
}

}  // namespace

void bind_ship_response(nb::module_& module) {
    nb::class_<KeptOperators>(module, "ResponseOperators", R"(Response amplitude operators (RAO) of a ship at its speed.

frequency: (n,) rad/s, of the waves in the tank's frame; heading: (m,) rad, direction in which a wave travels seen from
the ship: 0 from astern, π/2 towards port, π from ahead (a single one holds for all). amplitude and phase: dicts of (m, n)
for 'surge', 'sway', 'heave' (m/m), 'roll', 'pitch', 'yaw' (rad/m), zero where not given; phase in rad, by how much
the motion leads the elevation at the reference point. Ship axes x forward, y to port, z up; rotations by the right-hand
rule, so that pitch is positive with the bow down. Interpolated linearly as complex numbers; where the table has one side
only, waves from the other side are mirrored. Raises InvalidInput.)")
        .def(
            "__init__",
            [](KeptOperators* self, const std::vector<double>& frequency, const std::vector<double>& heading,
               const std::map<std::string, Rows>& amplitude, const std::map<std::string, Rows>& phase) {
                new (self) KeptOperators(frequency, heading,
                                             by_motion(amplitude, heading.size(), frequency.size()),
                                             by_motion(phase, heading.size(), frequency.size()));
            },
            nb::kw_only(), "frequency"_a, "heading"_a, "amplitude"_a, "phase"_a = std::map<std::string, Rows>{})
        .def_prop_ro("frequency", &value<KeptOperators, 0>)
        .def_prop_ro("heading", &value<KeptOperators, 1>)
        .def_prop_ro("amplitude", [](const KeptOperators& o) { return by_name(std::get<2>(o.values), std::get<0>(o.values).size()); })
        .def_prop_ro("phase", [](const KeptOperators& o) { return by_name(std::get<3>(o.values), std::get<0>(o.values).size()); })
        .def(
            "at",
            [](const KeptOperators& self, double frequency, double heading) {
                const auto values = self.at(frequency, heading);
                std::map<std::string, std::complex<double>> named;
                for (int i = 0; i < 6; ++i) named[kShipMotions[i]] = values[i];
                return named;
            },
            "frequency"_a, "heading"_a,
            "amplitude · exp(i phase) of each motion for a wave; InvalidInput outside of the table.");

    nb::class_<KeptShip, Motion>(module, "ShipInSea", R"(A tow point on a ship that runs straight through a sea.

position: (3,) m, of the tow point at time 0 without waves; velocity: (3,) m/s, level (the ship points along it, at rest
along x); sea: the Sea, whose ramp_time the motion rises with; operators: ResponseOperators, for this speed; arm: (3,) m in ship axes
from their reference point to the tow point; run_up_time: s, as in SteadyTow.
The displacement is (surge, sway, heave) + (roll, pitch, yaw) × arm, summed over the wave trains; each is met where the
ship is, so at its frequency of encounter. Raises InvalidInput if a train lies outside of the table.)")
        .def(
            "__init__",
            [](KeptShip* self, const Triple& position, const Triple& velocity, const Sea& sea,
               const KeptOperators& operators, const Triple& arm, double run_up_time) {
                new (self) KeptShip(to_vec3(position), to_vec3(velocity), sea, operators, to_vec3(arm), run_up_time);
            },
            nb::kw_only(), "position"_a, "velocity"_a = Triple{}, "sea"_a, "operators"_a, "arm"_a = Triple{},
            "run_up_time"_a = 0.0)
        .def_prop_ro("position", &value<KeptShip, 0>)
        .def_prop_ro("velocity", &value<KeptShip, 1>)
        .def_prop_ro("sea", &value<KeptShip, 2>)
        .def_prop_ro("operators", &value<KeptShip, 3>)
        .def_prop_ro("arm", &value<KeptShip, 4>)
        .def_prop_ro("run_up_time", &value<KeptShip, 5>);
}

}  // namespace sim_core::python
