// SPDX-License-Identifier: Apache-2.0
#include "conversions.hpp"

namespace sim_core::python {

using namespace nb::literals;

namespace {

using Rows = std::vector<std::pair<double, Triple>>;

std::optional<VelocityTable> to_table(const std::string& name, const std::optional<Rows>& rows) {
    if (!rows) return std::nullopt;
    std::vector<std::pair<double, Vec3>> converted;
    for (const auto& [coordinate, velocity] : *rows) converted.emplace_back(coordinate, to_vec3(velocity));
    return VelocityTable(name, std::move(converted));
}

std::optional<Rows> to_rows(const std::optional<VelocityTable>& table) {
    if (!table) return std::nullopt;
    Rows rows;
    for (const auto& [coordinate, velocity] : table->rows()) rows.emplace_back(coordinate, to_triple(velocity));
    return rows;
}

}  // namespace

void bind_water(nb::module_& module) {
    nb::class_<Current>(module, "Current", R"(A current that varies over depth or in time: the sum of its parts.

uniform: (3,) m/s in tank axes; profile: pairs (z, velocity) in m and (3,) m/s; series: pairs (time, velocity) in s and
(3,) m/s. Between the rows a cubic with continuous slope that never overshoots (Fritsch & Carlson 1980), beyond the
first and last row constant. Raises InvalidInput.)")
        .def(
            "__init__",
            [](Current* self, const Triple& uniform, const std::optional<Rows>& profile,
               const std::optional<Rows>& series) {
                new (self) Current{to_vec3(uniform), to_table("current profile", profile),
                                   to_table("current series", series)};
            },
            nb::kw_only(), "uniform"_a = Triple{}, "profile"_a = nb::none(), "series"_a = nb::none())
        .def_ro("uniform", &Current::uniform)
        .def_prop_ro("profile", [](const Current& c) { return to_rows(c.profile); })
        .def_prop_ro("series", [](const Current& c) { return to_rows(c.series); });

    nb::class_<WaterMotion>(module, "WaterMotion", "What the water does at one place and time, tank axes.")
        .def_ro("velocity", &WaterMotion::velocity, "(3,) m/s")
        .def_ro("acceleration", &WaterMotion::acceleration, "(3,) m/s², the local one: ∂u/∂t")
        .def_ro("velocity_gradient", &WaterMotion::velocity_gradient, "(3, 3) 1/s: row i, column j is ∂u_i/∂x_j")
        .def_ro("acceleration_gradient", &WaterMotion::acceleration_gradient, "(3, 3) 1/s², likewise")
        .def_prop_ro(
            "velocity_curvature",
            [](const WaterMotion& m) {
                std::array<std::array<std::array<double, 3>, 3>, 3> all;
                for (int i = 0; i < 3; ++i) {
                    for (int j = 0; j < 3; ++j) {
                        for (int k = 0; k < 3; ++k) all[i][j][k] = m.velocity_curvature[k](i, j);
                    }
                }
                return all;
            },
            "(3, 3, 3) 1/(m s), as lists: ∂²u_i/∂x_j∂x_k")
        .def_ro("elevation", &WaterMotion::elevation, "m, of the surface there above still water")
        .def_prop_ro(
            "elevation_slope",
            [](const WaterMotion& m) { return std::array<double, 2>{m.elevation_x, m.elevation_y}; }, "(2,) ∂ζ/∂x, ∂ζ/∂y");

    nb::class_<Water>(module, "Water", R"(The water below its surface.

density: kg/m³; gravity: m/s²; current: (3,) m/s in tank axes if uniform and steady, else a Current; waves: a Sea;
kinematic_viscosity: m²/s, for drag by Reynolds number.
Waves are linear, stretched to the surface after Wheeler (1970), and added to the current without interaction.)")
        .def(
            "__init__",
            [](Water* self, double density, double gravity, const std::variant<Triple, Current>& current,
               const std::optional<Sea>& waves, double kinematic_viscosity) {
                const Triple* uniform = std::get_if<Triple>(&current);
                new (self) Water{density, gravity,
                                 uniform ? Current{to_vec3(*uniform), {}, {}} : std::get<Current>(current), waves, kinematic_viscosity};
            },
            nb::kw_only(), "density"_a = 1000.0, "gravity"_a = 9.81, "current"_a = Triple{}, "waves"_a = nb::none(),
            "kinematic_viscosity"_a = 1.0e-6)
        .def_ro("density", &Water::density)
        .def_ro("gravity", &Water::gravity)
        .def_prop_ro("current",
                     [](const Water& w) -> std::variant<Vec3, Current> {
                         if (w.current.is_uniform_and_steady()) return w.current.uniform;
                         return w.current;
                     })
        .def_ro("waves", &Water::waves)
        .def_ro("kinematic_viscosity", &Water::kinematic_viscosity)
        .def(
            "motion",
            [](const Water& w, const Triple& position, double time) {
                WaterProbe probe(w);
                probe.set_time(time);
                WaterMotion motion;
                probe.at(to_vec3(position), motion, true);
                return motion;
            },
            "position"_a, "time"_a, "What it does at a place (m, tank axes) and a time (s).");
}

}  // namespace sim_core::python
