// SPDX-License-Identifier: Apache-2.0
#include "state.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "error.hpp"
#include "rotation.hpp"

namespace sim_core {

namespace {

constexpr std::uint64_t kFormat = 0x336d697377746f74ULL;  // "totwsim3"

/// FNV-1a (Fowler, Noll & Vo), 64 bits: any one damaged byte changes it.
std::uint64_t checksum(const char* bytes, std::size_t size) {
    std::uint64_t sum = 0xcbf29ce484222325ULL;
    for (std::size_t i = 0; i < size; ++i) {
        sum ^= static_cast<unsigned char>(bytes[i]);
        sum *= 0x100000001b3ULL;
    }
    return sum;
}

template <class Visit>
void visit_numbers(State& state, Visit visit) {
    visit(&state.time, 1);
    visit(&state.last_step, 1);
    visit(&state.next_step, 1);
    visit(&state.error_ratio, 1);
    for (auto* array : {&state.position, &state.velocity, &state.acceleration, &state.auxiliary}) {
        for (Vec3& value : *array) visit(value.data(), 3);
    }
    for (WinchState& winch : state.winches) {
        for (double* number : {&winch.paid_out, &winch.rate, &winch.excess, &winch.excess_at}) visit(number, 1);
    }
    for (State::BodyState& body : state.bodies) {
        visit(body.attitude.coeffs().data(), 4);
        visit(body.step_start_attitude.coeffs().data(), 4);
    }
}

void require_finite(const Vec3& position, const Vec3& velocity, const std::string& name) {
    if (!position.allFinite() || !velocity.allFinite()) {
        throw InvalidInput("'" + name + "': position and velocity must be finite");
    }
}

void require_possible(bool holds, const std::string& what) {
    if (!holds) throw InvalidInput("the saved state is damaged: " + what);
}

/// What a winch's drum holds must fit its line, or the changing segment has no length.
void require_possible(const WinchState& state, const Winch& winch, const std::string& line) {
    constexpr double kRounding = 1e-9;
    const std::string where = "of the winch of line '" + line + "'";
    require_possible(state.drum >= 0 && state.drum < winch.segments, "segments on the drum " + where);
    require_possible(state.paid_out >= winch.shortest() * (1.0 - kRounding) &&
                         state.paid_out <= winch.longest() * (1.0 + kRounding),
                     "length out " + where);
    // ½ to 1½ segments, and what the last node taken in has left
    const double changing = state.changing_length(winch) / winch.segment_length;
    require_possible(changing > 0.25 && changing < 2.0, "length of the segment at the drum " + where);
}

void require_possible(State& state) {
    bool finite = true;
    visit_numbers(state, [&](const double* numbers, int count) {
        finite = finite && std::all_of(numbers, numbers + count, [](double x) { return std::isfinite(x); });
    });
    require_possible(finite, "a number is not finite");
    require_possible(state.last_step >= 0.0 && state.next_step >= 0.0 && state.error_ratio >= 0.0,
                     "a step is below 0");
    for (std::size_t i = 0; i < state.winches.size(); ++i) {
        const Winch& winch = state.model->winches[i];
        require_possible(state.winches[i], winch, state.model->lines[winch.line].name);
    }
    constexpr double kUnit = 1e-6;  // quaternions are kept to rounding
    for (std::size_t b = 0; b < state.bodies.size(); ++b) {
        const State::BodyState& body = state.bodies[b];
        const std::string where = " of body '" + state.model->bodies[b].name + "'";
        require_possible(std::abs(body.attitude.norm() - 1.0) < kUnit &&
                             (body.attitude.coeffs() - body.step_start_attitude.coeffs()).norm() < kUnit,
                         "attitude" + where);
        require_possible(state.position[state.body_entry(static_cast<int>(b)) + 1].isZero(0.0), "turn" + where);
    }
}

}  // namespace

State::State(std::shared_ptr<const Model> m)
    : model(std::move(m)),
      position(model->sites() + 2 * model->bodies.size(), Vec3::Zero()),
      velocity(position),
      acceleration(position),
      auxiliary(position),
      bodies(model->bodies.size()),
      winches(model->winches.size()) {
    for (std::size_t i = 0; i < winches.size(); ++i) {
        winches[i].paid_out = model->winches[i].initial;
        winches[i].drum = model->winches[i].drum_segments(winches[i].paid_out);
    }
    follow_bodies();
}

void State::follow_bodies() {
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const int entry = body_entry(static_cast<int>(b));
        bodies[b].attitude = bodies[b].step_start_attitude * rotation_from_vector(position[entry + 1]);
    }
    const int first = model->first_attached_site();
    for (std::size_t i = 0; i < model->attachments.size(); ++i) {
        const Model::Attachment& attachment = model->attachments[i];
        const int entry = body_entry(attachment.body);
        const Quat& attitude = bodies[attachment.body].attitude;
        const Vec3& omega = velocity[entry + 1];
        const Vec3& r = attachment.place;
        const Vec3 spin = omega.cross(r);
        position[first + i] = position[entry] + attitude * r;
        velocity[first + i] = velocity[entry] + attitude * spin;
        acceleration[first + i] =
            acceleration[entry] + attitude * Vec3(acceleration[entry + 1].cross(r) + omega.cross(spin));
    }
}

void State::follow_drums() {
    for (std::size_t i = 0; i < winches.size(); ++i) {
        const std::vector<int>& sites = model->lines[model->winches[i].line].sites;
        for (auto* array : {&position, &velocity, &acceleration, &auxiliary}) {
            for (int node = 1; node <= winches[i].drum; ++node) (*array)[sites[node]] = (*array)[sites[0]];
        }
    }
}

bool State::wind(int index) {
    const Winch& winch = model->winches[index];
    WinchState& state = winches[index];
    const std::vector<int>& sites = model->lines[winch.line].sites;
    const int top = sites[0];
    const double length = state.changing_length(winch);
    const double whole = winch.segment_length;
    if (state.drum > 0 && length >= 1.5 * whole) {
        const int node = sites[state.drum];
        const int next = sites[state.drum + 1];
        const double up = whole / length;  // of the way from the next node to the top
        const Vec3 span = position[next] - position[top];
        position[node] = position[next] - up * span;
        velocity[node] = velocity[next] + up * (velocity[top] + (state.rate / length) * span - velocity[next]);
        --state.drum;
        return true;
    }
    if (state.drum + 1 < winch.segments && length < 0.5 * whole) {
        const Vec3& node = position[sites[state.drum + 1]];
        const Vec3& next = position[sites[state.drum + 2]];
        const double polygon = (node - position[top]).norm() + (next - node).norm();
        const double chord = (next - position[top]).norm();
        ++state.drum;
        state.excess = 0.0;
        const double nominal = state.changing_length(winch);
        state.excess = (length + whole) * chord / polygon - nominal;
        state.excess_at = state.paid_out;
        follow_drums();
        return true;
    }
    return false;
}

bool State::moves_freely(int site) const {
    if (!model->is_free(site) && !model->is_attached(site)) return false;
    for (std::size_t i = 0; i < winches.size(); ++i) {
        const std::vector<int>& sites = model->lines[model->winches[i].line].sites;
        const auto end = sites.begin() + 1 + winches[i].drum;
        if (std::find(sites.begin() + 1, end, site) != end) return false;
    }
    return true;
}

double State::segment_length(int segment) const {
    for (std::size_t i = 0; i < winches.size(); ++i) {
        const int place = segment - model->winches[i].first_segment;
        if (place < 0 || place > winches[i].drum) continue;
        return place < winches[i].drum ? 0.0 : winches[i].changing_length(model->winches[i]);
    }
    return model->segment_constants[model->segments[segment].constants].length;
}

double State::line_length(int line) const {
    double length = 0.0;
    const int first = model->lines[line].first_segment;
    for (int i = 0; i < model->lines[line].segments; ++i) length += segment_length(first + i);
    return length;
}

void State::rebase_attitudes() {
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        bodies[b].attitude.normalize();
        bodies[b].step_start_attitude = bodies[b].attitude;
        position[body_entry(static_cast<int>(b)) + 1].setZero();
    }
}

bool State::finite() const {
    double sum = 0.0;
    for (std::size_t i = 0; i < position.size(); ++i) {
        sum += position[i].sum() + velocity[i].sum() + acceleration[i].sum();
    }
    return std::isfinite(sum);
}

void State::set_time(double new_time) {
    if (!std::isfinite(new_time)) throw InvalidInput("the time must be finite");
    time = new_time;
    accelerations_known = false;
}

void State::set_point(const std::string& name, const Vec3& new_position, const Vec3& new_velocity) {
    require_finite(new_position, new_velocity, name);
    const int site = model->points[model->point_index(name)].site;
    position[site] = new_position;
    velocity[site] = new_velocity;
    accelerations_known = false;
    follow_drums();
}

void State::set_body(const std::string& name, const Vec3& new_position, const Quat& attitude,
                     const Vec3& new_velocity, const Vec3& angular_velocity) {
    require_finite(new_position, new_velocity, name);
    if (!angular_velocity.allFinite() || !(attitude.norm() > 1e-6) || !std::isfinite(attitude.norm())) {
        throw InvalidInput("'" + name + "': the quaternion must not be zero, the angular velocity must be finite");
    }
    const int body = model->body_index(name);
    const int entry = body_entry(body);
    position[entry] = new_position;
    velocity[entry] = new_velocity;
    position[entry + 1].setZero();
    velocity[entry + 1] = angular_velocity;
    bodies[body].step_start_attitude = attitude.normalized();
    accelerations_known = false;
    follow_bodies();
}

void State::set_line_node(const std::string& name, int node, const Vec3& new_position, const Vec3& new_velocity) {
    require_finite(new_position, new_velocity, name);
    const Model::Line& line = model->lines[model->line_index(name)];
    if (node < 1 || node >= line.segments) {
        throw InvalidInput("line '" + name + "': inner nodes are 1 to " + std::to_string(line.segments - 1));
    }
    position[line.sites[node]] = new_position;
    velocity[line.sites[node]] = new_velocity;
    accelerations_known = false;
}

std::string State::save() const {
    std::string bytes;
    const auto append = [&bytes](const void* data, std::size_t size) {
        bytes.append(static_cast<const char*>(data), size);
    };
    append(&kFormat, sizeof kFormat);
    append(&model->fingerprint, sizeof model->fingerprint);
    const std::uint64_t known = accelerations_known ? 1 : 0;
    append(&known, sizeof known);
    const std::uint64_t damped = static_cast<std::uint64_t>(damped_steps);
    append(&damped, sizeof damped);
    for (const WinchState& winch : winches) {
        const std::uint64_t drum = static_cast<std::uint64_t>(winch.drum);
        append(&drum, sizeof drum);
    }
    State copy = *this;
    visit_numbers(copy, [&](double* numbers, int count) { append(numbers, count * sizeof(double)); });
    const std::uint64_t sum = checksum(bytes.data(), bytes.size());
    append(&sum, sizeof sum);
    return bytes;
}

void State::restore(const std::string& bytes) {
    std::size_t read = 0;
    const auto take = [&](void* data, std::size_t size) {
        if (bytes.size() - read < size) throw InvalidInput("the saved state is cut short");
        std::memcpy(data, bytes.data() + read, size);
        read += size;
    };
    std::uint64_t format = 0;
    std::uint64_t fingerprint = 0;
    std::uint64_t known = 0;
    std::uint64_t damped = 0;
    take(&format, sizeof format);
    if (format != kFormat) throw InvalidInput("the bytes are not a saved state of this version");
    take(&fingerprint, sizeof fingerprint);
    if (fingerprint != model->fingerprint) throw InvalidInput("the saved state belongs to another model");
    take(&known, sizeof known);
    take(&damped, sizeof damped);
    require_possible(known <= 1 && damped <= kMostDampedSteps, "a mark is out of its range");
    State restored(model);
    restored.accelerations_known = known == 1;
    restored.damped_steps = static_cast<int>(damped);
    for (std::size_t i = 0; i < winches.size(); ++i) {
        std::uint64_t drum = 0;
        take(&drum, sizeof drum);
        const auto segments = static_cast<std::uint64_t>(model->winches[i].segments);
        restored.winches[i].drum = static_cast<int>(std::min(drum, segments));  // which is one too many
    }
    visit_numbers(restored, [&](double* numbers, int count) { take(numbers, count * sizeof(double)); });
    const std::uint64_t expected = checksum(bytes.data(), read);
    std::uint64_t sum = 0;
    take(&sum, sizeof sum);
    if (read != bytes.size()) throw InvalidInput("the saved state has bytes too many");
    require_possible(sum == expected, "its checksum is wrong");
    require_possible(restored);
    *this = std::move(restored);
}

}  // namespace sim_core
