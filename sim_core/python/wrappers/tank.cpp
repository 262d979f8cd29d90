// SPDX-License-Identifier: Apache-2.0
#include "conversions.hpp"

namespace sim_core::python {

using namespace nb::literals;

void bind_tank(nb::module_& module) {
    nb::class_<Tank>(module, "Tank", R"(Floor and walls that push back what touches them, as far as they are given.

floor: z, m; width: m, walls at y = ±width/2; ends: x of the aft and the forward end wall, m.
Nodes of lines, free points, and nose, middle and tail of hulls touch as spheres with the radius of what is there (a
point's from its volume). At a depth d they are pushed with k · d · (1 + damping · ḋ), never pulled (Hunt & Crossley
1975): damping s/m; rounded off within ±onset (m) of d = 0. k is stiffness, N/m, for each place alike; on the floor
also bed_stiffness, Pa/m (the modulus of subgrade reaction), times the area that a place stands for: diameter times
length of line, a sphere's section, a third of a hull's plan. friction: Coulomb's coefficient, in full
from about sliding_speed (m/s) on. Fins do not touch. Raises InvalidInput.)")
        .def(
            "__init__",
            [](Tank* self, double stiffness, std::optional<double> floor, std::optional<double> width,
               std::optional<std::pair<double, double>> ends, double bed_stiffness, double damping, double friction,
               double onset, double sliding_speed) {
                const Tank tank{floor, width, ends, stiffness, bed_stiffness, damping, friction, onset, sliding_speed};
                (void)tank_sides(tank);  // validates
                new (self) Tank(tank);
            },
            nb::kw_only(), "stiffness"_a = Tank{}.stiffness, "floor"_a = nb::none(), "width"_a = nb::none(),
            "ends"_a = nb::none(), "bed_stiffness"_a = Tank{}.bed_stiffness, "damping"_a = Tank{}.damping, "friction"_a = Tank{}.friction, "onset"_a = Tank{}.onset,
            "sliding_speed"_a = Tank{}.sliding_speed)
        .def_ro("stiffness", &Tank::stiffness)
        .def_ro("floor", &Tank::floor)
        .def_ro("width", &Tank::width)
        .def_ro("ends", &Tank::ends)
        .def_ro("bed_stiffness", &Tank::bed_stiffness)
        .def_ro("damping", &Tank::damping)
        .def_ro("friction", &Tank::friction)
        .def_ro("onset", &Tank::onset)
        .def_ro("sliding_speed", &Tank::sliding_speed);

    nb::class_<Contact>(module, "Contact", "Something touched the tank.")
        .def(
            "__init__",
            [](Contact* self, const std::string& place, const std::string& side, const Triple& position, double time,
               double released) { new (self) Contact{place, side, to_vec3(position), time, released}; },
            nb::kw_only(), "place"_a, "side"_a, "position"_a, "time"_a, "released"_a)
        .def_ro("place", &Contact::place, "what touched, as \"line 'cable' node 3\" or \"body 'fish' nose\"")
        .def_ro("side", &Contact::side, "floor, port wall, starboard wall, aft end or forward end")
        .def_ro("position", &Contact::position, "(3,) m, of the place when it touched")
        .def_ro("time", &Contact::time, "s, at the end of the step that touched")
        .def_ro("released", &Contact::released, "s, likewise; inf while it still touches");
}

}  // namespace sim_core::python
