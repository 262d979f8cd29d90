// SPDX-License-Identifier: Apache-2.0
// Laws of the length of line that is off the drum of a winch.
#pragma once

#include <string>

#include "curve.hpp"

namespace sim_core {

/// Unstretched length that is out, m, and its rate, m/s.
struct PayoutSample {
    double length;
    double rate;
};

/// A law of the length that is out. Evaluated inside the step, like a Motion.
class Payout {
  public:
    virtual ~Payout() = default;
    virtual PayoutSample at(double time) const = 0;
};

/// From one length to another at a constant rate, into which and out of which the winch goes smoothly within
/// `ramp_time` (see ramp()).
class SteadyPayout : public Payout {
  public:
    /// `rate` (m/s) is its size, whichever way. Throws InvalidInput unless it is above 0 and lengths and times are
    /// possible.
    SteadyPayout(double start_length, double end_length, double rate, double start_time, double ramp_time);
    PayoutSample at(double time) const override;

  private:
    double start_length_;
    double rate_;  ///< negative when hauling in
    double start_time_;
    double duration_;
    double ramp_time_;
};

/// A smooth curve through samples of time (s) and length (m); at rest before and after them.
class PayoutSeries : public Payout {
  public:
    explicit PayoutSeries(const Table& samples) : curve_(Curve::level_beyond(samples, "payout series")) {}
    PayoutSample at(double time) const override {
        const Curve::Value value = curve_.at(time);
        return {value.value, value.slope};
    }

  private:
    Curve curve_;
};

}  // namespace sim_core
