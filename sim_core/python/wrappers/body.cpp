// SPDX-License-Identifier: Apache-2.0
#include "conversions.hpp"

namespace sim_core::python {

using namespace nb::literals;

void bind_bodies(nb::module_& module) {
    nb::class_<Fin>(module, "Fin", R"(A lifting surface on a body; its force follows the local flow, the body's rotation included.

position: (3,) m, aerodynamic centre in body axes; normal: (3,) unit normal in body axes ((0, 0, 1) for a
horizontal fin, (0, 1, 0) for a vertical one); area: m² planform; lift_slope: 1/rad; drag: profile
drag coefficient on the planform; stall_angle: rad, beyond which the lift stays level; cross_flow_drag: drag
coefficient broadside (1.17 for a plate normal to the flow, Hoerner 1965).
Lift ½ρS a sin α cos α v² up to stall, drag ½ρS (drag v² along the flow, cross_flow_drag w|w| along the normal).)")
        .def(
            "__init__",
            [](Fin* self, const Triple& position, const Triple& normal, double area, double lift_slope, double drag,
               double stall_angle, double cross_flow_drag) {
                new (self) Fin{to_vec3(position), to_vec3(normal), area, lift_slope, drag, stall_angle,
                               cross_flow_drag};
            },
            nb::kw_only(), "position"_a, "normal"_a, "area"_a, "lift_slope"_a, "drag"_a = 0.01,
            "stall_angle"_a = 0.3, "cross_flow_drag"_a = 1.17)
        .def_ro("position", &Fin::position)
        .def_ro("normal", &Fin::normal)
        .def_ro("area", &Fin::area)
        .def_ro("lift_slope", &Fin::lift_slope)
        .def_ro("drag", &Fin::drag)
        .def_ro("stall_angle", &Fin::stall_angle)
        .def_ro("cross_flow_drag", &Fin::cross_flow_drag);

    nb::class_<Body>(module, "Body", R"(A rigid body with six degrees of freedom, a tow-fish.

Body axes: x forward, y to port, z up; the origin is mid-hull.
mass: kg, enclosed water included; inertia: kg·m² about the origin (enclosed water included), (Ixx, Iyy, Izz) or a
(3, 3) matrix; centre_of_gravity, centre_of_buoyancy: (3,) m; volume: m³, enclosed water included
(mass_properties() adds up parts); diameter, length: m of the hull, a straight cylinder;
added_mass: about the origin, its diagonal (x, y, z in kg, roll, pitch, yaw in kg·m²) or a symmetric (6, 6) matrix
(hull_added_mass() and fin_added_mass() make one);
axial_drag: coefficient on π d²/4; cross_flow_drag: coefficient on the side area, integrated over `strips` strips
with the local cross-flow (which gives pitch and yaw damping);
munk_moment: 0 … 1, the share of the convective part of the added-mass wrench. 1: Kirchhoff's equations, whose
added mass brings the Munk moment with it. 0: added mass resists acceleration only (Morison's form), neither
the Munk moment nor the forces that belong to it.
fins: list of Fin.)")
        .def(
            "__init__",
            [](Body* self, double mass, const SquareArgument<3>& inertia, const Triple& centre_of_gravity,
               double volume, const Triple& centre_of_buoyancy, double diameter, double length,
               const SquareArgument<6>& added_mass, double axial_drag, double cross_flow_drag, double munk_moment,
               const std::vector<Fin>& fins, int strips) {
                new (self) Body{mass,
                                to_matrix<3>(inertia),
                                to_vec3(centre_of_gravity),
                                volume,
                                to_vec3(centre_of_buoyancy),
                                diameter,
                                length,
                                to_matrix<6>(added_mass),
                                axial_drag,
                                cross_flow_drag,
                                munk_moment,
                                strips,
                                fins};
            },
            nb::kw_only(), "mass"_a, "inertia"_a, "centre_of_gravity"_a = Triple{}, "volume"_a,
            "centre_of_buoyancy"_a = Triple{}, "diameter"_a, "length"_a, "added_mass"_a = std::array<double, 6>{},
            "axial_drag"_a, "cross_flow_drag"_a, "munk_moment"_a = 1.0, "fins"_a = std::vector<Fin>{}, "strips"_a = 20)
        .def_ro("mass", &Body::mass)
        .def_ro("inertia", &Body::inertia, "(3, 3) kg·m²")
        .def_ro("centre_of_gravity", &Body::centre_of_gravity)
        .def_ro("volume", &Body::volume)
        .def_ro("centre_of_buoyancy", &Body::centre_of_buoyancy)
        .def_ro("diameter", &Body::diameter)
        .def_ro("length", &Body::length)
        .def_ro("added_mass", &Body::added_mass, "(6, 6) kg, kg·m, kg·m²")
        .def_ro("axial_drag", &Body::axial_drag)
        .def_ro("cross_flow_drag", &Body::cross_flow_drag)
        .def_ro("munk_moment", &Body::munk_moment)
        .def_ro("strips", &Body::strips)
        .def_ro("fins", &Body::fins);
}

}  // namespace sim_core::python
