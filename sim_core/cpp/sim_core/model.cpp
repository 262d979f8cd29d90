// SPDX-License-Identifier: Apache-2.0
#include "model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "error.hpp"
#include "fingerprint.hpp"

namespace sim_core {

namespace {

template <class Entries>
int index_of(const Entries& entries, const std::string& name, const char* kind) {
    std::string known;
    for (std::size_t i = 0; i < entries.size(); ++i) {
        if (entries[i].name == name) return static_cast<int>(i);
        known += (known.empty() ? "'" : ", '") + entries[i].name + "'";
    }
    throw InvalidInput(std::string("no ") + kind + " '" + name + "'; there " +
                       (known.empty() ? "is none" : "are " + known));
}

template <class Entries>
bool contains(const Entries& entries, const std::string& name) {
    return std::any_of(entries.begin(), entries.end(), [&](const auto& entry) { return entry.name == name; });
}

void require(bool holds, const std::string& where, const char* what) {
    if (!holds) throw InvalidInput(where + ": " + what);
}

/// A constant coefficient; or 1, and the curve over the logarithm of the Reynolds number.
double constant_part(const DragCoefficient& coefficient, std::shared_ptr<const Curve>& curve, const char* name) {
    if (const double* constant = std::get_if<double>(&coefficient)) return *constant;
    Table table = std::get<Table>(coefficient);
    for (auto& [reynolds, value] : table) reynolds = std::log(reynolds);
    curve = std::make_shared<Curve>(Curve::level_beyond(table, name));
    return 1.0;
}

/// `line_weight` is that of the whole line in air, N.
SegmentConstants segment_constants(const LineSection& section, double line_weight, const Water& water) {
    const LineProperties& p = section.properties;
    SegmentConstants c{};
    const double circle = 0.25 * std::numbers::pi * p.diameter * p.diameter;
    c.length = p.length / section.segments;
    const double half = 0.5 * c.length;
    if (const Table* table = std::get_if<Table>(&p.axial_stiffness)) {
        c.tension_curve = std::make_shared<Curve>(Curve::straight_beyond(*table, "axial_stiffness"));
        c.axial_stiffness = c.tension_curve->largest_slope();
    } else {
        c.axial_stiffness = std::get<double>(p.axial_stiffness);
    }
    c.axial_damping = p.axial_damping;
    c.slack_tension = p.slack_tension.value_or(0.01 * line_weight);
    c.buckling_force = std::numbers::pi * std::numbers::pi * p.bending_stiffness / (c.length * c.length);
    c.half_mass = p.mass_per_length * half;
    c.half_weight = c.half_mass * water.gravity;
    c.half_displaced_mass = water.density * p.displaced_area.value_or(circle) * half;
    c.half_buoyancy = water.gravity * c.half_displaced_mass;
    const double half_dynamic = 0.5 * water.density * p.diameter * half;
    c.half_normal_drag = half_dynamic * constant_part(p.normal_drag, c.normal_drag_curve, "normal_drag");
    c.half_tangential_drag = std::numbers::pi * half_dynamic *
                             constant_part(p.tangential_drag, c.tangential_drag_curve, "tangential_drag");
    c.half_lift = half_dynamic * p.lift;
    c.reynolds_per_speed = p.diameter / water.kinematic_viscosity;
    c.half_added_mass = p.added_mass * water.density * circle * half;
    c.half_tangential_added_mass = p.tangential_added_mass * water.density * circle * half;
    c.radius = 0.5 * p.diameter;
    return c;
}

void require_possible(const LineSection& section, const std::string& where) {
    const LineProperties& p = section.properties;
    require(section.segments >= 1, where, "segments must be at least 1");
    require(p.length > 0.0 && std::isfinite(p.length), where, "length must be above 0");
    require(p.diameter > 0.0 && std::isfinite(p.diameter), where, "diameter must be above 0");
    require(p.mass_per_length > 0.0 && std::isfinite(p.mass_per_length), where, "mass_per_length must be above 0");
    if (const double* constant = std::get_if<double>(&p.axial_stiffness)) {
        require(*constant > 0.0 && std::isfinite(*constant), where, "axial_stiffness must be above 0");
    } else {
        const Table& table = std::get<Table>(p.axial_stiffness);
        (void)Curve::straight_beyond(table, where + ": axial_stiffness");
        require(table.front() == std::pair(0.0, 0.0), where, "the table axial_stiffness must begin with (0, 0)");
        for (std::size_t i = 1; i < table.size(); ++i) {
            require(table[i].second > table[i - 1].second, where, "tensions of the table axial_stiffness must increase");
        }
    }
    for (const auto& [coefficient, name] : {std::pair(&p.normal_drag, "normal_drag"),
                                            std::pair(&p.tangential_drag, "tangential_drag")}) {
        if (const double* constant = std::get_if<double>(coefficient)) {
            require(*constant >= 0.0 && std::isfinite(*constant), where, (std::string(name) + " must not be below 0").c_str());
            continue;
        }
        const Table& table = std::get<Table>(*coefficient);
        (void)Curve::level_beyond(table, where + ": " + name);
        for (const auto& [reynolds, value] : table) {
            require(reynolds > 0.0 && value >= 0.0, where,
                    "Reynolds numbers must be above 0, coefficients not below");
        }
    }
    require(std::isfinite(p.lift), where, "lift must be finite");
    for (const auto& [value, name] : {std::pair(p.axial_damping, "axial_damping"),
                                      std::pair(p.bending_stiffness, "bending_stiffness"),
                                      std::pair(p.added_mass, "added_mass"),
                                      std::pair(p.tangential_added_mass, "tangential_added_mass"),
                                      std::pair(p.displaced_area.value_or(0.0), "displaced_area")}) {
        require(value >= 0.0 && std::isfinite(value), where, (std::string(name) + " must not be below 0").c_str());
    }
    if (p.slack_tension) {
        require(*p.slack_tension > 0.0 && std::isfinite(*p.slack_tension), where, "slack_tension must be above 0 and finite");
    }
}

/// Free nodes and points, and along each hull nose, middle and tail.
void add_contact_places(Model& model, const Tank& tank) {
    model.tank = tank;
    model.tank_sides = tank_sides(tank);
    std::vector<ContactSize> sizes(static_cast<std::size_t>(model.free_sites), {0.0, 0.0});
    for (const Model::Point& point : model.points) {
        if (point.prescribed) continue;
        const double radius = std::cbrt(0.75 / std::numbers::pi * point.properties.volume);
        sizes[point.site] = {radius, std::numbers::pi * radius * radius};
    }
    for (const Model::Segment& segment : model.segments) {
        for (const int site : segment.site) {
            if (!model.is_free(site)) continue;
            const SegmentConstants& c = model.segment_constants[segment.constants];
            sizes[site].radius = std::max(sizes[site].radius, c.radius);
            sizes[site].area += c.radius * c.length;  // d ℓ/2
        }
    }
    for (int site = 0; site < model.free_sites; ++site) {
        model.contact_places.push_back({model.describe_block(site), site, sizes[site]});
    }
    for (std::size_t b = 0; b < model.bodies.size(); ++b) {
        const Body& body = model.bodies[b].force.body();
        const double hull_radius = 0.5 * body.diameter;
        const double reach = std::max(0.0, 0.5 * body.length - hull_radius);
        for (const auto& [part, x] : {std::pair("nose", reach), std::pair("middle", 0.0), std::pair("tail", -reach)}) {
            model.contact_places.push_back(
                {"body '" + model.bodies[b].name + "' " + part, model.sites(),
                 {hull_radius, body.diameter * body.length / 3.0}});
            model.attachments.push_back({static_cast<int>(b), Vec3(x, 0.0, 0.0)});
        }
    }
}

Winch make_winch(const std::vector<LineSection>& sections, int line, int first_segment, double paid_out) {
    const LineSection& wound = sections.front();
    Winch winch{line, first_segment, wound.segments, wound.properties.length / wound.segments, 0.0, paid_out};
    for (std::size_t i = 1; i < sections.size(); ++i) winch.beyond += sections[i].properties.length;
    return winch;
}

/// The torsion springs of a line: at inner nodes the two half segments in series, EI/ℓ where both are alike; at a
/// clamped end the half segment there, 2EI/ℓ. Ends that are not clamped carry no moment.
void add_bending(Model& model, Model::Line& line, const LineEnd ends[2]) {
    // per half segment 2EI/ℓ
    std::vector<double> half_stiffness;
    std::vector<double> length;
    for (const LineSection& section : line.sections) {
        const double segment = section.properties.length / section.segments;
        half_stiffness.insert(half_stiffness.end(), section.segments,
                              2.0 * section.properties.bending_stiffness / segment);
        length.insert(length.end(), section.segments, segment);
    }
    const auto stiffen = [&](double spring, double shortest) {
        model.stiffest_segment = std::max(model.stiffest_segment, 4.0 * spring / (shortest * shortest));
    };
    line.bends.assign(line.sites.size(), -1);
    for (int i = 1; i < line.segments; ++i) {
        const double before = half_stiffness[i - 1];
        const double after = half_stiffness[i];
        if (before == 0.0 || after == 0.0) continue;  // a limp section holds no moment
        Model::Bend spring{before * after / (before + after),
                           0.5 * (length[i - 1] + length[i]),
                           {line.sites[i - 1], line.sites[i], line.sites[i + 1]},
                           {}};
        stiffen(spring.stiffness, std::min(length[i - 1], length[i]));
        line.bends[static_cast<std::size_t>(i)] = static_cast<int>(model.bends.size());
        model.bends.push_back(spring);
    }
    if (ends[0].direction) {
        line.clamps[0] = static_cast<int>(model.clamps.size());
        model.clamps.push_back({half_stiffness.front(),
                                0.5 * length.front(),
                                ends[0].direction->normalized(),
                                {line.sites[0], line.sites[1]},
                                {}});
        stiffen(half_stiffness.front(), length.front());
    }
    if (ends[1].direction) {
        const int last = line.segments;
        line.clamps[1] = static_cast<int>(model.clamps.size());
        model.clamps.push_back({half_stiffness.back(),
                                0.5 * length.back(),
                                -ends[1].direction->normalized(),
                                {line.sites[last], line.sites[last - 1]},
                                {}});
        stiffen(half_stiffness.back(), length.back());
    }
}

}  // namespace

int Model::point_index(const std::string& name) const { return index_of(points, name, "point"); }
int Model::body_index(const std::string& name) const { return index_of(bodies, name, "body"); }
int Model::line_index(const std::string& name) const { return index_of(lines, name, "line"); }

int Model::winch_index(const std::string& line_name) const {
    const int line = line_index(line_name);
    for (std::size_t i = 0; i < winches.size(); ++i) {
        if (winches[i].line == line) return static_cast<int>(i);
    }
    throw InvalidInput("line '" + line_name + "' has no winch; give it one with add_winch");
}

const Model::Point& Model::prescribed_point(int i) const {
    return *std::find_if(points.begin(), points.end(), [&](const Point& p) { return p.site == free_sites + i; });
}

std::string Model::describe_block(int block) const {
    if (block >= free_sites) {
        const int body = (block - free_sites) / 2;
        return std::string(block == rotation_block(body) ? "rotation of " : "") + "body '" + bodies[body].name + "'";
    }
    for (const Point& point : points) {
        if (point.site == block) return "point '" + point.name + "'";
    }
    for (const Line& line : lines) {
        const auto found = std::find(line.sites.begin(), line.sites.end(), block);
        if (found != line.sites.end()) {
            return "line '" + line.name + "' node " + std::to_string(found - line.sites.begin());
        }
    }
    return "unknown place";
}

ModelBuilder::ModelBuilder(const Water& water) : water_(water) {
    require(water.density >= 0.0 && std::isfinite(water.density), "water", "density must not be below 0");
    require(water.gravity >= 0.0 && std::isfinite(water.gravity), "water", "gravity must not be below 0");
    require(water.kinematic_viscosity > 0.0 && std::isfinite(water.kinematic_viscosity), "water",
            "kinematic_viscosity must be above 0");
    require(water.current.uniform.allFinite(), "water", "current must be finite");
    if (water.waves) {
        const double g = water.waves->gravity();
        require(std::abs(g - water.gravity) <= 1e-9 * g, "water", "the waves must have its gravity");
    }
}

bool ModelBuilder::has_point(const std::string& name) const { return contains(points_, name); }
bool ModelBuilder::has_body(const std::string& name) const { return contains(bodies_, name); }

void ModelBuilder::require_new_name(const std::string& name) const {
    require(!has_point(name) && !has_body(name), "'" + name + "'", "a point or body of this name exists already");
}

void ModelBuilder::add_prescribed_point(const std::string& name) {
    require_new_name(name);
    points_.push_back({name, true, {}});
}

void ModelBuilder::add_free_point(const std::string& name, const FreePoint& point) {
    require_new_name(name);
    const std::string where = "point '" + name + "'";
    const auto require_not_negative = [&](const auto& values) {
        for (const double value : values) {
            require(value >= 0.0 && std::isfinite(value), where,
                    "mass, volume, drag_area and added_mass must not be below 0");
        }
    };
    require_not_negative(std::array{point.mass, point.volume});
    std::visit(
        [&](const auto& shape) {
            require_not_negative(shape.drag_area);
            require_not_negative(shape.added_mass);
        },
        point.shape);
    if (const auto* vane = std::get_if<Weathervane>(&point.shape)) {
        require(vane->turning_speed > 0.0 && std::isfinite(vane->turning_speed), where,
                "turning_speed must be above 0");
    }
    points_.push_back({name, false, point});
}

void ModelBuilder::add_body(const std::string& name, const Body& body) {
    require_new_name(name);
    (void)BodyForce(name, body, water_);  // validates
    bodies_.push_back({name, body});
}

void ModelBuilder::add_line(const std::string& name, const LineEnd& start, const LineEnd& end,
                            const std::vector<LineSection>& sections) {
    const std::string where = "line '" + name + "'";
    require(!contains(lines_, name), where, "a line of this name exists already");
    require(start.at != end.at, where, "it starts and ends at the same place");
    require(!sections.empty(), where, "there must be at least one section");
    for (std::size_t i = 0; i < sections.size(); ++i) {
        require_possible(sections[i],
                         sections.size() == 1 ? where : where + " section " + std::to_string(i + 1));
    }
    LineEntry line{name, {start, end}, sections, {}};
    for (int i = 0; i < 2; ++i) {
        LineEnd& held = line.ends[i];
        require_end(held, i == 0, where);
        if (!held.direction) continue;
        const std::string direction = i == 0 ? "start_direction" : "end_direction";
        const LineSection& section = i == 0 ? sections.front() : sections.back();
        require(held.direction->allFinite() && held.direction->norm() > 1e-9, where,
                (direction + " must be finite and not zero").c_str());
        require(section.properties.bending_stiffness > 0.0, where,
                (direction + " clamps the end, which takes a bending_stiffness above 0").c_str());
        const auto free = std::find_if(points_.begin(), points_.end(), [&](const PointEntry& point) {
            return point.name == held.at && !point.prescribed;
        });
        require(free == points_.end(), where, (direction + " is only for an end at a prescribed point or a body").c_str());
    }
    lines_.push_back(line);
}

void ModelBuilder::require_end(const LineEnd& end, bool first, const std::string& where) const {
    require(has_point(end.at) || has_body(end.at), where,
            ("its end '" + end.at + "' is neither a point nor a body").c_str());
    const std::string attachment = first ? "start_attachment" : "attachment";
    if (has_body(end.at)) {
        require(end.attachment.has_value(), where, (attachment + " is needed at a body").c_str());
    } else {
        require(!end.attachment.has_value(), where, (attachment + " is only for an end at a body").c_str());
    }
}

void ModelBuilder::add_joint(const std::string& name, const LineEnd& start, const LineEnd& end, double stiffness,
                             double damping) {
    const std::string where = "joint '" + name + "'";
    require(!contains(joints_, name), where, "a joint of this name exists already");
    require(start.at != end.at, where, "it joins a part to itself");
    require_end(start, true, where);
    require_end(end, false, where);
    require(stiffness > 0.0 && std::isfinite(stiffness), where, "stiffness must be above 0 N/m");
    require(damping >= 0.0 && std::isfinite(damping), where, "damping must not be below 0 N s/m");
    joints_.push_back({name, {start, end}, stiffness, damping});
}

void ModelBuilder::set_tank(const Tank& tank) {
    (void)tank_sides(tank);  // validates
    tank_ = tank;
}

void ModelBuilder::add_winch(const std::string& name, double paid_out) {
    (void)index_of(lines_, name, "line");
    LineEntry& line = *std::find_if(lines_.begin(), lines_.end(), [&](const LineEntry& l) { return l.name == name; });
    const std::string where = "winch of line '" + name + "'";
    require(!line.paid_out, where, "there is one already");
    require(std::any_of(points_.begin(), points_.end(),
                        [&](const PointEntry& point) { return point.name == line.ends[0].at && point.prescribed; }),
            where, "the line must start at a prescribed point");
    require(line.sections.front().properties.bending_stiffness == 0.0, where,
            "the line's first section, which is wound up, must be limp");
    const Winch winch = make_winch(line.sections, 0, 0, paid_out);
    require(paid_out >= winch.shortest() && paid_out <= winch.longest(), where,
            ("paid_out must lie between " + std::to_string(winch.shortest()) + " m and " +
             std::to_string(winch.longest()) + " m").c_str());
    line.paid_out = paid_out;
}

Model ModelBuilder::build() const {
    Model model;
    model.water = water_;
    const double gravity = water_.gravity > 0.0 ? water_.gravity : 1.0;  // for measures of force

    // Sites: free points and inner nodes, prescribed points, attachments
    for (const PointEntry& point : points_) {
        if (!point.prescribed) model.points.push_back({point.name, model.free_sites++, false, point.properties});
    }
    for (const LineEntry& line : lines_) {
        for (const LineSection& section : line.sections) model.free_sites += section.segments;
        --model.free_sites;
    }
    for (const PointEntry& point : points_) {
        if (point.prescribed) {
            model.points.push_back({point.name, model.free_sites + model.prescribed_sites++, true, point.properties});
        }
    }
    for (const NamedBody& body : bodies_) {
        model.bodies.push_back({body.name, BodyForce(body.name, body.body, water_)});
    }
    require(model.prescribed_sites > 0, "model", "there must be at least one prescribed point");

    const auto end_site = [&](const LineEnd& end) {
        if (has_point(end.at)) return model.points[model.point_index(end.at)].site;
        model.attachments.push_back({model.body_index(end.at), *end.attachment});
        return model.sites() - 1;
    };
    int next_inner = 0;
    for (const PointEntry& point : points_) next_inner += point.prescribed ? 0 : 1;
    for (const LineEntry& entry : lines_) {
        Model::Line line{entry.name, entry.sections, static_cast<int>(model.segments.size()), 0, {},
                         {entry.ends[0], entry.ends[1]}};
        double weight = 0.0;
        for (const LineSection& section : entry.sections) {
            line.segments += section.segments;
            weight += section.properties.mass_per_length * section.properties.length * gravity;
        }
        line.sites.push_back(end_site(entry.ends[0]));
        for (int i = 1; i < line.segments; ++i) line.sites.push_back(next_inner++);
        line.sites.push_back(end_site(entry.ends[1]));
        for (const LineSection& section : entry.sections) {
            for (int i = 0; i < section.segments; ++i) {
                const std::size_t first = model.segments.size() - line.first_segment;
                Model::Segment segment{};
                segment.constants = static_cast<int>(model.segment_constants.size());
                segment.site[0] = line.sites[first];
                segment.site[1] = line.sites[first + 1];
                model.segments.push_back(segment);
            }
            model.segment_constants.push_back(segment_constants(section, weight, water_));
        }
        add_bending(model, line, entry.ends);
        if (entry.paid_out) {
            model.winches.push_back(make_winch(entry.sections, static_cast<int>(model.lines.size()),
                                               line.first_segment, *entry.paid_out));
        }
        model.lines.push_back(std::move(line));
    }

    for (const JointEntry& entry : joints_) {
        Model::Joint joint{entry.name, {entry.ends[0], entry.ends[1]}, entry.stiffness, entry.damping, {}, {}};
        for (int i = 0; i < 2; ++i) joint.site[i] = end_site(entry.ends[i]);
        model.stiffest_segment = std::max(model.stiffest_segment, joint.stiffness);
        model.joints.push_back(joint);
    }

    if (tank_) add_contact_places(model, *tank_);

    // The Jacobian's blocks
    const auto blocks_of = [&]<std::size_t Sites>(const int (&sites)[Sites]) {
        std::array<int, 2 * Sites> blocks;
        blocks.fill(-1);
        for (std::size_t i = 0; i < Sites; ++i) {
            if (model.is_free(sites[i])) blocks[2 * i] = sites[i];
            if (model.is_attached(sites[i])) {
                const int body = model.attachments[model.attachment_of(sites[i])].body;
                blocks[2 * i] = model.translation_block(body);
                blocks[2 * i + 1] = model.rotation_block(body);
            }
        }
        return blocks;
    };
    std::vector<std::pair<int, int>> couplings;
    for (std::size_t b = 0; b < model.bodies.size(); ++b) {
        couplings.emplace_back(model.translation_block(static_cast<int>(b)), model.rotation_block(static_cast<int>(b)));
    }
    const auto visit_elements = [&](auto&& visit) {
        for (Model::Segment& segment : model.segments) visit(segment);
        for (Model::Bend& spring : model.bends) visit(spring);
        for (Model::Clamp& spring : model.clamps) visit(spring);
        for (Model::Joint& joint : model.joints) visit(joint);
    };
    visit_elements([&](const auto& element) {
        const auto blocks = blocks_of(element.site);
        for (const int i : blocks) {
            for (const int j : blocks) {
                if (i >= 0 && j >= 0 && i != j) couplings.emplace_back(i, j);
            }
        }
    });
    model.structure = BlockStructure(model.blocks(), couplings);
    visit_elements([&](auto& element) {
        const auto blocks = blocks_of(element.site);
        for (std::size_t i = 0; i < blocks.size(); ++i) {
            for (std::size_t j = 0; j < blocks.size(); ++j) {
                element.slot[i][j] = blocks[i] < 0 || blocks[j] < 0 ? -1 : model.structure.slot(blocks[i], blocks[j]);
            }
        }
    });

    // Everything must hang on a prescribed point through lines and joints
    std::vector<bool> held(model.sites() + model.bodies.size(), false);
    const auto vertex = [&](int site) {
        return model.is_attached(site) ? model.sites() + model.attachments[model.attachment_of(site)].body : site;
    };
    for (int i = 0; i < model.prescribed_sites; ++i) held[model.free_sites + i] = true;
    for (bool grew = true; grew;) {
        grew = false;
        const auto join = [&](int start, int end) {
            if (held[vertex(start)] != held[vertex(end)]) held[vertex(start)] = held[vertex(end)] = grew = true;
        };
        for (const Model::Line& line : model.lines) join(line.sites.front(), line.sites.back());
        for (const Model::Joint& joint : model.joints) join(joint.site[0], joint.site[1]);
    }
    for (const Model::Point& point : model.points) {
        require(held[point.site], "point '" + point.name + "'", "no line or joint holds it to a prescribed point");
    }
    for (std::size_t b = 0; b < model.bodies.size(); ++b) {
        require(held[model.sites() + b], "body '" + model.bodies[b].name + "'",
                "no line or joint holds it to a prescribed point");
    }

    double mass = 0.0;
    for (const Model::Point& point : model.points) mass += point.properties.mass;
    for (const Model::BodyEntry& body : model.bodies) mass += body.force.body().mass;
    for (const Model::Segment& segment : model.segments) {
        mass += 2.0 * model.segment_constants[segment.constants].half_mass;
    }
    model.force_scale = mass * gravity;
    for (const Model::ContactPlace& place : model.contact_places) {
        model.stiffest_segment =
            std::max(model.stiffest_segment, tank_->stiffness + tank_->bed_stiffness * place.size.area);
    }
    for (const SegmentConstants& c : model.segment_constants) {
        model.stiffest_segment = std::max(model.stiffest_segment, c.axial_stiffness / c.length);
    }
    for (const Winch& winch : model.winches) {  // its changing segment gets as short as half a segment
        const SegmentConstants& c = model.segment_constants[model.segments[winch.first_segment].constants];
        model.stiffest_segment = std::max(model.stiffest_segment, 2.0 * c.axial_stiffness / c.length);
    }
    model.fingerprint = fingerprint(model);
    return model;
}

}  // namespace sim_core
