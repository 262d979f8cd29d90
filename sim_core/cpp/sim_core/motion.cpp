// SPDX-License-Identifier: Apache-2.0
#include "motion.hpp"

#include <cmath>
#include <string>

#include "error.hpp"

namespace sim_core {

void require_finite(const char* law, std::initializer_list<double> values) {
    for (const double value : values) {
        if (!std::isfinite(value)) throw InvalidInput(std::string(law) + ": all values must be finite");
    }
}

void require_law(bool holds, const char* what) {
    if (!holds) throw InvalidInput(what);
}

Ramp ramp(double time, double duration) {
    if (duration == 0.0 || time >= duration) return {1.0, 0.0, 0.0, time - 0.5 * duration};
    if (time <= 0.0) return {0.0, 0.0, 0.0, 0.0};
    const double s = time / duration;
    const double s2 = s * s;
    return {s2 * s * (10.0 - 15.0 * s + 6.0 * s2), 30.0 * s2 * (1.0 - s) * (1.0 - s) / duration,
            60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / (duration * duration),
            duration * s2 * s2 * (2.5 - 3.0 * s + s2)};
}

MotionSum::MotionSum(std::vector<std::shared_ptr<const Motion>> parts) : parts_(std::move(parts)) {
    require_law(!parts_.empty(), "a sum of motions needs at least one");
}

MotionSample MotionSum::at(double time) const {
    MotionSample sum;
    for (const auto& part : parts_) {
        const MotionSample sample = part->at(time);
        sum.position += sample.position;
        sum.velocity += sample.velocity;
        sum.acceleration += sample.acceleration;
    }
    return sum;
}

}  // namespace sim_core
