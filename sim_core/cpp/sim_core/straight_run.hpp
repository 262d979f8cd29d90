// SPDX-License-Identifier: Apache-2.0
// Straight tows.
#pragma once

#include "motion.hpp"

namespace sim_core {

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

/// A straight tow that ends in a stop: from `stop_time` on the ship slows down to rest within `stopping_time`, along the
/// same smooth law as a start, over half the distance that it would go at speed. Both in s; a stopping time of 0 is the
/// ship that is suddenly held.
class EmergencyStop : public Motion {
  public:
    EmergencyStop(const Vec3& position, const Vec3& velocity, double stop_time, double stopping_time,
                  double run_up_time);
    MotionSample at(double time) const override;

  private:
    SteadyTow tow_;
    Vec3 velocity_;
    double stop_time_;
    double stopping_time_;
};

}  // namespace sim_core
