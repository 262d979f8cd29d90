// SPDX-License-Identifier: Apache-2.0
#include "conversions.hpp"

namespace sim_core::python {

using namespace nb::literals;

void bind_lines(nb::module_& module) {
    nb::class_<LineProperties>(module, "LineProperties", R"(A uniform line, or a uniform section of one.

length: m, unstretched; diameter: m, for drag and added mass; mass_per_length: kg/m in air;
axial_stiffness: EA, N, or pairs (strain, tension N) from (0, 0) on, increasing: a smooth monotone curve through them,
straight beyond; axial_damping: N·s, tension per strain rate; bending_stiffness: EI, N·m² (0: limp; else a segment
also carries compression, up to its Euler load π²EI/ℓ²);
normal_drag Cn on the diameter, tangential_drag Ct on the skin π d: each a number, or pairs (Reynolds number,
coefficient), over |u_n| d/ν and |u_t| d/ν, smooth over the logarithm and level beyond;
lift: Cl on the diameter, of a fairing that swivels into the flow across the line but stands at a small
angle to it: a side force along t × u_n, t the tangent from start to end;
added_mass Ca of π d²/4, across the line, tangential_added_mass along it; displaced_area: m², for buoyancy (default π d²/4);
slack_tension: N, within which the tension is rounded off to its lower bound (default 1 % of the whole line's weight
in air).)")
        .def(
            "__init__",
            [](LineProperties* self, double length, double diameter, double mass_per_length,
               const std::variant<double, Table>& axial_stiffness,
               double axial_damping, double bending_stiffness, const DragCoefficient& normal_drag,
               const DragCoefficient& tangential_drag, double lift, double added_mass, double tangential_added_mass,
               std::optional<double> displaced_area, std::optional<double> slack_tension) {
                new (self) LineProperties{.length = length,
                                          .diameter = diameter,
                                          .mass_per_length = mass_per_length,
                                          .axial_stiffness = axial_stiffness,
                                          .axial_damping = axial_damping,
                                          .bending_stiffness = bending_stiffness,
                                          .normal_drag = normal_drag,
                                          .tangential_drag = tangential_drag,
                                          .lift = lift,
                                          .added_mass = added_mass,
                                          .tangential_added_mass = tangential_added_mass,
                                          .displaced_area = displaced_area,
                                          .slack_tension = slack_tension};
            },
            nb::kw_only(), "length"_a, "diameter"_a, "mass_per_length"_a, "axial_stiffness"_a,
            "axial_damping"_a = 0.0, "bending_stiffness"_a = 0.0, "normal_drag"_a = 1.2, "tangential_drag"_a = 0.01, "lift"_a = 0.0,
            "added_mass"_a = 1.0, "tangential_added_mass"_a = 0.0, "displaced_area"_a = nb::none(), "slack_tension"_a = nb::none())
        .def_ro("length", &LineProperties::length)
        .def_ro("diameter", &LineProperties::diameter)
        .def_ro("mass_per_length", &LineProperties::mass_per_length)
        .def_ro("axial_stiffness", &LineProperties::axial_stiffness)
        .def_ro("axial_damping", &LineProperties::axial_damping)
        .def_ro("bending_stiffness", &LineProperties::bending_stiffness)
        .def_ro("normal_drag", &LineProperties::normal_drag)
        .def_ro("tangential_drag", &LineProperties::tangential_drag)
        .def_ro("lift", &LineProperties::lift)
        .def_ro("added_mass", &LineProperties::added_mass)
        .def_ro("tangential_added_mass", &LineProperties::tangential_added_mass)
        .def_ro("displaced_area", &LineProperties::displaced_area)
        .def_ro("slack_tension", &LineProperties::slack_tension);
}

}  // namespace sim_core::python
