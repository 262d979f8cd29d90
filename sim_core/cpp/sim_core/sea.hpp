// SPDX-License-Identifier: Apache-2.0
// The waves of a sea as a sum of long-crested trains: what acts in the water and what moves a ship is the same sea.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

namespace sim_core {

/// A long-crested train of Airy waves: ζ = a cos(k (x cos β + y sin β) − ω t + ε).
struct WaveTrain {
    double amplitude;    ///< a, m
    double frequency;    ///< ω, rad/s
    double direction;    ///< β, rad: towards which it travels, from +x to +y
    double phase;        ///< ε, rad
    double wave_number;  ///< k, 1/m: ω² = g k tanh(k d)
};

/// The wave number (1/m) of Airy waves of a frequency (rad/s): ω² = g k tanh(k d), to rounding. The depth d (m) may be
/// infinite.
double wave_number(double frequency, double depth, double gravity);

/// A train as its owner gives it; the wave number follows.
struct WaveComponent {
    double amplitude;  ///< m
    double frequency;  ///< rad/s
    double direction;  ///< rad
    double phase;      ///< rad
};

/// A superposition of wave trains on water of constant depth.
class Sea {
  public:
    /// `depth` in m (may be infinite), `gravity` in m/s². The sea rises from calm within `ramp_time` (s) after time 0, by
    /// the factor of `ramp` (see motion.hpp); 0: it is there from the start. Throws InvalidInput.
    Sea(const std::vector<WaveComponent>& components, double depth, double gravity, double ramp_time);

    const std::vector<WaveTrain>& trains() const { return trains_; }
    double depth() const { return depth_; }
    double gravity() const { return gravity_; }
    double ramp_time() const { return ramp_time_; }

    /// Height of the surface above still water, m, at a place in tank axes.
    double elevation(double x, double y, double time) const;

  private:
    std::vector<WaveTrain> trains_;
    double depth_;
    double gravity_;
    double ramp_time_;
};

/// One regular train of the given height (trough to crest, m) and period (s).
Sea regular_waves(double height, double period, double direction, double phase, double depth, double gravity,
                  double ramp_time);

struct Jonswap {
    double significant_height;  ///< Hs, m: 4 times the standard deviation of the elevation
    double peak_period;         ///< Tp, s
    double gamma = 3.3;         ///< peak enhancement, 1 (Pierson–Moskowitz) … 7
    double direction = 0.0;     ///< main direction, rad
    /// Exponent n of the spreading cosⁿ(β − direction) within ±90°; none: long-crested.
    std::optional<double> spreading;
    int components = 200;
    std::uint64_t seed = 0;
    /// rad/s, from and to; by default 0.5 and 5 times the peak frequency.
    std::optional<std::pair<double, double>> frequency_range;
};

/// An irregular sea with the spectrum of JONSWAP (Hasselmann et al. 1973; DNV-RP-C205, 3.5.5).
///
/// Amplitudes are fixed, phases random (uniform). The range of frequencies is cut into pieces of equal energy, each
/// a train at the frequency that halves its energy. So all amplitudes are alike, Σ a²/2 is Hs²/16 exactly (the
/// spectrum is scaled to it over the range), and the unequal spacing keeps the sea from repeating. Directions are
/// drawn from the spreading, one for each train, which keeps the sea the same in the mean everywhere
/// (Jefferys 1987, Appl. Ocean Res. 9, 190–197). The same seed gives the same sea on every machine.
Sea jonswap_sea(const Jonswap& spectrum, double depth, double gravity, double ramp_time);

}  // namespace sim_core
