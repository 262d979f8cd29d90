// SPDX-License-Identifier: Apache-2.0
#include "conversions.hpp"

namespace sim_core::python {

using namespace nb::literals;

void bind_motion(nb::module_& module) {
    nb::class_<MotionSample>(module, "MotionSample", "Position, velocity and acceleration of a tow point, tank axes.")
        .def_prop_ro("position", [](const MotionSample& s) { return s.position; }, "(3,) m")
        .def_prop_ro("velocity", [](const MotionSample& s) { return s.velocity; }, "(3,) m/s")
        .def_prop_ro("acceleration", [](const MotionSample& s) { return s.acceleration; }, "(3,) m/s²");

    nb::class_<Motion>(module, "Motion", "A law of motion for a prescribed point, evaluated inside each step.")
        .def("__call__", &Motion::at, "time"_a, "The motion at a time in s.");

    nb::class_<SteadyTow, Motion>(module, "SteadyTow", R"(Straight tow at constant velocity.

position: (3,) m at time 0; velocity: (3,) m/s; run_up_time: s, speeds up from rest within it along
10s³ − 15s⁴ + 6s⁵ (0: at full speed from the start).)")
        .def(
            "__init__",
            [](SteadyTow* self, const Triple& position, const Triple& velocity, double run_up_time) {
                new (self) SteadyTow(to_vec3(position), to_vec3(velocity), run_up_time);
            },
            nb::kw_only(), "position"_a, "velocity"_a = Triple{}, "run_up_time"_a = 0.0);

    nb::class_<Sinusoid, Motion>(module, "Sinusoid", R"(Straight tow with the heave A sin(2π t / period + phase).

mean: (3,) m, mean position at time 0; velocity: (3,) m/s; amplitude A: m; period: s; phase: rad;
ramp_time: s, the amplitude fades in within it; run_up_time: s, as in SteadyTow.)")
        .def(
            "__init__",
            [](Sinusoid* self, const Triple& mean, const Triple& velocity, double amplitude, double period,
               double phase, double ramp_time, double run_up_time) {
                new (self) Sinusoid(to_vec3(mean), to_vec3(velocity), amplitude, period, phase, ramp_time,
                                    run_up_time);
            },
            nb::kw_only(), "mean"_a, "velocity"_a = Triple{}, "amplitude"_a, "period"_a, "phase"_a = 0.0,
            "ramp_time"_a = 0.0, "run_up_time"_a = 0.0);

    nb::class_<SliderCrank, Motion>(module, "SliderCrank", R"(Straight tow with the heave of a slider crank.

z = mean z − r cos θ + l (1 − √(1 − (r/l)² sin²θ)), θ the crank angle (Wu & Chwang 2001).
mean: (3,) m, the crank's centre as seen at the tow point; velocity: (3,) m/s; crank_radius r, rod_length l: m;
period: s a turn; phase: rad, θ at time 0; ramp_time: s, the crank speeds up from rest within it, after
which θ = phase + 2π (t − ramp_time/2) / period; run_up_time: s, as in SteadyTow.)")
        .def(
            "__init__",
            [](SliderCrank* self, const Triple& mean, const Triple& velocity, double crank_radius, double rod_length,
               double period, double phase, double ramp_time, double run_up_time) {
                new (self) SliderCrank(to_vec3(mean), to_vec3(velocity), crank_radius, rod_length, period, phase,
                                       ramp_time, run_up_time);
            },
            nb::kw_only(), "mean"_a, "velocity"_a = Triple{}, "crank_radius"_a, "rod_length"_a, "period"_a,
            "phase"_a = 0.0, "ramp_time"_a = 0.0, "run_up_time"_a = 0.0);

    nb::class_<TimeSeries, Motion>(module, "TimeSeries", R"(Motion through samples, by cubic Hermite interpolation.

time: (n,) s, increasing; position: (n, 3) m; velocity: (n, 3) m/s. Constant velocity before and after.)")
        .def(
            "__init__",
            [](TimeSeries* self, const std::vector<double>& time, const Eigen::Ref<const Rows3>& position,
               const Eigen::Ref<const Rows3>& velocity) {
                const auto rows = [](const Eigen::Ref<const Rows3>& array) {
                    std::vector<Vec3> values;
                    for (Eigen::Index i = 0; i < array.rows(); ++i) values.push_back(array.row(i).transpose());
                    return values;
                };
                new (self) TimeSeries(time, rows(position), rows(velocity));
            },
            "time"_a, "position"_a, "velocity"_a);
}

}  // namespace sim_core::python
