// SPDX-License-Identifier: Apache-2.0
#include <nanobind/stl/tuple.h>

#include "conversions.hpp"
#include "sim_core/rotation.hpp"

namespace sim_core::python {

using namespace nb::literals;

void bind_bodies(nb::module_& module) {
    nb::class_<Fin>(module, "Fin", R"(A lifting surface on a body; its force follows the local flow, the body's rotation included.

position: (3,) m, aerodynamic centre in body axes; normal: (3,) unit normal in body axes ((0, 0, 1) for a
horizontal fin, (0, 1, 0) for a vertical one); area: m² planform; lift_slope: 1/rad; drag: profile
drag coefficient on the planform; stall_angle: rad, beyond which the lift stays level; cross_flow_drag: drag
coefficient broadside (1.17 for a plate normal to the flow, Hoerner 1965); aspect_ratio: of the induced drag
C_L²/(πA), span² over area with the mirror image if the root is at a hull, times the efficiency of a lift that is not
elliptic. None: that of a straight fin with this lift_slope (Helmbold), which a lift_slope with body_lift_factor() is not;
math.inf: no induced drag; lift_slope/π: no suction at the leading edge (a sharp plate), C_L sin α.
Lift ½ρS a sin α cos α v² up to stall, drag ½ρS ((drag + C_L²/πA) v² along the flow, cross_flow_drag w|w| along the normal).)")
        .def(
            "__init__",
            [](Fin* self, const Triple& position, const Triple& normal, double area, double lift_slope, double drag,
               double stall_angle, double cross_flow_drag, std::optional<double> aspect_ratio) {
                new (self) Fin{to_vec3(position), to_vec3(normal), area, lift_slope, drag, stall_angle,
                               cross_flow_drag, aspect_ratio};
            },
            nb::kw_only(), "position"_a, "normal"_a, "area"_a, "lift_slope"_a, "drag"_a = 0.01,
            "stall_angle"_a = 0.3, "cross_flow_drag"_a = 1.17, "aspect_ratio"_a = nb::none())
        .def_ro("position", &Fin::position)
        .def_ro("normal", &Fin::normal)
        .def_ro("area", &Fin::area)
        .def_ro("lift_slope", &Fin::lift_slope)
        .def_ro("drag", &Fin::drag)
        .def_ro("stall_angle", &Fin::stall_angle)
        .def_ro("cross_flow_drag", &Fin::cross_flow_drag)
        .def_ro("aspect_ratio", &Fin::aspect_ratio);

    nb::class_<Downwash>(module, "Downwash", R"(A fin in the downwash of another one ahead of it.

front, rear: indices into the body's fins; slope: dε/dα (downwash_slope() estimates it). The flow at the rear fin is
turned by slope times the incidence of the front fin, up to its stall.)")
        .def(
            "__init__",
            [](Downwash* self, int front, int rear, double slope) { new (self) Downwash{front, rear, slope}; },
            nb::kw_only(), "front"_a, "rear"_a, "slope"_a)
        .def_ro("front", &Downwash::front)
        .def_ro("rear", &Downwash::rear)
        .def_ro("slope", &Downwash::slope);

    nb::class_<HullTable>(module, "HullTable", R"(Coefficients of a hull's steady force and moment over angle of attack and sideslip.

attack: (n,) rad, positive nose up, and sideslip: (m,) rad, positive when the body drifts to port; ascending, 3 at
least, within ±π and ±π/2. coefficients: (n, m, 6): drag against the velocity, side force (to port), lift (normal to
the velocity in the turned plane of symmetry); moments about body x, y (positive: nose down), z. On ½ρ U² area, moments
also × length (m², m); about the origin of the body.
Bicubic between the nodes with continuous slope, exact for polynomials of second degree in each angle. Beyond the
range, which is for transients only, drag stays and the rest fades to zero in flow from behind or along y.
InvalidInput says what is wrong with a table when it is made.)")
        .def(
            "__init__",
            [](HullTable* self, std::vector<double> attack, std::vector<double> sideslip,
               const std::vector<std::vector<std::array<double, 6>>>& rows, double area, double length) {
                HullTable table{std::move(attack), std::move(sideslip), {}, area, length};
                for (const auto& row : rows) {
                    if (row.size() != table.sideslip.size()) {
                        throw InvalidInput("hull table: there must be 6 coefficients for each attack and sideslip");
                    }
                    table.coefficients.insert(table.coefficients.end(), row.begin(), row.end());
                }
                (void)HullTableForce(table, 1.0);  // validates
                new (self) HullTable(std::move(table));
            },
            nb::kw_only(), "attack"_a, "sideslip"_a, "coefficients"_a, "area"_a, "length"_a)
        .def_ro("attack", &HullTable::attack)
        .def_ro("sideslip", &HullTable::sideslip)
        .def_prop_ro(
            "coefficients",
            [](const HullTable& table) {
                std::vector<std::vector<std::array<double, 6>>> rows;
                const std::size_t columns = table.sideslip.size();
                for (auto row = table.coefficients.begin(); row != table.coefficients.end(); row += columns) {
                    rows.emplace_back(row, row + columns);
                }
                return rows;
            },
            "(n, m, 6), as lists")
        .def_ro("area", &HullTable::area)
        .def_ro("length", &HullTable::length)
        .def(
            "at",
            [](const HullTable& table, double attack, double sideslip) {
                HullTableForce::Coefficients c, c_attack, c_sideslip;
                HullTableForce(table, 1.0).interpolate(attack, sideslip, c, c_attack, c_sideslip);
                return Eigen::Matrix<double, 6, 1>(c.matrix());
            },
            "attack"_a, "sideslip"_a = 0.0, "The six coefficients at an angle of attack and a sideslip (rad).");

    nb::class_<Body>(module, "Body", R"(A rigid body with six degrees of freedom, a tow-fish.

Body axes: x forward, y to port, z up; the origin is mid-hull.
mass: kg, enclosed water included; inertia: kg·m² about the origin (enclosed water included), (Ixx, Iyy, Izz) or a
(3, 3) matrix; centre_of_gravity, centre_of_buoyancy: (3,) m; volume: m³, enclosed water included
(mass_properties() adds up parts); diameter, length: m of the hull, a straight cylinder;
added_mass: about the origin, its diagonal (x, y, z in kg, roll, pitch, yaw in kg·m²) or a symmetric (6, 6) matrix
(hull_added_mass(), revolution_added_mass() and fin_added_mass() make one);
axial_drag: coefficient on π d²/4; cross_flow_drag: coefficient on the side area, integrated over `strips` strips
with the local cross-flow (which gives pitch and yaw damping);
drag_area: Cd·A in m² of what is neither hull nor fins, along the body axes or a symmetric (3, 3) matrix A: a force
½ρ |u| A u at the origin; turning_drag: m⁵, likewise B: a moment −½ρ |ω| B ω;
munk_moment: 0 … 1, the share of the convective part of the added-mass wrench. 1: Kirchhoff's equations, whose
added mass brings the Munk moment with it. 0: added mass resists acceleration only (Morison's form), neither
the Munk moment nor the forces that belong to it.
fins: list of Fin; downwash: list of Downwash between them;
hull_table: HullTable, steady force and moment of the hull in place of axial and cross-flow drag. It holds the Munk moment
too: axial_drag and munk_moment must be 0. cross_flow_drag then only damps rotation;
places: (3,) m in body axes by name, where sensors sit: see BodyHistory.at.)")
        .def(
            "__init__",
            [](Body* self, double mass, const SquareArgument<3>& inertia, const Triple& centre_of_gravity,
               double volume, const Triple& centre_of_buoyancy, double diameter, double length,
               const SquareArgument<6>& added_mass, double axial_drag, double cross_flow_drag, double munk_moment,
               const std::vector<Fin>& fins, int strips, const std::vector<Downwash>& downwash,
               const std::optional<HullTable>& hull_table, const std::map<std::string, Triple>& places,
               const SquareArgument<3>& drag_area, const SquareArgument<3>& turning_drag) {
                std::map<std::string, Vec3> at;
                for (const auto& [name, place] : places) at[name] = to_vec3(place);
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
                                to_matrix<3>(drag_area),
                                to_matrix<3>(turning_drag),
                                munk_moment,
                                strips,
                                fins,
                                downwash,
                                hull_table,
                                at};
            },
            nb::kw_only(), "mass"_a, "inertia"_a, "centre_of_gravity"_a = Triple{}, "volume"_a,
            "centre_of_buoyancy"_a = Triple{}, "diameter"_a, "length"_a, "added_mass"_a = std::array<double, 6>{},
            "axial_drag"_a, "cross_flow_drag"_a, "munk_moment"_a = 1.0, "fins"_a = std::vector<Fin>{}, "strips"_a = 20,
            "downwash"_a = std::vector<Downwash>{}, "hull_table"_a = nb::none(),
            "places"_a = std::map<std::string, Triple>{}, "drag_area"_a = std::array<double, 3>{},
            "turning_drag"_a = std::array<double, 3>{})
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
        .def_ro("drag_area", &Body::drag_area, "(3, 3) m²")
        .def_ro("turning_drag", &Body::turning_drag, "(3, 3) m⁵")
        .def_ro("munk_moment", &Body::munk_moment)
        .def_ro("strips", &Body::strips)
        .def_ro("fins", &Body::fins)
        .def_ro("downwash", &Body::downwash)
        .def_ro("hull_table", &Body::hull_table)
        .def_ro("places", &Body::places);

    // What the water and gravity do to a body in steady motion far below the surface, for static stability.
    module.def(
        "_body_wrench",
        [](const Body& body, const Water& water, const std::array<double, 4>& q, const Triple& velocity) {
            const Mat3 rotation = Quat(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
            const Vec3 zero = Vec3::Zero();
            const Vec3 position(0.0, 0.0, -1e3 * body.length);
            const Vec3 v = to_vec3(velocity);
            Vec3 force, moment;
            BodyJacobian jacobian;
            const Water uniform{water.density, water.gravity, {water.current.at(position.z(), 0.0), {}, {}}, {}};
            std::vector<WaterMotion> along(1);
            WaterProbe(uniform).at(position, along[0]);
            BodyForce("body", body, uniform)
                .evaluate(uniform, along, {position, rotation, v, zero, zero, zero}, force, moment, jacobian);
            // in body axes: Rᵀ F changes with Rᵀ too
            const Vec3 seen = rotation.transpose() * force;
            const Mat3 force_turn = rotation.transpose() * jacobian.position.block<3, 3>(0, 3) + skew(seen);
            const Mat3 moment_turn = jacobian.position.block<3, 3>(3, 3);
            return std::make_tuple(seen, moment, force_turn, moment_turn);
        },
        "body"_a, "water"_a, "quaternion"_a, "velocity"_a);
}

}  // namespace sim_core::python
