// SPDX-License-Identifier: Apache-2.0
#include "fingerprint.hpp"

#include <bit>

namespace sim_core {

namespace {

class Hash {
  public:
    void add(std::uint64_t value) {
        for (int i = 0; i < 8; ++i) {
            value_ = (value_ ^ (value & 0xff)) * 0x100000001b3ULL;
            value >>= 8;
        }
    }
    void add(int value) { add(static_cast<std::uint64_t>(value)); }
    void add(bool value) { add(static_cast<std::uint64_t>(value)); }
    void add(double value) { add(std::bit_cast<std::uint64_t>(value == 0.0 ? 0.0 : value)); }  // −0 is 0
    void add(const std::string& text) {
        add(text.size());
        for (const char c : text) add(static_cast<std::uint64_t>(static_cast<unsigned char>(c)));
    }
    template <int rows, int columns>
    void add(const Eigen::Matrix<double, rows, columns>& matrix) {
        for (const double value : matrix.reshaped()) add(value);
    }
    template <class A, class B>
    void add(const std::pair<A, B>& pair) {
        all(pair.first, pair.second);
    }
    template <class T>
    void add(const std::optional<T>& value) {
        add(value.has_value());
        if (value) add(*value);
    }
    template <class... T>
    void add(const std::variant<T...>& value) {
        add(value.index());
        std::visit([this](const auto& held) { add(held); }, value);
    }
    template <class T>
        requires requires(const T& t) { t.begin(); t.size(); }
    void add(const T& items) {
        add(items.size());
        for (const auto& item : items) add(item);
    }

    void add(const VelocityTable& table) { add(table.rows()); }
    void add(const Current& c) { all(c.uniform, c.profile, c.series); }
    void add(const WaveTrain& t) { all(t.amplitude, t.frequency, t.direction, t.phase); }
    void add(const Sea& s) { all(s.trains(), s.depth(), s.gravity(), s.ramp_time()); }
    void add(const Water& w) { all(w.density, w.gravity, w.current, w.waves, w.kinematic_viscosity); }
    void add(const FixedAxes& f) { all(f.drag_area, f.added_mass); }
    void add(const Weathervane& w) { all(w.drag_area, w.added_mass, w.turning_speed); }
    void add(const Model::Point& p) {
        all(p.name, p.prescribed, p.properties.mass, p.properties.volume, p.properties.shape);
    }
    void add(const Fin& f) {
        all(f.position, f.normal, f.area, f.lift_slope, f.drag, f.stall_angle, f.cross_flow_drag, f.aspect_ratio);
    }
    void add(const Downwash& d) { all(d.front, d.rear, d.slope); }
    void add(const HullTable& t) { all(t.attack, t.sideslip, t.coefficients, t.area, t.length); }
    void add(const Model::BodyEntry& entry) {
        const Body& b = entry.force.body();
        all(entry.name, b.mass, b.inertia, b.centre_of_gravity, b.volume, b.centre_of_buoyancy, b.diameter, b.length,
            b.added_mass, b.axial_drag, b.cross_flow_drag, b.drag_area, b.turning_drag, b.munk_moment, b.strips, b.fins,
            b.downwash, b.hull_table, b.places);
    }
    void add(const LineSection& s) {
        const LineProperties& p = s.properties;
        all(p.length, p.diameter, p.mass_per_length, p.axial_stiffness, p.axial_damping, p.bending_stiffness, p.normal_drag,
            p.tangential_drag, p.lift, p.added_mass, p.tangential_added_mass, p.displaced_area, p.slack_tension, s.segments);
    }
    void add(const LineEnd& e) { all(e.at, e.attachment, e.direction); }
    void add(const Model::Line& l) { all(l.name, l.sections, l.ends[0], l.ends[1], l.sites); }
    void add(const Model::Joint& j) { all(j.name, j.ends[0], j.ends[1], j.stiffness, j.damping); }
    void add(const Winch& w) { all(w.line, w.initial); }
    void add(const Tank& t) {
        all(t.floor, t.width, t.ends, t.stiffness, t.bed_stiffness, t.damping, t.friction, t.onset, t.sliding_speed);
    }

    template <class... Values>
    void all(const Values&... values) {
        (add(values), ...);
    }

    std::uint64_t value() const { return value_; }

  private:
    std::uint64_t value_ = 0xcbf29ce484222325ULL;
};

}  // namespace

std::uint64_t fingerprint(const Model& model) {
    Hash hash;
    hash.all(model.water, model.points, model.bodies, model.lines, model.joints, model.winches, model.tank);
    return hash.value();
}

}  // namespace sim_core
