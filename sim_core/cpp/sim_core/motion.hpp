// SPDX-License-Identifier: Apache-2.0
// Laws of motion for prescribed points (tow points).
#pragma once

#include <vector>

#include "types.hpp"

namespace sim_core {

/// Position, velocity and acceleration of a prescribed point in tank axes.
struct MotionSample {
    Vec3 position = Vec3::Zero();      ///< m
    Vec3 velocity = Vec3::Zero();      ///< m/s
    Vec3 acceleration = Vec3::Zero();  ///< m/s²
};

/// A law of motion. Evaluated inside the step, at the instants that the integrator asks for.
class Motion {
  public:
    virtual ~Motion() = default;
    virtual MotionSample at(double time) const = 0;
};

/// A smooth start: the rate rises from 0 to 1 within `duration` (s) as 10s³ − 15s⁴ + 6s⁵, without a jump in
/// acceleration. A duration of 0 means full rate from the start.
struct Ramp {
    double value;     ///< rate, 0 … 1
    double rate;      ///< its derivative, 1/s
    double rate2;     ///< its second derivative, 1/s²
    double integral;  ///< elapsed "ramped" time, s: time − duration/2 after the ramp
};
Ramp ramp(double time, double duration);

/// Straight tow at constant velocity from `position` at time 0, after a run-up from rest if `run_up_time` > 0.
class SteadyTow : public Motion {
  public:
    SteadyTow(const Vec3& position, const Vec3& velocity, double run_up_time);
    MotionSample at(double time) const override;

  private:
    Vec3 position_;
    Vec3 velocity_;
    double run_up_time_;
};

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

/// Cubic Hermite interpolation of samples of position and velocity; constant velocity outside them.
class TimeSeries : public Motion {
  public:
    /// Throws InvalidInput unless times increase and all three have the same length.
    TimeSeries(std::vector<double> time, std::vector<Vec3> position, std::vector<Vec3> velocity);
    MotionSample at(double time) const override;

  private:
    std::vector<double> time_;
    std::vector<Vec3> position_;
    std::vector<Vec3> velocity_;
};

/// One cubic between two samples of position and velocity.
class HermiteSegment : public Motion {
  public:
    HermiteSegment(double start_time, const Vec3& start_position, const Vec3& start_velocity, double end_time,
                   const Vec3& end_position, const Vec3& end_velocity);
    MotionSample at(double time) const override;

  private:
    double start_time_;
    double duration_;
    Vec3 position_[2];
    Vec3 velocity_[2];
};

}  // namespace sim_core
