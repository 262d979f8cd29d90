// SPDX-License-Identifier: Apache-2.0
#include "time_series.hpp"

#include <algorithm>
#include <utility>

namespace sim_core {

TimeSeries::TimeSeries(std::vector<double> time, std::vector<Vec3> position, std::vector<Vec3> velocity)
    : time_(std::move(time)), position_(std::move(position)), velocity_(std::move(velocity)) {
    require_law(time_.size() >= 2, "time series: at least two samples are needed");
    require_law(position_.size() == time_.size() && velocity_.size() == time_.size(),
            "time series: time, position and velocity must have the same length");
    for (std::size_t i = 0; i < time_.size(); ++i) {
        require_law(std::isfinite(time_[i]) && position_[i].allFinite() && velocity_[i].allFinite(),
                "time series: all values must be finite");
        require_law(i == 0 || time_[i] > time_[i - 1], "time series: times must increase");
    }
}

MotionSample TimeSeries::at(double time) const {
    if (time <= time_.front()) {
        return {position_.front() + (time - time_.front()) * velocity_.front(), velocity_.front(), Vec3::Zero()};
    }
    if (time >= time_.back()) {
        return {position_.back() + (time - time_.back()) * velocity_.back(), velocity_.back(), Vec3::Zero()};
    }
    const auto after = std::upper_bound(time_.begin(), time_.end(), time) - time_.begin();
    return HermiteSegment(time_[after - 1], position_[after - 1], velocity_[after - 1], time_[after],
                          position_[after], velocity_[after])
        .at(time);
}

HermiteSegment::HermiteSegment(double start_time, const Vec3& start_position, const Vec3& start_velocity,
                               double end_time, const Vec3& end_position, const Vec3& end_velocity)
    : start_time_(start_time),
      duration_(end_time - start_time),
      position_{start_position, end_position},
      velocity_{start_velocity, end_velocity} {}

MotionSample HermiteSegment::at(double time) const {
    const double s = (time - start_time_) / duration_;
    const Vec3 chord = position_[1] - position_[0];
    const Vec3 d0 = duration_ * velocity_[0];
    const Vec3 d1 = duration_ * velocity_[1];
    // p(s) = p0 + d0 s + c2 s² + c3 s³
    const Vec3 c2 = 3.0 * chord - 2.0 * d0 - d1;
    const Vec3 c3 = d0 + d1 - 2.0 * chord;
    // Exactly the given end point at the end, so that successive cubics join without rounding.
    const Vec3 position = s == 1.0 ? position_[1] : Vec3(position_[0] + s * (d0 + s * (c2 + s * c3)));
    const Vec3 velocity = s == 1.0 ? velocity_[1] : Vec3((d0 + s * (2.0 * c2 + 3.0 * s * c3)) / duration_);
    return {position, velocity, (2.0 * c2 + 6.0 * s * c3) / (duration_ * duration_)};
}

}  // namespace sim_core
