// SPDX-License-Identifier: Apache-2.0
// Heave on a straight tow.
#pragma once

#include "straight_run.hpp"

namespace sim_core {

/// Straight tow with a heave A sin(2π t / T + phase) that fades in over `ramp_time`.
class Sinusoid : public Motion {
  public:
    Sinusoid(const Vec3& mean, const Vec3& velocity, double amplitude, double period, double phase,
             double ramp_time, double run_up_time);
    MotionSample at(double time) const override;

  private:
    SteadyTow tow_;
    double amplitude_;
    double rate_;
    double phase_;
    double ramp_time_;
};

/// Straight tow with the heave of a slider crank: −r cos θ + l (1 − √(1 − (r/l)² sin²θ)), θ the crank angle.
/// The crank speeds up from rest within `ramp_time`, starting at θ = phase.
class SliderCrank : public Motion {
  public:
    SliderCrank(const Vec3& mean, const Vec3& velocity, double crank_radius, double rod_length, double period,
                double phase, double ramp_time, double run_up_time);
    MotionSample at(double time) const override;

  private:
    SteadyTow tow_;
    double crank_radius_;
    double rod_length_;
    double rate_;
    double phase_;
    double ramp_time_;
};

}  // namespace sim_core
