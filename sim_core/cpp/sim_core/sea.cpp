// SPDX-License-Identifier: Apache-2.0
#include "sea.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "error.hpp"
#include "motion.hpp"

namespace sim_core {

namespace {

constexpr double kPi = std::numbers::pi;

void require_sea(bool holds, const char* what) {
    if (!holds) throw InvalidInput(std::string("sea: ") + what);
}

bool positive(double value) { return value > 0.0 && std::isfinite(value); }

/// A table of the integral of a density, and its inverse. Trapezoidal rule on an even grid.
class Distribution {
  public:
    template <class Density>
    Distribution(double from, double to, Density density) : from_(from), step_((to - from) / kPieces) {
        integral_.push_back(0.0);
        for (int i = 0; i < kPieces; ++i) {
            integral_.push_back(integral_.back() + density(from + i * step_) + density(from + (i + 1) * step_));
        }
    }

    /// Where a share of the whole (0 … 1) lies below.
    double at_share(double share) const {
        const double wanted = share * integral_.back();
        const auto above = std::upper_bound(integral_.begin() + 1, integral_.end() - 1, wanted);
        const double below = *(above - 1);
        const double fraction = *above > below ? (wanted - below) / (*above - below) : 0.0;
        return from_ + step_ * (static_cast<double>(above - integral_.begin() - 1) + fraction);
    }

  private:
    static constexpr int kPieces = 20000;
    double from_;
    double step_;
    std::vector<double> integral_;
};

}  // namespace

double wave_number(double frequency, double depth, double gravity) {
    const double deep = frequency * frequency / gravity;
    if (std::isinf(depth)) return deep;
    // x tanh x = y with x = k d by Newton's method, from Eckart's approximation (within 5 %)
    const double y = deep * depth;
    if (y > 40.0) return deep;  // tanh is 1 to rounding
    double x = y / std::sqrt(std::tanh(y));
    for (int i = 0; i < 8; ++i) {
        const double t = std::tanh(x);
        const double change = (x * t - y) / (t + x * (1.0 - t * t));
        x -= change;
        if (std::abs(change) <= 1e-16 * x) break;
    }
    return x / depth;
}

Sea::Sea(const std::vector<WaveComponent>& components, double depth, double gravity, double ramp_time)
    : depth_(depth), gravity_(gravity), ramp_time_(ramp_time) {
    require_sea(depth > 0.0, "depth must be above 0 m");
    require_sea(positive(gravity), "gravity must be above 0 m/s²");
    require_sea(ramp_time >= 0.0 && std::isfinite(ramp_time), "ramp_time must not be below 0 s");
    for (const WaveComponent& c : components) {
        require_sea(c.amplitude >= 0.0 && std::isfinite(c.amplitude), "amplitudes must not be below 0 m");
        require_sea(positive(c.frequency), "frequencies must be above 0 rad/s");
        require_sea(std::isfinite(c.direction) && std::isfinite(c.phase), "directions and phases must be finite");
        trains_.push_back(
            {c.amplitude, c.frequency, c.direction, c.phase, wave_number(c.frequency, depth, gravity)});
    }
}

double Sea::elevation(double x, double y, double time) const {
    double sum = 0.0;
    for (const WaveTrain& w : trains_) {
        const double along = x * std::cos(w.direction) + y * std::sin(w.direction);
        sum += w.amplitude * std::cos(w.wave_number * along - w.frequency * time + w.phase);
    }
    return ramp(time, ramp_time_).value * sum;
}

Sea regular_waves(double height, double period, double direction, double phase, double depth, double gravity,
                  double ramp_time) {
    require_sea(height >= 0.0 && std::isfinite(height), "height must not be below 0 m");
    require_sea(positive(period), "period must be above 0 s");
    return {{{0.5 * height, 2.0 * kPi / period, direction, phase}}, depth, gravity, ramp_time};
}

Sea jonswap_sea(const Jonswap& s, double depth, double gravity, double ramp_time) {
    require_sea(s.significant_height >= 0.0 && std::isfinite(s.significant_height),
            "significant_height must not be below 0 m");
    require_sea(positive(s.peak_period), "peak_period must be above 0 s");
    require_sea(s.gamma >= 1.0 && s.gamma <= 20.0, "gamma must lie between 1 and 20");
    require_sea(s.components >= 1, "components must be at least 1");
    require_sea(std::isfinite(s.direction), "direction must be finite");
    if (s.spreading) require_sea(*s.spreading >= 0.0 && std::isfinite(*s.spreading), "spreading must not be below 0");
    const double peak = 2.0 * kPi / s.peak_period;
    const auto [from, to] = s.frequency_range.value_or(std::pair(0.5 * peak, 5.0 * peak));
    require_sea(positive(from) && to > from && std::isfinite(to), "frequency_range must rise and lie above 0 rad/s");

    const Distribution energy(from, to, [&](double frequency) {
        const double r = frequency / peak;
        const double width = r <= 1.0 ? 0.07 : 0.09;
        const double off = (r - 1.0) / width;
        return std::pow(r, -5.0) * std::exp(-1.25 * std::pow(r, -4.0)) *
               std::pow(s.gamma, std::exp(-0.5 * off * off));
    });
    const Distribution directions(-0.5 * kPi, 0.5 * kPi,
                                  [&](double off) { return std::pow(std::cos(off), s.spreading.value_or(0.0)); });
    std::mt19937_64 generator(s.seed);
    // Not std::uniform_real_distribution, whose numbers are the library's choice
    const auto uniform = [&generator] { return static_cast<double>(generator() >> 11) * 0x1p-53; };
    std::vector<WaveComponent> components(static_cast<std::size_t>(s.components));
    for (int i = 0; i < s.components; ++i) {
        WaveComponent& c = components[static_cast<std::size_t>(i)];
        c.amplitude = 0.25 * s.significant_height * std::sqrt(2.0 / s.components);
        c.frequency = energy.at_share((i + 0.5) / s.components);
        c.phase = 2.0 * kPi * uniform();
        c.direction = s.direction + (s.spreading ? directions.at_share(uniform()) : 0.0);
    }
    return {components, depth, gravity, ramp_time};
}

}  // namespace sim_core
