// SPDX-License-Identifier: Apache-2.0
#include "conversions.hpp"

namespace nb = nanobind;

NB_MODULE(_core, module) {
    module.doc() = "The compiled part of sim_core; import sim_core instead.";
    nb::exception<sim_core::InvalidInput>(module, "InvalidInput", PyExc_ValueError).doc() =
        "A description or an argument that no simulation can be made of; the message says what and where.";
    nb::exception<sim_core::ConvergenceError>(module, "ConvergenceError", PyExc_RuntimeError).doc() =
        "The equations could not be solved; the message names the place and the time.";
    // Objects that a Python module still holds when the interpreter ends are no leaks of ours.
    nb::set_leak_warnings(false);
    sim_core::python::bind_sea(module);
    sim_core::python::bind_tank(module);
    sim_core::python::bind_water(module);
    sim_core::python::bind_lines(module);
    sim_core::python::bind_bodies(module);
    sim_core::python::bind_model(module);
    sim_core::python::bind_motion(module);
    sim_core::python::bind_ship_response(module);
    sim_core::python::bind_winches(module);
    sim_core::python::bind_simulation(module);
    sim_core::python::bind_values(module);
}
