// SPDX-License-Identifier: Apache-2.0
#include "conversions.hpp"

namespace sim_core::python {

using namespace nb::literals;

namespace {

/// A tuple of three numbers, or None.
nb::object triple_or_none(const std::optional<Vec3>& v) {
    if (!v) return nb::none();
    return nb::make_tuple(v->x(), v->y(), v->z());
}

/// One number where all axes are alike, else a tuple of three.
nb::object per_axis(const Vec3& v) {
    if (v.x() == v.y() && v.y() == v.z()) return nb::float_(v.x());
    return triple_or_none(v);
}

/// The name of a point's class in sim_core.system, and its values.
nb::tuple describe_point(const Model::Point& point) {
    nb::dict values;
    if (point.prescribed) return nb::make_tuple("PrescribedPoint", values);
    values["mass"] = point.properties.mass;
    values["volume"] = point.properties.volume;
    if (const auto* vane = std::get_if<Weathervane>(&point.properties.shape)) {
        values["drag_area"] = triple_or_none(vane->drag_area);
        values["added_mass"] = triple_or_none(vane->added_mass);
        values["turning_speed"] = vane->turning_speed;
        return nb::make_tuple("Weathervane", values);
    }
    const auto& axes = std::get<FixedAxes>(point.properties.shape);
    values["drag_area"] = per_axis(axes.drag_area);
    values["added_mass"] = per_axis(axes.added_mass);
    return nb::make_tuple("FreePoint", values);
}

/// The values of a SectionedLine.
nb::dict describe_line(const Model& model, const Model::Line& line) {
    nb::list sections;
    for (const LineSection& section : line.sections) {
        sections.append(nb::make_tuple(section.properties, section.segments));
    }
    nb::dict values;
    values["start"] = line.ends[0].at;
    values["end"] = line.ends[1].at;
    values["sections"] = nb::tuple(sections);
    values["start_attachment"] = triple_or_none(line.ends[0].attachment);
    values["attachment"] = triple_or_none(line.ends[1].attachment);
    values["start_direction"] = triple_or_none(line.ends[0].direction);
    values["end_direction"] = triple_or_none(line.ends[1].direction);
    values["paid_out"] = nb::none();
    for (const Winch& winch : model.winches) {
        if (&model.lines[winch.line] == &line) values["paid_out"] = winch.initial;
    }
    return values;
}

/// The values of a Joint.
nb::dict describe_joint(const Model::Joint& joint) {
    nb::dict values;
    values["start"] = joint.ends[0].at;
    values["end"] = joint.ends[1].at;
    values["start_attachment"] = triple_or_none(joint.ends[0].attachment);
    values["attachment"] = triple_or_none(joint.ends[1].attachment);
    values["stiffness"] = joint.stiffness;
    values["damping"] = joint.damping;
    return values;
}

}  // namespace

void bind_model(nb::module_& module) {
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
            "prescribed_points",
            [](const SharedModel& m) {
                std::vector<std::string> names;
                for (int i = 0; i < m.model->prescribed_sites; ++i) names.push_back(m.model->prescribed_point(i).name);
                return names;
            },
            "Names of the points that take a motion.")
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
            "joints",
            [](const SharedModel& m) {
                std::vector<std::string> names;
                for (const Model::Joint& joint : m.model->joints) names.push_back(joint.name);
                return names;
            },
            "Names of joints.")
        .def_prop_ro(
            "unknowns", [](const SharedModel& m) { return 3 * m.model->blocks(); }, "Number of scalar unknowns.")
        .def_prop_ro(
            "water", [](const SharedModel& m) { return m.model->water; }, "The water.")
        .def("__copy__", [](const SharedModel& m) { return m; })
        .def("__deepcopy__", [](const SharedModel& m, nb::handle) { return m; }, "memo"_a)
        .def(
            "__reduce__",
            [](const SharedModel& m) {
                const nb::object system = nb::module_::import_("sim_core.system").attr("System");
                return nb::make_tuple(system.attr("build"), nb::make_tuple(system.attr("of")(m)));
            },
            nb::sig("def __reduce__(self) -> tuple[object, ...]"))
        .def(
            "__eq__",
            [](nb::handle self, nb::handle other) -> nb::object {
                if (!nb::isinstance<SharedModel>(other)) return nb::borrow(Py_NotImplemented);
                if (nb::cast<SharedModel>(self).model == nb::cast<SharedModel>(other).model) return nb::bool_(true);
                const nb::object of = nb::module_::import_("sim_core.system").attr("System").attr("of");
                return nb::bool_(of(self).equal(of(other)));
            },
            "other"_a.none(), nb::sig("def __eq__(self, other: object, /) -> bool"))
        .def(
            "__hash__", [](const SharedModel& m) { return static_cast<std::int64_t>(m.model->fingerprint >> 1); },
            nb::sig("def __hash__(self) -> int"))
        // The description, for System.of.
        .def("_describe_point", [](const SharedModel& m, const std::string& name) { return describe_point(m.model->points[m.model->point_index(name)]); })
        .def("_describe_line", [](const SharedModel& m, const std::string& name) { return describe_line(*m.model, m.model->lines[m.model->line_index(name)]); })
        .def("_describe_joint", [](const SharedModel& m, const std::string& name) {
            for (const Model::Joint& joint : m.model->joints) {
                if (joint.name == name) return describe_joint(joint);
            }
            throw InvalidInput("no joint '" + name + "'");
        })
        .def("_body", [](const SharedModel& m, const std::string& name) { return m.model->bodies[m.model->body_index(name)].force.body(); })
        .def_prop_ro("tank", [](const SharedModel& m) { return m.model->tank; }, "The Tank, or None.")
        // Where things stand in a recording, for Result.
        .def("_point_site", [](const SharedModel& m, const std::string& name) { return m.model->points[m.model->point_index(name)].site; })
        .def("_body_entry", [](const SharedModel& m, const std::string& name) { return m.model->sites() + 2 * m.model->body_index(name); })
        .def("_body_index", [](const SharedModel& m, const std::string& name) { return m.model->body_index(name); })
        .def("_body_places", [](const SharedModel& m, const std::string& name) { return m.model->bodies[m.model->body_index(name)].force.body().places; })
        .def("_line_sites", [](const SharedModel& m, const std::string& name) { return m.model->lines[m.model->line_index(name)].sites; })
        .def("_prescribed_index", [](const SharedModel& m, const std::string& name) {
            const Model::Point& point = m.model->points[m.model->point_index(name)];
            return point.prescribed ? point.site - m.model->free_sites : -1;
        }, "point"_a, "Which prescribed point it is, −1 for a free one.")
        .def("_line_index", [](const SharedModel& m, const std::string& name) { return m.model->line_index(name); })
        .def("_line_bent_nodes", [](const SharedModel& m, const std::string& name) -> std::optional<std::array<int, 2>> {
            const int line = m.model->line_index(name);
            int first = 0;
            for (int i = 0; i < line; ++i) {
                if (m.model->lines[i].bends_anywhere()) first += m.model->lines[i].segments + 1;
            }
            if (!m.model->lines[line].bends_anywhere()) return std::nullopt;
            return std::array<int, 2>{first, first + m.model->lines[line].segments + 1};
        }, "line"_a, "Where its nodes are among those of all lines with bending stiffness; None for a limp line.")
        .def("_line_winch", [](const SharedModel& m, const std::string& name) {
            const int line = m.model->line_index(name);
            for (std::size_t i = 0; i < m.model->winches.size(); ++i) {
                if (m.model->winches[i].line == line) return static_cast<int>(i);
            }
            return -1;
        }, "line"_a, "Index of a line's winch, −1 without one.")
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
            [](ModelBuilder& self, const std::string& name, double mass, double volume, const PerAxis& drag_area,
               const PerAxis& added_mass) {
                self.add_free_point(name, {mass, volume, FixedAxes{to_vec3(drag_area), to_vec3(added_mass)}});
            },
            "name"_a, nb::kw_only(), "mass"_a = 0.0, "volume"_a = 0.0, "drag_area"_a = 0.0, "added_mass"_a = 0.0,
            "Add a free point: mass kg, volume m³, drag_area Cd·A m², added_mass kg.\n\n"
            "drag_area and added_mass: one number (a sphere) or (3,) along the tank axes; the drag along axis i is\n"
            "½ρ A_i |u| u_i with the flow u past the point. A sphere as far as immersion counts.")
        .def(
            "add_weathervane",
            [](ModelBuilder& self, const std::string& name, double mass, double volume, const Triple& drag_area,
               const Triple& added_mass, double turning_speed) {
                self.add_free_point(
                    name, {mass, volume, Weathervane{to_vec3(drag_area), to_vec3(added_mass), turning_speed}});
            },
            "name"_a, nb::kw_only(), "mass"_a, "volume"_a, "drag_area"_a, "added_mass"_a = Triple{},
            "turning_speed"_a = 0.05,
            "Add a depressor with a fin: a free point that turns its axis into the horizontal flow.\n\n"
            "mass: kg; volume: m³; drag_area: Cd·A m² and added_mass: kg along the axis, across it and vertical;\n"
            "turning_speed: m/s, below which the flow does not turn it and the mean of along and across counts.\n"
            "There is no sideslip: the fin is taken to be fast.")
        .def("set_tank", &ModelBuilder::set_tank, "tank"_a, "Put the system into a tank.")
        .def("add_body", &ModelBuilder::add_body, "name"_a, "body"_a, "Add a rigid body.")
        .def(
            "add_line",
            [](ModelBuilder& self, const std::string& name, const std::string& start, const std::string& end,
               const LineProperties& properties, int segments, const OptionalTriple& attachment,
               const OptionalTriple& start_attachment, const OptionalTriple& start_direction,
               const OptionalTriple& end_direction, std::optional<double> paid_out) {
                self.add_line(name, {start, to_vec3(start_attachment), to_vec3(start_direction)},
                              {end, to_vec3(attachment), to_vec3(end_direction)}, {{properties, segments}});
                if (paid_out) self.add_winch(name, *paid_out);
            },
            "name"_a, "start"_a, "end"_a, "properties"_a, nb::kw_only(), "segments"_a, "attachment"_a = nb::none(),
            "start_attachment"_a = nb::none(), "start_direction"_a = nb::none(), "end_direction"_a = nb::none(),
            "paid_out"_a = nb::none(),
            R"(Add a uniform line between two named points or bodies.

attachment (at the end) and start_attachment: (3,) m in body axes, needed exactly where that end is a body.
start_direction, end_direction: (3,) any length; the line is clamped there and runs in this direction, from its
start towards its end; in tank axes at a prescribed point, in body axes at a body. Takes bending_stiffness > 0.
Ends without it, and all ends at free points, carry no moment.
paid_out: m, unstretched; puts a winch at the start, a prescribed point, with so much of the line out in a new state.
properties.length is the longest, half a segment the shortest; a Payout moves it.)")
        .def(
            "add_line",
            [](ModelBuilder& self, const std::string& name, const std::string& start, const std::string& end,
               const std::vector<std::pair<LineProperties, int>>& sections, const OptionalTriple& attachment,
               const OptionalTriple& start_attachment, const OptionalTriple& start_direction,
               const OptionalTriple& end_direction, std::optional<double> paid_out) {
                std::vector<LineSection> list;
                for (const auto& [properties, segments] : sections) list.push_back({properties, segments});
                self.add_line(name, {start, to_vec3(start_attachment), to_vec3(start_direction)},
                              {end, to_vec3(attachment), to_vec3(end_direction)}, list);
                if (paid_out) self.add_winch(name, *paid_out);
            },
            "name"_a, "start"_a, "end"_a, nb::kw_only(), "sections"_a, "attachment"_a = nb::none(),
            "start_attachment"_a = nb::none(), "start_direction"_a = nb::none(), "end_direction"_a = nb::none(),
            "paid_out"_a = nb::none(),
            R"(Add a line of several uniform sections, from its start to its end.

sections: pairs of LineProperties and the number of segments of that section. The rest as for a uniform line. Where a
limp section meets a stiff one the line carries no moment. A winch winds the first section, down to half a segment of
it.)")
        .def(
            "add_joint",
            [](ModelBuilder& self, const std::string& name, const std::string& start, const std::string& end,
               double stiffness, double damping, const OptionalTriple& attachment,
               const OptionalTriple& start_attachment) {
                self.add_joint(name, {start, to_vec3(start_attachment), std::nullopt},
                               {end, to_vec3(attachment), std::nullopt}, stiffness, damping);
            },
            "name"_a, "start"_a, "end"_a, nb::kw_only(), "stiffness"_a, "damping"_a = 0.0,
            "attachment"_a = nb::none(), "start_attachment"_a = nb::none(),
            R"(Hold two places together by a ball joint, about which both may turn.

start, end: names of points or bodies, with attachment (at the end) and start_attachment as for a line.
stiffness: N/m, damping: N·s/m of the spring that holds them: they part by force over stiffness. Three joints that do
not lie on one line weld two bodies together.)")
        .def(
            "build", [](const ModelBuilder& self) { return SharedModel{std::make_shared<const Model>(self.build())}; },
            "The constant model. Everything must be connected to a prescribed point.");
}

}  // namespace sim_core::python
