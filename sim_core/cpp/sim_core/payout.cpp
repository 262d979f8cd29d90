// SPDX-License-Identifier: Apache-2.0
#include "payout.hpp"

#include <cmath>

#include "error.hpp"
#include "motion.hpp"

namespace sim_core {

SteadyPayout::SteadyPayout(double start_length, double end_length, double rate, double start_time, double ramp_time)
    : start_length_(start_length),
      rate_(end_length < start_length ? -rate : rate),
      start_time_(start_time),
      duration_(std::abs(end_length - start_length) / rate),
      ramp_time_(ramp_time) {
    for (const double value : {start_length, end_length, rate, start_time, ramp_time}) {
        if (!std::isfinite(value)) throw InvalidInput("payout: all values must be finite");
    }
    if (!(rate > 0.0)) throw InvalidInput("payout: rate must be above 0 m/s, whichever way");
    if (!(start_length > 0.0 && end_length > 0.0)) throw InvalidInput("payout: lengths must be above 0 m");
    if (!(ramp_time >= 0.0)) throw InvalidInput("payout: ramp_time must not be below 0 s");
}

PayoutSample SteadyPayout::at(double time) const {
    const double elapsed = time - start_time_;
    if (elapsed <= 0.0) return {start_length_, 0.0};
    const Ramp up = ramp(elapsed, ramp_time_);
    Ramp down{0.0, 0.0, 0.0, 0.0};
    if (elapsed > duration_) down = ramp(elapsed - duration_, ramp_time_);
    return {start_length_ + rate_ * (up.integral - down.integral), rate_ * (up.value - down.value)};
}

}  // namespace sim_core
