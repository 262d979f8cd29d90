// SPDX-License-Identifier: Apache-2.0
#include <numbers>

#include "conversions.hpp"
#include "kept.hpp"
#include "sim_core/heave.hpp"
#include "sim_core/straight_run.hpp"
#include "sim_core/time_series.hpp"
#include "sim_core/turn.hpp"

namespace sim_core::python {

using namespace nb::literals;

namespace {

using Part = std::shared_ptr<const Motion>;
using KeptSum = Kept<MotionSum, std::vector<Part>>;
using KeptTow = Kept<SteadyTow, Vec3, Vec3, double>;
using KeptStop = Kept<EmergencyStop, Vec3, Vec3, double, double, double>;
using KeptTurn = Kept<Turn, Vec3, Vec3, double, double, double, double, double>;
using KeptSinusoid = Kept<Sinusoid, Vec3, Vec3, double, double, double, double, double>;
using KeptCrank = Kept<SliderCrank, Vec3, Vec3, double, double, double, double, double, double>;
using KeptSeries = Kept<TimeSeries, std::vector<double>, std::vector<Vec3>, std::vector<Vec3>>;

/// An array, or rows of three numbers.
using RowsArgument = std::variant<Rows3, std::vector<Triple>>;

std::vector<Vec3> to_vectors(const RowsArgument& given) {
    std::vector<Vec3> values;
    if (const Rows3* array = std::get_if<Rows3>(&given)) {
        for (Eigen::Index i = 0; i < array->rows(); ++i) values.push_back(array->row(i).transpose());
    } else {
        for (const Triple& row : std::get<std::vector<Triple>>(given)) values.push_back(to_vec3(row));
    }
    return values;
}

Rows3 to_array(const std::vector<Vec3>& values) {
    Rows3 array(values.size(), 3);
    for (std::size_t i = 0; i < values.size(); ++i) array.row(i) = values[i].transpose();
    return array;
}

}  // namespace

void bind_motion(nb::module_& module) {
    nb::class_<MotionSample>(module, "MotionSample", "Position, velocity and acceleration of a tow point, tank axes.")
        .def_prop_ro("position", [](const MotionSample& s) { return s.position; }, "(3,) m")
        .def_prop_ro("velocity", [](const MotionSample& s) { return s.velocity; }, "(3,) m/s")
        .def_prop_ro("acceleration", [](const MotionSample& s) { return s.acceleration; }, "(3,) m/s²");

    nb::class_<Motion>(module, "Motion", "A law of motion for a prescribed point, evaluated inside each step.")
        .def("__call__", &Motion::at, "time"_a, "The motion at a time in s.")
        .def(
            "__add__",
            [](Part a, Part b) { return std::make_unique<KeptSum>(std::vector{std::move(a), std::move(b)}); },
            "other"_a, nb::sig("def __add__(self, other: Motion, /) -> MotionSum"),
            "Both at once: positions, velocities and accelerations are added.");

    nb::class_<KeptSum, Motion>(module, "MotionSum", R"(Several motions at once, made by adding laws.

turn + Sinusoid(mean=(0, 0, 0), amplitude=0.5, period=8) heaves on a turn. parts: the laws.)")
        .def(nb::init<const std::vector<Part>&>(), "parts"_a)
        .def_prop_ro("parts", &value<KeptSum, 0>);

    nb::class_<KeptTow, Motion>(module, "SteadyTow", R"(Straight tow at constant velocity.

position: (3,) m at time 0; velocity: (3,) m/s; run_up_time: s, speeds up from rest within it along
10s³ − 15s⁴ + 6s⁵ (0: at full speed from the start).)")
        .def(
            "__init__",
            [](KeptTow* self, const Triple& position, const Triple& velocity, double run_up_time) {
                new (self) KeptTow(to_vec3(position), to_vec3(velocity), run_up_time);
            },
            nb::kw_only(), "position"_a, "velocity"_a = Triple{}, "run_up_time"_a = 0.0)
        .def_prop_ro("position", &value<KeptTow, 0>)
        .def_prop_ro("velocity", &value<KeptTow, 1>)
        .def_prop_ro("run_up_time", &value<KeptTow, 2>);

    nb::class_<KeptStop, Motion>(module, "EmergencyStop", R"(Straight tow that ends in a stop.

position: (3,) m at time 0; velocity: (3,) m/s; stop_time: s, when the ship begins to slow down. Either stopping_time in s
(0: it is held suddenly) or stopping_distance in m says how it comes to rest, along the same smooth law as a start;
the distance is half of what it would go at speed in that time; it is kept as the time. run_up_time: s, as in SteadyTow.)")
        .def(
            "__init__",
            [](KeptStop* self, const Triple& position, const Triple& velocity, double stop_time,
               std::optional<double> stopping_time, std::optional<double> stopping_distance, double run_up_time) {
                if (stopping_time.has_value() == stopping_distance.has_value()) {
                    throw InvalidInput("emergency stop: give either stopping_time or stopping_distance");
                }
                const Vec3 v = to_vec3(velocity);
                const double time = stopping_time ? *stopping_time : 2.0 * *stopping_distance / v.norm();
                new (self) KeptStop(to_vec3(position), v, stop_time, time, run_up_time);
            },
            nb::kw_only(), "position"_a, "velocity"_a, "stop_time"_a, "stopping_time"_a = nb::none(),
            "stopping_distance"_a = nb::none(), "run_up_time"_a = 0.0)
        .def_prop_ro("position", &value<KeptStop, 0>)
        .def_prop_ro("velocity", &value<KeptStop, 1>)
        .def_prop_ro("stop_time", &value<KeptStop, 2>)
        .def_prop_ro("stopping_time", &value<KeptStop, 3>)
        .def_prop_ro("run_up_time", &value<KeptStop, 4>);

    nb::class_<KeptTurn, Motion>(module, "Turn", R"(Straight, turn, straight, at constant speed.

position: (3,) m at time 0; velocity: (3,) m/s, level; start_time: s; angle: rad, how far the heading changes, positive to
port (counterclockwise seen from above), 2π and more for circles. Either radius in m, or circle_time in s for one full
circle at the full rate of turn, kept as the radius. entry_time: s, in which the rate of turn rises smoothly, and falls again at the end;
the ship turns by as much longer, so that the angle is exact. run_up_time: s, as in SteadyTow.
Raises InvalidInput if the angle is reached before the full rate of turn.)")
        .def(
            "__init__",
            [](KeptTurn* self, const Triple& position, const Triple& velocity, double start_time, double angle,
               std::optional<double> radius, std::optional<double> circle_time, double entry_time,
               double run_up_time) {
                if (radius.has_value() == circle_time.has_value()) {
                    throw InvalidInput("turn: give either radius or circle_time");
                }
                const Vec3 v = to_vec3(velocity);
                const double r = radius ? *radius : v.norm() * *circle_time / (2.0 * std::numbers::pi);
                new (self) KeptTurn(to_vec3(position), v, start_time, r, angle, entry_time, run_up_time);
            },
            nb::kw_only(), "position"_a, "velocity"_a, "start_time"_a, "angle"_a, "radius"_a = nb::none(),
            "circle_time"_a = nb::none(), "entry_time"_a = 0.0, "run_up_time"_a = 0.0)
        .def_prop_ro("position", &value<KeptTurn, 0>)
        .def_prop_ro("velocity", &value<KeptTurn, 1>)
        .def_prop_ro("start_time", &value<KeptTurn, 2>)
        .def_prop_ro("radius", &value<KeptTurn, 3>)
        .def_prop_ro("angle", &value<KeptTurn, 4>)
        .def_prop_ro("entry_time", &value<KeptTurn, 5>)
        .def_prop_ro("run_up_time", &value<KeptTurn, 6>);

    nb::class_<KeptSinusoid, Motion>(module, "Sinusoid", R"(Straight tow with the heave A sin(2π t / period + phase).

mean: (3,) m, mean position at time 0; velocity: (3,) m/s; amplitude A: m; period: s; phase: rad;
ramp_time: s, the amplitude fades in within it; run_up_time: s, as in SteadyTow.)")
        .def(
            "__init__",
            [](KeptSinusoid* self, const Triple& mean, const Triple& velocity, double amplitude, double period,
               double phase, double ramp_time, double run_up_time) {
                new (self) KeptSinusoid(to_vec3(mean), to_vec3(velocity), amplitude, period, phase, ramp_time,
                                    run_up_time);
            },
            nb::kw_only(), "mean"_a, "velocity"_a = Triple{}, "amplitude"_a, "period"_a, "phase"_a = 0.0,
            "ramp_time"_a = 0.0, "run_up_time"_a = 0.0)
        .def_prop_ro("mean", &value<KeptSinusoid, 0>)
        .def_prop_ro("velocity", &value<KeptSinusoid, 1>)
        .def_prop_ro("amplitude", &value<KeptSinusoid, 2>)
        .def_prop_ro("period", &value<KeptSinusoid, 3>)
        .def_prop_ro("phase", &value<KeptSinusoid, 4>)
        .def_prop_ro("ramp_time", &value<KeptSinusoid, 5>)
        .def_prop_ro("run_up_time", &value<KeptSinusoid, 6>);

    nb::class_<KeptCrank, Motion>(module, "SliderCrank", R"(Straight tow with the heave of a slider crank.

z = mean z − r cos θ + l (1 − √(1 − (r/l)² sin²θ)), θ the crank angle (Wu & Chwang 2001).
mean: (3,) m, the crank's centre as seen at the tow point; velocity: (3,) m/s; crank_radius r, rod_length l: m;
period: s a turn; phase: rad, θ at time 0; ramp_time: s, the crank speeds up from rest within it, after
which θ = phase + 2π (t − ramp_time/2) / period; run_up_time: s, as in SteadyTow.)")
        .def(
            "__init__",
            [](KeptCrank* self, const Triple& mean, const Triple& velocity, double crank_radius, double rod_length,
               double period, double phase, double ramp_time, double run_up_time) {
                new (self) KeptCrank(to_vec3(mean), to_vec3(velocity), crank_radius, rod_length, period, phase,
                                       ramp_time, run_up_time);
            },
            nb::kw_only(), "mean"_a, "velocity"_a = Triple{}, "crank_radius"_a, "rod_length"_a, "period"_a,
            "phase"_a = 0.0, "ramp_time"_a = 0.0, "run_up_time"_a = 0.0)
        .def_prop_ro("mean", &value<KeptCrank, 0>)
        .def_prop_ro("velocity", &value<KeptCrank, 1>)
        .def_prop_ro("crank_radius", &value<KeptCrank, 2>)
        .def_prop_ro("rod_length", &value<KeptCrank, 3>)
        .def_prop_ro("period", &value<KeptCrank, 4>)
        .def_prop_ro("phase", &value<KeptCrank, 5>)
        .def_prop_ro("ramp_time", &value<KeptCrank, 6>)
        .def_prop_ro("run_up_time", &value<KeptCrank, 7>);

    nb::class_<KeptSeries, Motion>(module, "TimeSeries", R"(Motion through samples, by cubic Hermite interpolation.

time: (n,) s, increasing; position: (n, 3) m; velocity: (n, 3) m/s. Constant velocity before and after.)")
        .def(
            "__init__",
            [](KeptSeries* self, const std::vector<double>& time, const RowsArgument& position,
               const RowsArgument& velocity) {
                new (self) KeptSeries(time, to_vectors(position), to_vectors(velocity));
            },
            "time"_a, "position"_a, "velocity"_a)
        .def_prop_ro("time", &value<KeptSeries, 0>)
        .def_prop_ro("position", [](const KeptSeries& s) { return to_array(value<KeptSeries, 1>(s)); })
        .def_prop_ro("velocity", [](const KeptSeries& s) { return to_array(value<KeptSeries, 2>(s)); });
}

}  // namespace sim_core::python
