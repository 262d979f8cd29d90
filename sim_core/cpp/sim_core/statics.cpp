// SPDX-License-Identifier: Apache-2.0
#include "statics.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <sstream>

#include "backward_euler.hpp"
#include "equations.hpp"
#include "error.hpp"
#include "newton.hpp"
#include "simulator.hpp"
#include "straight_run.hpp"

namespace sim_core {

namespace {

/// A first guess: every line straight and unstretched, in the direction of weight and drag of what hangs on it.
class FirstGuess {
  public:
    /// `lean` tilts every line aft by about that angle (rad).
    FirstGuess(State& state, const Vec3& velocity, double lean)
        : state_(state),
          model_(*state.model),
          flow_(model_.water.current.at(state.position[model_.free_sites].z(), 0.0) - velocity),
          lean_(lean),
          placed_(vertices(), false) {}

    void make() {
        const Vec3 ahead(-flow_.x(), -flow_.y(), 0.0);
        const double heading = ahead.norm() > 1e-9 ? std::atan2(ahead.y(), ahead.x()) : 0.0;
        astern_ = -Vec3(std::cos(heading), std::sin(heading), 0.0);
        for (State::BodyState& body : state_.bodies) {
            body.step_start_attitude = Quat(Eigen::AngleAxisd(heading, Vec3::UnitZ()));
        }
        order_lines();
        std::vector<Vec3> pull(vertices(), Vec3::Zero());
        for (const Model::Point& point : model_.points) pull[point.site] = load_of(point.properties);
        for (std::size_t b = 0; b < model_.bodies.size(); ++b) pull[model_.sites() + b] = load_of(b);
        for (auto hang = tree_.rbegin(); hang != tree_.rend(); ++hang) {
            hang->pull = pull[hang->bottom];
            if (hang->line >= 0) hang->pull += load_of(model_.lines[hang->line]);
            pull[hang->top] += hang->pull;
        }
        for (const Hang& hang : tree_) place(hang);
        state_.follow_bodies();
        for (const int line : loops_) place_between(model_.lines[line]);
    }

  private:
    /// A line or a joint of the spanning tree, from the end nearer to a prescribed point to the other.
    struct Hang {
        int line;       ///< −1: it is a joint
        int joint;      ///< −1: it is a line
        bool reversed;  ///< its own start is the lower end
        int top, bottom;
        Vec3 pull;
    };

    int vertices() const { return model_.sites() + static_cast<int>(model_.bodies.size()); }
    int vertex(int site) const {
        return model_.is_attached(site) ? model_.sites() + model_.attachments[model_.attachment_of(site)].body : site;
    }

    void order_lines() {
        std::deque<int> queue;
        for (int i = 0; i < model_.prescribed_sites; ++i) {
            placed_[model_.free_sites + i] = true;
            queue.push_back(model_.free_sites + i);
        }
        std::vector<bool> used(model_.lines.size(), false);
        const auto hang_up = [&](int line, int joint, bool reversed, int top, int bottom) {
            placed_[bottom] = true;
            tree_.push_back({line, joint, reversed, top, bottom, Vec3::Zero()});
            queue.push_back(bottom);
        };
        while (!queue.empty()) {
            const int top = queue.front();
            queue.pop_front();
            for (std::size_t i = 0; i < model_.joints.size(); ++i) {
                const int start = vertex(model_.joints[i].site[0]);
                const int end = vertex(model_.joints[i].site[1]);
                if (start != top && end != top) continue;
                const int bottom = start == top ? end : start;
                if (!placed_[bottom]) hang_up(-1, static_cast<int>(i), start != top, top, bottom);
            }
            for (std::size_t i = 0; i < model_.lines.size(); ++i) {
                const int start = vertex(model_.lines[i].sites.front());
                const int end = vertex(model_.lines[i].sites.back());
                if (used[i] || (start != top && end != top)) continue;
                used[i] = true;
                const int bottom = start == top ? end : start;
                if (placed_[bottom]) {
                    loops_.push_back(static_cast<int>(i));
                } else {
                    hang_up(static_cast<int>(i), -1, start != top, top, bottom);
                }
            }
        }
    }

    Vec3 load_of(const FreePoint& p) const {
        const Water& water = model_.water;
        Vec3 load = 0.5 * water.density * flow_.norm() * p.resistance(flow_).drag_area.cwiseProduct(flow_);
        load.z() += (water.density * p.volume - p.mass) * water.gravity;
        return load;
    }

    Vec3 load_of(std::size_t body) const {
        const Water& water = model_.water;
        const Body& b = model_.bodies[body].force.body();
        Vec3 load = 0.5 * water.density * model_.bodies[body].force.drag_area() * flow_.norm() * flow_;
        load.z() += (water.density * b.volume - b.mass) * water.gravity;
        return load;
    }

    Vec3 load_of(const Model::Line& line) const {
        Vec3 load = Vec3::Zero();
        for (int i = 0; i < line.segments; ++i) {
            const SegmentConstants& c = model_.segment_constants[model_.segments[line.first_segment + i].constants];
            const double share = state_.segment_length(line.first_segment + i) / c.length;
            load += share * c.half_normal_drag * flow_.norm() * flow_;  // one half of two: the line is inclined
            load.z() += share * 2.0 * (c.half_buoyancy - c.half_weight);
        }
        return load;
    }

    /// Puts a free point, or the body that a site is on, so that the site is there.
    void put(int site, const Vec3& there) {
        if (model_.is_attached(site)) {
            const Model::Attachment& attachment = model_.attachments[model_.attachment_of(site)];
            state_.position[state_.body_entry(attachment.body)] =
                there - state_.bodies[attachment.body].step_start_attitude * attachment.place;
        } else {
            state_.position[site] = there;
        }
    }

    void place(const Hang& hang) {
        if (hang.line < 0) {
            state_.follow_bodies();
            const Model::Joint& joint = model_.joints[hang.joint];
            put(joint.site[hang.reversed ? 0 : 1], state_.position[joint.site[hang.reversed ? 1 : 0]]);
            return;
        }
        const Model::Line& line = model_.lines[hang.line];
        const auto site = [&](int i) { return line.sites[hang.reversed ? line.segments - i : i]; };
        state_.follow_bodies();
        const Vec3 top = state_.position[site(0)];
        Vec3 along = hang.pull.norm() > 1e-12 ? Vec3(hang.pull.normalized()) : Vec3(-Vec3::UnitZ());
        along = (along + lean_ * astern_).normalized();
        double reach = 0.0;
        for (int i = 1; i < line.segments; ++i) {
            reach += state_.segment_length(line.first_segment + (hang.reversed ? line.segments - i : i - 1));
            state_.position[site(i)] = top + reach * along;
        }
        const Vec3 bottom = top + state_.line_length(hang.line) * along;
        put(site(line.segments), bottom);
    }

    /// A line between two places that are already given: straight if it is too short, else a parabola with about
    /// the line's length, sagging.
    void place_between(const Model::Line& line) {
        const Vec3 start = state_.position[line.sites.front()];
        const Vec3 chord = state_.position[line.sites.back()] - start;
        const double length = state_.line_length(static_cast<int>(&line - model_.lines.data()));
        const double excess = std::max(0.0, length * length - chord.squaredNorm());
        const double sag = std::sqrt(3.0 / 16.0 * excess);  // arc length² ≈ chord² + 16/3 sag²
        double reach = 0.0;
        for (int i = 1; i < line.segments; ++i) {
            reach += state_.segment_length(line.first_segment + i - 1);
            const double s = reach / length;
            state_.position[line.sites[i]] = start + s * chord - 4.0 * sag * s * (1.0 - s) * Vec3::UnitZ();
        }
    }

    State& state_;
    const Model& model_;
    Vec3 flow_;
    double lean_;
    Vec3 astern_;  ///< horizontal unit vector from the bow aft
    std::vector<bool> placed_;
    std::vector<Hang> tree_;
    std::vector<int> loops_;
};

/// Everything moves with `velocity`, nothing accelerates or turns.
void move_steadily(State& state, const Vec3& velocity) {
    for (Vec3& v : state.velocity) v = velocity;
    for (Vec3& a : state.acceleration) a.setZero();
    for (Vec3& a : state.auxiliary) a.setZero();
    for (std::size_t b = 0; b < state.bodies.size(); ++b) {
        state.velocity[state.body_entry(static_cast<int>(b)) + 1].setZero();
    }
    state.rebase_attitudes();
    state.follow_bodies();
}

struct Failure {
    double residual;  ///< N
    int block;
};

/// Pseudo-transient continuation from the given shape. Nothing is returned when it has arrived.
std::optional<Failure> continue_to_equilibrium(State& state) {
    constexpr double kFirstStep = 0.05;
    constexpr double kLargestStep = 3e3;  // inertia of 1 kg then counts as 1e-7 N/m
    constexpr double kSmallestStep = 1e-6;
    constexpr int kMostSteps = 300;
    const Model& model = *state.model;
    const NewtonSettings settings;
    Equations equations(state.model);
    NewtonWorkspace work(model.blocks());
    State backup = state;
    double h = kFirstStep;
    Failure failure{0.0, 0};
    for (int step = 0; step < kMostSteps && h >= kSmallestStep; ++step) {
        backup = state;
        const double tolerance = newton_tolerance(model, state, settings);
        const double acceleration_rate = 1.0 / (h * h);
        const NewtonResult result =
            solve_newton(equations, state, {1.0, 0.0, acceleration_rate}, settings, tolerance, work,
                         [&](const std::vector<Vec3>& displacement, double factor) {
                             for (int block = 0; block < model.blocks(); ++block) {
                                 const int i = state.entry_of_block(block);
                                 state.position[i] += factor * displacement[block];
                                 state.acceleration[i] += factor * acceleration_rate * displacement[block];
                             }
                             state.follow_bodies();
                         });
        if (!result.converged) {
            failure = {result.residual, result.worst_block};
            state = backup;
            h *= 0.25;
            continue;
        }
        for (Vec3& acceleration : state.acceleration) acceleration.setZero();
        state.rebase_attitudes();
        state.follow_bodies();
        equations.evaluate(state);
        failure.residual = equations.residual_norm(failure.block);
        if (h >= kLargestStep && failure.residual <= 2.0 * tolerance) return std::nullopt;
        h = std::min(kLargestStep, 3.0 * h);
    }
    return failure;
}

/// Tows the system on for `duration` (s) with implicit Euler, whose damping helps it to come to rest, and moves it
/// back to where it began.
void tow_on(State& state, const std::vector<Vec3>& positions, const Vec3& velocity, double duration) {
    std::vector<SteadyTow> laws;
    for (const Vec3& position : positions) laws.emplace_back(position, velocity, 0.0);
    Motions motions;
    for (const SteadyTow& law : laws) motions.push_back(&law);
    constexpr double kStep = 0.02;
    Simulator simulator(state, std::make_shared<BackwardEuler>(), kStep, NewtonSettings{});
    simulator.step(duration, motions);
    state = simulator.state();
    for (int i = 0; i < state.model->sites(); ++i) state.position[i] -= duration * velocity;
    for (std::size_t b = 0; b < state.bodies.size(); ++b) {
        state.position[state.body_entry(static_cast<int>(b))] -= duration * velocity;
    }
    state.time = 0.0;
    state.last_step = 0.0;
    state.damped_steps = 0;
    move_steadily(state, velocity);
}

}  // namespace

State steady_tow(std::shared_ptr<const Model> given, const std::vector<Vec3>& positions, const Vec3& velocity) {
    std::shared_ptr<const Model> model = given;
    if (given->water.changes()) {
        auto calm = std::make_shared<Model>(*given);
        calm->water = given->water.calm(0.0);
        model = calm;
    }
    if (positions.size() != static_cast<std::size_t>(model->prescribed_sites)) {
        throw InvalidInput("there must be one position for each of the " + std::to_string(model->prescribed_sites) +
                           " prescribed points");
    }
    for (const Vec3& position : positions) {
        if (!position.allFinite()) throw InvalidInput("positions must be finite");
    }
    if (!velocity.allFinite()) throw InvalidInput("velocity must be finite");

    const auto first_guess = [&](double lean) {
        State guess(model);
        for (int i = 0; i < model->prescribed_sites; ++i) guess.position[model->free_sites + i] = positions[i];
        FirstGuess(guess, velocity, lean).make();
        move_steadily(guess, velocity);
        return guess;
    };
    State state = first_guess(0.0);
    std::optional<Failure> failure = continue_to_equilibrium(state);
    if (failure) {
        // A line that must fold, because its lower end floats up, cannot leave the vertical by itself: lean it.
        State start = first_guess(0.1);
        state = start;
        failure = continue_to_equilibrium(state);
        constexpr int kMostTows = 4;
        for (int i = 0; failure && i < kMostTows; ++i) {
            constexpr double kDuration = 30.0;
            tow_on(start, positions, velocity, kDuration);
            state = start;
            failure = continue_to_equilibrium(state);
        }
    }
    if (failure) {
        std::ostringstream message;
        message << "no steady tow found: residual " << failure->residual << " N at "
                << model->describe_block(failure->block)
                << "; check weights, drag and stability at " << velocity.norm() << " m/s";
        throw ConvergenceError(message.str());
    }
    state.model = given;
    // What was solved for does not accelerate; in water that changes it does.
    state.accelerations_known = !given->water.changes();
    return state;
}

}  // namespace sim_core
