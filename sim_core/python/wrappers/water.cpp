// SPDX-License-Identifier: Apache-2.0
#include "conversions.hpp"

namespace sim_core::python {

using namespace nb::literals;

void bind_water(nb::module_& module) {
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
}

}  // namespace sim_core::python
