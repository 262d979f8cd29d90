// SPDX-License-Identifier: Apache-2.0
#include "conversions.hpp"

namespace sim_core::python {

using namespace nb::literals;

void bind_model(nb::module_& module) {
    nb::class_<Water>(module, "Water", R"(The water below z = 0.

density: kg/m³; gravity: m/s²; current: (3,) m/s in tank axes, uniform and steady.)")
        .def(
            "__init__",
            [](Water* self, double density, double gravity, const Triple& current) {
                new (self) Water{density, gravity, to_vec3(current)};
            },
            nb::kw_only(), "density"_a = 1000.0, "gravity"_a = 9.81, "current"_a = Triple{})
        .def_ro("density", &Water::density)
        .def_ro("gravity", &Water::gravity)
        .def_ro("current", &Water::current);

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

Body axes: x forward, y to port, z up; the origin is mid-hull and the centre of buoyancy.
mass: kg, enclosed water included; inertia: (Ixx, Iyy, Izz) kg·m² about the origin (enclosed water included);
centre_of_gravity: (3,) m; volume: m³ envelope; diameter, length: m of the hull, a straight cylinder;
added_mass: (x, y, z in kg, roll, pitch, yaw in kg·m²), diagonal;
axial_drag: coefficient on π d²/4; cross_flow_drag: coefficient on the side area, integrated over `strips` strips
with the local cross-flow (which gives pitch and yaw damping);
munk_moment: 0 … 1, the share of the convective part of the added-mass wrench. 1: Kirchhoff's equations, whose
added mass brings the Munk moment with it. 0: added mass resists acceleration only (Morison's form), neither
the Munk moment nor the forces that belong to it.
fins: list of Fin.)")
        .def(
            "__init__",
            [](Body* self, double mass, const Triple& inertia, const Triple& centre_of_gravity, double volume,
               double diameter, double length, const std::array<double, 6>& added_mass, double axial_drag,
               double cross_flow_drag, double munk_moment, const std::vector<Fin>& fins, int strips) {
                new (self) Body{mass,       to_vec3(inertia), to_vec3(centre_of_gravity), volume,      diameter, length,
                                added_mass, axial_drag,       cross_flow_drag,            munk_moment, strips,   fins};
            },
            nb::kw_only(), "mass"_a, "inertia"_a, "centre_of_gravity"_a = Triple{}, "volume"_a, "diameter"_a,
            "length"_a, "added_mass"_a = std::array<double, 6>{}, "axial_drag"_a, "cross_flow_drag"_a,
            "munk_moment"_a = 1.0, "fins"_a = std::vector<Fin>{}, "strips"_a = 20)
        .def_ro("mass", &Body::mass)
        .def_ro("inertia", &Body::inertia)
        .def_ro("centre_of_gravity", &Body::centre_of_gravity)
        .def_ro("volume", &Body::volume)
        .def_ro("diameter", &Body::diameter)
        .def_ro("length", &Body::length)
        .def_ro("added_mass", &Body::added_mass)
        .def_ro("axial_drag", &Body::axial_drag)
        .def_ro("cross_flow_drag", &Body::cross_flow_drag)
        .def_ro("munk_moment", &Body::munk_moment)
        .def_ro("strips", &Body::strips)
        .def_ro("fins", &Body::fins);

    nb::class_<LineProperties>(module, "LineProperties", R"(A uniform line.

length: m, unstretched; diameter: m, for drag and added mass; mass_per_length: kg/m in air;
axial_stiffness: EA, N; axial_damping: N·s, tension per strain rate; normal_drag Cn on the diameter;
tangential_drag Ct on the skin π d; added_mass Ca of π d²/4, across the line;
displaced_area: m², for buoyancy (default π d²/4); slack_tension: N, below which the tension is rounded off to
its lower bound of zero (default 1 % of the line's weight in air).)")
        .def(
            "__init__",
            [](LineProperties* self, double length, double diameter, double mass_per_length, double axial_stiffness,
               double axial_damping, double normal_drag, double tangential_drag, double added_mass,
               std::optional<double> displaced_area, std::optional<double> slack_tension) {
                new (self) LineProperties{length,          diameter,   mass_per_length, axial_stiffness, axial_damping, normal_drag,
                                          tangential_drag, added_mass, displaced_area,  slack_tension};
            },
            nb::kw_only(), "length"_a, "diameter"_a, "mass_per_length"_a, "axial_stiffness"_a,
            "axial_damping"_a = 0.0, "normal_drag"_a = 1.2, "tangential_drag"_a = 0.01, "added_mass"_a = 1.0,
            "displaced_area"_a = nb::none(), "slack_tension"_a = nb::none())
        .def_ro("length", &LineProperties::length)
        .def_ro("diameter", &LineProperties::diameter)
        .def_ro("mass_per_length", &LineProperties::mass_per_length)
        .def_ro("axial_stiffness", &LineProperties::axial_stiffness)
        .def_ro("axial_damping", &LineProperties::axial_damping)
        .def_ro("normal_drag", &LineProperties::normal_drag)
        .def_ro("tangential_drag", &LineProperties::tangential_drag)
        .def_ro("added_mass", &LineProperties::added_mass)
        .def_ro("displaced_area", &LineProperties::displaced_area)
        .def_ro("slack_tension", &LineProperties::slack_tension);

    nb::class_<SharedModel>(module, "Model", "The constant description of a system, made by ModelBuilder.build().")
        .def_prop_ro(
            "points",
            [](const SharedModel& m) {
                std::vector<std::string> names;
                for (const Model::Point& point : m.model->points) names.push_back(point.name);
                return names;
            },
            "Names of free and prescribed points.")
        .def_prop_ro(
            "bodies",
            [](const SharedModel& m) {
                std::vector<std::string> names;
                for (const Model::BodyEntry& body : m.model->bodies) names.push_back(body.name);
                return names;
            },
            "Names of bodies.")
        .def_prop_ro(
            "lines",
            [](const SharedModel& m) {
                std::vector<std::string> names;
                for (const Model::Line& line : m.model->lines) names.push_back(line.name);
                return names;
            },
            "Names of lines.")
        .def_prop_ro(
            "unknowns", [](const SharedModel& m) { return 3 * m.model->blocks(); }, "Number of scalar unknowns.")
        // Where things stand in a recording, for Result.
        .def("_point_site", [](const SharedModel& m, const std::string& name) { return m.model->points[m.model->point_index(name)].site; })
        .def("_body_entry", [](const SharedModel& m, const std::string& name) { return m.model->sites() + 2 * m.model->body_index(name); })
        .def("_body_index", [](const SharedModel& m, const std::string& name) { return m.model->body_index(name); })
        .def("_line_sites", [](const SharedModel& m, const std::string& name) { return m.model->lines[m.model->line_index(name)].sites; })
        .def("_line_segments", [](const SharedModel& m, const std::string& name) {
            const Model::Line& line = m.model->lines[m.model->line_index(name)];
            return std::array<int, 2>{line.first_segment, line.first_segment + line.segments};
        });

    nb::class_<ModelBuilder>(module, "ModelBuilder", R"(Collects the parts of a system and builds the constant Model.

Raises InvalidInput (a ValueError) naming the part for impossible values and unknown or repeated names.)")
        .def(nb::init<const Water&>(), "water"_a = Water{})
        .def("add_prescribed_point", &ModelBuilder::add_prescribed_point, "name"_a,
             "Add a point that moves as prescribed: a tow point or an anchor.")
        .def(
            "add_free_point",
            [](ModelBuilder& self, const std::string& name, double mass, double volume, double drag_area,
               double added_mass) { self.add_free_point(name, {mass, volume, drag_area, added_mass}); },
            "name"_a, nb::kw_only(), "mass"_a = 0.0, "volume"_a = 0.0, "drag_area"_a = 0.0, "added_mass"_a = 0.0,
            "Add a free point: mass kg, volume m³, drag_area Cd·A m², added_mass kg. A sphere as far as immersion counts.")
        .def("add_body", &ModelBuilder::add_body, "name"_a, "body"_a, "Add a rigid body.")
        .def(
            "add_line",
            [](ModelBuilder& self, const std::string& name, const std::string& start, const std::string& end,
               const LineProperties& properties, int segments, std::optional<Triple> attachment,
               std::optional<Triple> start_attachment) {
                self.add_line(name, start, end, properties, segments, to_vec3(attachment), to_vec3(start_attachment));
            },
            "name"_a, "start"_a, "end"_a, "properties"_a, nb::kw_only(), "segments"_a, "attachment"_a = nb::none(),
            "start_attachment"_a = nb::none(),
            "Add a line between two named points or bodies. attachment (at the end) and start_attachment: (3,) m in\n"
            "body axes, needed exactly where that end is a body.")
        .def(
            "build", [](const ModelBuilder& self) { return SharedModel{std::make_shared<const Model>(self.build())}; },
            "The constant model. Everything must be connected to a prescribed point.");
}

}  // namespace sim_core::python
