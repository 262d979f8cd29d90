// SPDX-License-Identifier: Apache-2.0
// Motion through samples.
#pragma once

#include <vector>

#include "motion.hpp"

namespace sim_core {

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
