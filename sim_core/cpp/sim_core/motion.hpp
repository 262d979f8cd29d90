// SPDX-License-Identifier: Apache-2.0
// Laws of motion for prescribed points (tow points): what they have in common. Each family has a file.
#pragma once

#include <initializer_list>
#include <memory>
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

/// Several motions at once: the sum of their positions, velocities and accelerations. One says where the point is, the
/// others what comes on top (heave on a turn).
class MotionSum : public Motion {
  public:
    explicit MotionSum(std::vector<std::shared_ptr<const Motion>> parts);
    MotionSample at(double time) const override;

  private:
    std::vector<std::shared_ptr<const Motion>> parts_;
};

/// Throws InvalidInput naming the law unless all values are finite.
void require_finite(const char* law, std::initializer_list<double> values);

/// Throws InvalidInput saying `what` unless it holds.
void require_law(bool holds, const char* what);

}  // namespace sim_core
