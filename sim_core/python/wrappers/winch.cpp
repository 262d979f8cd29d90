// SPDX-License-Identifier: Apache-2.0
#include "conversions.hpp"
#include "kept.hpp"
#include "sim_core/payout.hpp"

namespace sim_core::python {

using namespace nb::literals;

namespace {

using KeptSteady = Kept<SteadyPayout, double, double, double, double, double>;
using KeptSeries = Kept<PayoutSeries, Table>;

}  // namespace

void bind_winches(nb::module_& module) {
    nb::class_<PayoutSample>(module, "PayoutSample", "Unstretched length of a line that is out, and its rate.")
        .def_ro("length", &PayoutSample::length, "m")
        .def_ro("rate", &PayoutSample::rate, "m/s, negative when hauling in");

    nb::class_<Payout>(module, "Payout", "A law of the length of line that is out, evaluated inside each step.")
        .def("__call__", &Payout::at, "time"_a, "Length and rate at a time in s.");

    nb::class_<KeptSteady, Payout>(module, "SteadyPayout", R"(From one length to another at a constant rate.

start_length, end_length: m, unstretched; rate: m/s, its size, whichever way; start_time: s; ramp_time: s, within which
the rate rises and, after |end_length − start_length|/rate, falls along 10s³ − 15s⁴ + 6s⁵.)")
        .def(nb::init<double, double, double, double, double>(), nb::kw_only(), "start_length"_a, "end_length"_a,
             "rate"_a, "start_time"_a = 0.0, "ramp_time"_a = 0.0)
        .def_prop_ro("start_length", &value<KeptSteady, 0>)
        .def_prop_ro("end_length", &value<KeptSteady, 1>)
        .def_prop_ro("rate", &value<KeptSteady, 2>)
        .def_prop_ro("start_time", &value<KeptSteady, 3>)
        .def_prop_ro("ramp_time", &value<KeptSteady, 4>);

    nb::class_<KeptSeries, Payout>(module, "PayoutSeries", R"(A smooth monotone curve through samples; at rest before and after them.

samples: pairs (time s, unstretched length m), times increasing.)")
        .def(nb::init<const Table&>(), "samples"_a)
        .def_prop_ro("samples", &value<KeptSeries, 0>);
}

}  // namespace sim_core::python
