// SPDX-License-Identifier: Apache-2.0
// The motion of a tow point on a ship in waves.
#pragma once

#include <array>
#include <complex>
#include <vector>

#include "sea.hpp"
#include "straight_run.hpp"

namespace sim_core {

/// Response amplitude operators of a ship at its speed: per metre of wave amplitude the amplitude of each of six motions,
/// and by how much it leads the elevation at the reference point.
///
/// Ship axes: x forward, y to port, z up; in order surge, sway, heave (m/m) along them, roll, pitch, yaw (rad/m) about
/// them by the right-hand rule (pitch is positive with the bow down). Heading is the direction in which the wave travels, seen from
/// the ship: 0 from astern, π/2 towards port, π from ahead.
class ResponseOperators {
  public:
    /// `frequency` (rad/s, of the wave in the tank's frame) and `heading` (rad) increase; `amplitude` and `phase` (rad) hold
    /// heading by heading for each motion: [motion][heading · frequencies + frequency]. With a single heading it holds for
    /// all. Throws InvalidInput.
    ResponseOperators(std::vector<double> frequency, std::vector<double> heading,
                      std::array<std::vector<double>, 6> amplitude, const std::array<std::vector<double>, 6>& phase);

    /// Complex operators amplitude · exp(i phase), interpolated linearly. A heading is turned by whole circles, and mirrored
    /// to the other side where the table has one side only. Throws InvalidInput outside of the table.
    std::array<std::complex<double>, 6> at(double frequency, double heading) const;

  private:
    std::vector<double> frequency_, heading_;
    std::array<std::vector<std::complex<double>>, 6> value_;
};

/// A tow point on a ship that runs straight through a sea: the motions of all wave trains added up. The ship meets each
/// train where it is, so the frequencies are those of encounter.
///
/// The tow point moves with the displacement and, for small angles, the rotation of the ship: (surge, sway, heave) +
/// (roll, pitch, yaw) × arm. The sea rises from calm within its ramp_time, and so does the motion.
class ShipInSea : public Motion {
  public:
    /// `position` (m) of the tow point at time 0 without waves, `velocity` (m/s, level; the ship points along it, along x at
    /// rest), `arm` (m, ship axes) from the reference point of the operators to the tow point. Throws InvalidInput if a train
    /// lies outside of the table.
    ShipInSea(const Vec3& position, const Vec3& velocity, const Sea& sea, const ResponseOperators& operators,
              const Vec3& arm, double run_up_time);
    MotionSample at(double time) const override;

  private:
    struct Train {
        Vec3 wave_vector;  ///< 1/m
        double frequency;  ///< rad/s
        double phase;      ///< of the wave where the reference point is at time 0, rad
        Vec3 real, imag;   ///< displacement real · cos ψ − imag · sin ψ, m, ψ the phase of the wave at the ship
    };

    SteadyTow tow_;
    Vec3 start_;
    std::vector<Train> trains_;
    double ramp_time_;
};

}  // namespace sim_core
