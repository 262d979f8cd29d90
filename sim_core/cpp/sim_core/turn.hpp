// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "straight_run.hpp"

namespace sim_core {

/// Straight, turn, straight: a ship at constant speed whose rate of turn rises to its full value within `entry_time` (s)
/// along the smooth law of `ramp`, stays, and falls again alike, so that the acceleration is continuous. The track is a
/// circle between two curves whose curvature grows with the distance (easements).
class Turn : public Motion {
  public:
    /// `position` (m) and the level `velocity` (m/s) as in SteadyTow; the turn begins at `start_time` (s) and changes the
    /// heading by `angle` (rad; positive to port, beyond 2π for several circles) on the radius `radius` (m).
    /// Throws InvalidInput if the turn is over before its full rate is reached.
    Turn(const Vec3& position, const Vec3& velocity, double start_time, double radius, double angle, double entry_time,
         double run_up_time);
    MotionSample at(double time) const override;

  private:
    /// Heading changed since the start of the turn (rad), its rate and the rate's rate, `time` s into the turn.
    struct Heading {
        double angle, rate, acceleration;
    };
    Heading heading(double time) const;
    Vec3 entry_displacement(double time) const;
    /// Where the ship has got to `time` s into the turn, in axes of the initial course.
    Vec3 displacement(double time) const;

    SteadyTow tow_;
    double start_time_;
    double speed_;
    double rate_;        ///< of turn, rad/s
    double angle_;
    double entry_time_;
    double rise_;        ///< s from the start of the entry to the start of the exit
    Vec3 ahead_, abeam_; ///< unit vectors of the initial course
    Vec3 start_, entry_end_, exit_start_, exit_end_; ///< start in tank axes, the others displacements from it
};

}  // namespace sim_core
