// SPDX-License-Identifier: Apache-2.0
#include "sim_core/sea.hpp"

#include "conversions.hpp"

namespace sim_core::python {

using namespace nb::literals;

namespace {

constexpr double kDeep = std::numeric_limits<double>::infinity();

/// One number for every wave train, or one for each.
using PerTrain = std::variant<double, std::vector<double>>;

std::vector<double> per_train(const PerTrain& given, std::size_t trains, const char* what) {
    if (const double* one = std::get_if<double>(&given)) return std::vector<double>(trains, *one);
    const auto& all = std::get<std::vector<double>>(given);
    if (all.size() != trains) {
        throw InvalidInput(std::string("sea: ") + what + " must be one number or one for each of the " +
                           std::to_string(trains) + " amplitudes");
    }
    return all;
}

std::vector<double> of_trains(const Sea& sea, double WaveTrain::*value) {
    std::vector<double> all;
    for (const WaveTrain& train : sea.trains()) all.push_back(train.*value);
    return all;
}

}  // namespace

void bind_sea(nb::module_& module) {
    nb::class_<Sea>(module, "Sea", R"(Waves: a sum of long-crested Airy trains on water of constant depth.

Each train is ζ = a cos(k (x cos β + y sin β) − ω t + ε), with ω² = g k tanh(k depth).
amplitude: (n,) a, m; frequency: (n,) ω, rad/s; direction: β, rad, towards which a train travels, from +x to +y;
phase: ε, rad (one for all, or (n,)); depth: m, infinite by default; gravity: m/s², the same as the water's;
ramp_time: s, within which the waves rise from calm after time 0, as 10s³ − 15s⁴ + 6s⁵ (0: there from the start).
Raises InvalidInput. See regular_waves and jonswap_sea.)")
        .def(
            "__init__",
            [](Sea* self, const std::vector<double>& amplitude, const PerTrain& frequency, const PerTrain& direction,
               const PerTrain& phase, double depth, double gravity, double ramp_time) {
                const std::size_t n = amplitude.size();
                const auto frequencies = per_train(frequency, n, "frequency");
                const auto directions = per_train(direction, n, "direction");
                const auto phases = per_train(phase, n, "phase");
                std::vector<WaveComponent> components;
                for (std::size_t i = 0; i < n; ++i) {
                    components.push_back({amplitude[i], frequencies[i], directions[i], phases[i]});
                }
                new (self) Sea(components, depth, gravity, ramp_time);
            },
            nb::kw_only(), "amplitude"_a, "frequency"_a, "direction"_a = 0.0, "phase"_a = 0.0, "depth"_a = kDeep,
            "gravity"_a = 9.81, "ramp_time"_a = 0.0)
        .def_prop_ro("amplitude", [](const Sea& s) { return of_trains(s, &WaveTrain::amplitude); }, "m")
        .def_prop_ro("frequency", [](const Sea& s) { return of_trains(s, &WaveTrain::frequency); }, "rad/s")
        .def_prop_ro("direction", [](const Sea& s) { return of_trains(s, &WaveTrain::direction); }, "rad")
        .def_prop_ro("phase", [](const Sea& s) { return of_trains(s, &WaveTrain::phase); }, "rad")
        .def_prop_ro("depth", &Sea::depth, "m")
        .def_prop_ro("gravity", &Sea::gravity, "m/s²")
        .def_prop_ro("ramp_time", &Sea::ramp_time, "s")
        .def("wave_numbers", [](const Sea& s) { return of_trains(s, &WaveTrain::wave_number); }, "(n,) 1/m")
        .def(
            "elevation",
            [](const Sea& s, const Eigen::VectorXd& time, double x, double y) {
                Eigen::VectorXd all(time.size());
                for (Eigen::Index i = 0; i < time.size(); ++i) all[i] = s.elevation(x, y, time[i]);
                return all;
            },
            "time"_a, nb::kw_only(), "x"_a = 0.0, "y"_a = 0.0,
            "(samples,) m: height of the surface at a place (m, tank axes) at times in s.");

    module.def("regular_waves", &regular_waves, nb::kw_only(), "height"_a, "period"_a, "direction"_a = 0.0,
               "phase"_a = 0.0, "depth"_a = kDeep, "gravity"_a = 9.81, "ramp_time"_a = 0.0,
               "A Sea of one train: height m from trough to crest, period s; the rest as in Sea.");

    module.def(
        "jonswap_sea",
        [](double significant_height, double peak_period, double gamma, double direction,
           std::optional<double> spreading, int components, std::uint64_t seed,
           std::optional<std::pair<double, double>> frequency_range, double depth, double gravity, double ramp_time) {
            const Jonswap spectrum{significant_height, peak_period, gamma,
                                   direction,          spreading,   components,
                                   seed,               frequency_range};
            return jonswap_sea(spectrum, depth, gravity, ramp_time);
        },
        nb::kw_only(), "significant_height"_a, "peak_period"_a, "gamma"_a = 3.3, "direction"_a = 0.0,
        "spreading"_a = nb::none(), "components"_a = 200, "seed"_a = 0, "frequency_range"_a = nb::none(),
        "depth"_a = kDeep, "gravity"_a = 9.81, "ramp_time"_a = 0.0,
        "An irregular Sea with the JONSWAP spectrum (Hasselmann et al. 1973; DNV-RP-C205).\n\n"
        "significant_height: m, 4 standard deviations of the elevation; peak_period: s; gamma: peak enhancement\n"
        "(1: Pierson–Moskowitz); direction: rad; spreading: exponent n of cosⁿ about the direction, None: long-crested;\n"
        "components: how many trains; seed: the same sea for the same seed, on every machine;\n"
        "frequency_range: (from, to) rad/s, by default 0.5 to 5 times the peak's; the rest as in Sea.\n"
        "Amplitudes are fixed and alike (pieces of equal energy), phases random and uniform: Σ a²/2 = Hs²/16.");

    module.def("wave_number", &wave_number, "frequency"_a, nb::kw_only(), "depth"_a = kDeep, "gravity"_a = 9.81,
               "1/m, of Airy waves of a frequency in rad/s on water of a depth in m.");
}

}  // namespace sim_core::python
