// SPDX-License-Identifier: Apache-2.0
#include "straight_run.hpp"

namespace sim_core {

SteadyTow::SteadyTow(const Vec3& position, const Vec3& velocity, double run_up_time)
    : position_(position), velocity_(velocity), run_up_time_(run_up_time) {
    require_finite("tow", {position.sum(), velocity.sum(), run_up_time});
    require_law(run_up_time >= 0.0, "run_up_time must not be below 0 s");
}

MotionSample SteadyTow::at(double time) const {
    const Ramp r = ramp(time, run_up_time_);
    return {position_ + r.integral * velocity_, r.value * velocity_, r.rate * velocity_};
}

EmergencyStop::EmergencyStop(const Vec3& position, const Vec3& velocity, double stop_time, double stopping_time,
                             double run_up_time)
    : tow_(position, velocity, run_up_time), velocity_(velocity), stop_time_(stop_time), stopping_time_(stopping_time) {
    require_finite("emergency stop", {stop_time, stopping_time});
    require_law(stop_time >= run_up_time, "emergency stop: stop_time must not lie in the run-up");
    require_law(stopping_time >= 0.0, "emergency stop: stopping_time must not be below 0 s");
}

MotionSample EmergencyStop::at(double time) const {
    MotionSample sample = tow_.at(time);
    if (time < stop_time_) return sample;
    const Ramp r = ramp(time - stop_time_, stopping_time_);
    sample.position -= r.integral * velocity_;
    sample.velocity -= r.value * velocity_;
    sample.acceleration -= r.rate * velocity_;
    return sample;
}

}  // namespace sim_core
