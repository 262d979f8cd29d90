// SPDX-License-Identifier: Apache-2.0
#include "ship_response.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "error.hpp"

namespace sim_core {

namespace {

using Complex = std::complex<double>;

constexpr double kTwoPi = 2.0 * std::numbers::pi;

bool increasing(const std::vector<double>& values) {
    return std::adjacent_find(values.begin(), values.end(), [](double a, double b) { return !(a < b); }) == values.end();
}

/// Between which two values `x` lies, and how far from the first (0 … 1).
std::pair<std::size_t, double> bracket(const std::vector<double>& values, double x) {
    if (values.size() == 1) return {0, 0.0};
    const auto after = std::upper_bound(values.begin() + 1, values.end() - 1, x) - values.begin();
    const std::size_t i = static_cast<std::size_t>(after) - 1;
    return {i, (x - values[i]) / (values[i + 1] - values[i])};
}

bool within(const std::vector<double>& values, double x) {
    constexpr double kRounding = 1e-9;
    return x >= values.front() - kRounding && x <= values.back() + kRounding;
}

}  // namespace

ResponseOperators::ResponseOperators(std::vector<double> frequency, std::vector<double> heading,
                                     std::array<std::vector<double>, 6> amplitude,
                                     const std::array<std::vector<double>, 6>& phase)
    : frequency_(std::move(frequency)), heading_(std::move(heading)) {
    require_law(!frequency_.empty() && !heading_.empty() && increasing(frequency_) && increasing(heading_),
            "response operators: frequencies and headings must increase");
    for (int motion = 0; motion < 6; ++motion) {
        require_law(amplitude[motion].size() == frequency_.size() * heading_.size() &&
                    phase[motion].size() == amplitude[motion].size(),
                "response operators: each motion needs an amplitude and a phase for every heading and frequency");
        for (std::size_t i = 0; i < amplitude[motion].size(); ++i) {
            require_law(amplitude[motion][i] >= 0.0 && std::isfinite(amplitude[motion][i]) &&
                        std::isfinite(phase[motion][i]),
                    "response operators: amplitudes must not be below 0, phases must be finite");
            value_[motion].push_back(std::polar(amplitude[motion][i], phase[motion][i]));
        }
    }
}

std::array<Complex, 6> ResponseOperators::at(double frequency, double heading) const {
    if (!within(frequency_, frequency)) {
        throw InvalidInput("response operators: a wave of " + std::to_string(frequency) +
                           " rad/s lies outside of the table");
    }
    bool mirrored = false;
    if (heading_.size() == 1) {
        heading = heading_.front();
    } else if (const double turned = heading - kTwoPi * std::floor((heading - heading_.front() + 1e-9) / kTwoPi);
               within(heading_, turned)) {
        heading = turned;
    } else {
        heading = -heading;
        heading -= kTwoPi * std::floor((heading - heading_.front() + 1e-9) / kTwoPi);
        mirrored = true;
        if (!within(heading_, heading)) {
            throw InvalidInput("response operators: a wave at a heading of " + std::to_string(-heading) +
                               " rad lies outside of the table");
        }
    }
    const auto [f, along] = bracket(frequency_, frequency);
    const auto [h, across] = bracket(heading_, heading);
    const std::size_t columns = frequency_.size();
    std::array<Complex, 6> result;
    for (int motion = 0; motion < 6; ++motion) {
        const auto row = [&, f = f, along = along](std::size_t i) {
            const Complex* values = &value_[motion][i * columns];
            return along == 0.0 ? values[f] : (1.0 - along) * values[f] + along * values[f + 1];
        };
        result[motion] = across == 0.0 ? row(h) : (1.0 - across) * row(h) + across * row(h + 1);
    }
    if (mirrored) {  // a ship is symmetric: what comes from the other side moves it the other way
        for (const int motion : {1, 3, 5}) result[motion] = -result[motion];
    }
    return result;
}

ShipInSea::ShipInSea(const Vec3& position, const Vec3& velocity, const Sea& sea, const ResponseOperators& operators,
                     const Vec3& arm, double run_up_time)
    : tow_(position, velocity, run_up_time), start_(position), ramp_time_(sea.ramp_time()) {
    require_law(velocity.z() == 0.0, "ship in a sea: the velocity must be level");
    require_finite("ship in a sea", {arm.sum()});
    const double course = velocity.norm() > 0.0 ? std::atan2(velocity.y(), velocity.x()) : 0.0;
    const Mat3 to_tank = Eigen::AngleAxisd(course, Vec3::UnitZ()).toRotationMatrix();
    const Vec3 reference = position - to_tank * arm;
    for (const WaveTrain& wave : sea.trains()) {
        const std::array<Complex, 6> q = operators.at(wave.frequency, wave.direction - course);
        const auto displacement = [&](auto part) {
            const Vec3 shift(part(q[0]), part(q[1]), part(q[2]));
            const Vec3 turn(part(q[3]), part(q[4]), part(q[5]));
            return Vec3(wave.amplitude * (to_tank * (shift + turn.cross(arm))));
        };
        const Vec3 k = wave.wave_number * Vec3(std::cos(wave.direction), std::sin(wave.direction), 0.0);
        // The elevation is the real part of exp(i (k·x − ω t + ε)), in which leading in time is the conjugate.
        trains_.push_back({k, wave.frequency, k.dot(reference) + wave.phase,
                           displacement([](const Complex& c) { return c.real(); }),
                           displacement([](const Complex& c) { return -c.imag(); })});
    }
}

MotionSample ShipInSea::at(double time) const {
    MotionSample sample = tow_.at(time);
    const Vec3 travelled = sample.position - start_;
    MotionSample waves;
    for (const Train& train : trains_) {
        const double psi = train.wave_vector.dot(travelled) - train.frequency * time + train.phase;
        const double rate = train.wave_vector.dot(sample.velocity) - train.frequency;
        const double rate2 = train.wave_vector.dot(sample.acceleration);
        const double cosine = std::cos(psi), sine = std::sin(psi);
        const Vec3 value = cosine * train.real - sine * train.imag;
        const Vec3 slope = -sine * train.real - cosine * train.imag;  // with respect to ψ
        waves.position += value;
        waves.velocity += rate * slope;
        waves.acceleration += rate2 * slope - rate * rate * value;
    }
    const Ramp r = ramp(time, ramp_time_);
    sample.position += r.value * waves.position;
    sample.velocity += r.rate * waves.position + r.value * waves.velocity;
    sample.acceleration += r.rate2 * waves.position + 2.0 * r.rate * waves.velocity + r.value * waves.acceleration;
    return sample;
}

}  // namespace sim_core
