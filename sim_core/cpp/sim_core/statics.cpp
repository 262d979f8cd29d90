// SPDX-License-Identifier: Apache-2.0
#include "statics.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <sstream>

#include "equations.hpp"
#include "error.hpp"
#include "newton.hpp"

namespace sim_core {

namespace {

/// A first guess: every line straight and unstretched, in the direction of weight and drag of what hangs on it.
class FirstGuess {
  public:
    FirstGuess(State& state, const Vec3& velocity)
        : state_(state),
          model_(*state.model),
          flow_(model_.water.current.at(state.position[model_.free_sites].z(), 0.0) - velocity),
          placed_(vertices(), false) {}

    void make() {
        const Vec3 ahead(-flow_.x(), -flow_.y(), 0.0);
        const double heading = ahead.norm() > 1e-9 ? std::atan2(ahead.y(), ahead.x()) : 0.0;
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
        const Vec3 along = hang.pull.norm() > 1e-12 ? Vec3(hang.pull.normalized()) : Vec3(-Vec3::UnitZ());
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

/// Solves one implicit step, in which everything is held by its inertia · `acceleration_rate` (1/s²), by Newton's
/// method. False, with the place in `failure`, if it does not converge.
///
/// A step of Newton's method is cut until the forces do no more than half of their work back along it: the line search
/// of Matthies & Strang (1979), Int. J. Numer. Methods Eng. 14, 1613–1626. At rest that is a search down the potential
/// energy, which in limp lines is convex, so that it leads out of any tangle; the residual alone is a bad judge, since
/// a stiff line that turns a little stretches a lot to second order. In a flow, where forces have no potential, a
/// smaller residual will do as well.
bool solve_held(Equations& equations, State& state, double acceleration_rate, double tolerance,
                std::vector<Vec3>& displacement, Failure& failure) {
    constexpr int kMostIterations = 100;
    constexpr double kSmallestFactor = 1e-8;
    const int blocks = state.model->blocks();
    const auto move = [&](double factor) {
        for (int block = 0; block < blocks; ++block) {
            const int i = state.entry_of_block(block);
            state.position[i] += factor * displacement[block];
            state.acceleration[i] += factor * acceleration_rate * displacement[block];
        }
        state.follow_bodies();
        equations.evaluate(state);
        failure.residual = equations.residual_norm(failure.block);
    };
    const auto work = [&] {
        double sum = 0.0;
        for (int block = 0; block < blocks; ++block) sum += equations.residual()[block].dot(displacement[block]);
        return sum;
    };
    equations.evaluate(state);
    failure.residual = equations.residual_norm(failure.block);
    for (int i = 0; i < kMostIterations && std::isfinite(failure.residual); ++i) {
        if (failure.residual <= tolerance) return true;
        const double residual = failure.residual;
        equations.assemble(state, {1.0, 0.0, acceleration_rate});
        equations.factor();
        equations.solve(displacement);
        const double along = work();
        if (!std::isfinite(along)) return false;
        double factor = 1.0;
        for (move(factor); failure.residual > tolerance;) {
            const double back = -work();
            const bool finite = std::isfinite(back) && std::isfinite(failure.residual);
            if (finite && along > 0.0 && back <= 0.5 * along) break;
            if (finite && failure.residual <= (1.0 - 0.5 * factor) * residual) break;
            if (factor <= kSmallestFactor) return false;
            double cut = 0.5;
            if (along > 0.0) cut = finite ? std::clamp(along / (along + back), 0.1, 0.7) : 0.1;
            move((cut - 1.0) * factor);
            factor *= cut;
        }
    }
    return failure.residual <= tolerance;
}

constexpr double kFirstStep = 0.05;    // s
constexpr double kLargestStep = 3e3;  // s; inertia of 1 kg then counts as 1e-7 N/m

/// Pseudo-transient continuation from the given shape, with steps from `step` (s) on. Nothing is returned when it has
/// arrived.
std::optional<Failure> continue_to_equilibrium(State& state, double step) {
    constexpr double kSmallestStep = 1e-6;
    constexpr int kMostSteps = 300;
    const NewtonSettings settings{.tolerance = 1e-10};  // it costs a last iteration, once
    Equations equations(state.model);
    std::vector<Vec3> displacement(state.model->blocks());
    State backup = state;
    Failure failure{0.0, 0};
    for (int i = 0; i < kMostSteps && step >= kSmallestStep; ++i) {
        backup = state;
        const double tolerance = newton_tolerance(*state.model, state, settings);
        if (!solve_held(equations, state, 1.0 / (step * step), tolerance, displacement, failure)) {
            state = backup;
            step *= 0.25;
            continue;
        }
        for (Vec3& acceleration : state.acceleration) acceleration.setZero();
        state.rebase_attitudes();
        state.follow_bodies();
        equations.evaluate(state);
        failure.residual = equations.residual_norm(failure.block);
        if (step >= kLargestStep && failure.residual <= 2.0 * tolerance) return std::nullopt;
        step = std::min(kLargestStep, 3.0 * step);
    }
    return failure;
}

/// The same model with lines that are no stiffer than `stiffness` (EA, N), unless they would rather be squeezed than
/// buckle.
std::shared_ptr<const Model> softened(const Model& model, double stiffness) {
    constexpr double kUnsqueezed = 20.0;
    auto soft = std::make_shared<Model>(model);
    for (SegmentConstants& c : soft->segment_constants) {
        const double softest = std::max(stiffness, kUnsqueezed * c.buckling_force);
        if (c.axial_stiffness <= softest) continue;
        c.axial_stiffness = softest;
        c.tension_curve.reset();
    }
    return soft;
}

/// Equilibrium of the system with soft lines first, then with stiffer ones, and at last as it is.
std::optional<Failure> stiffen_to_equilibrium(State& state, double first_step) {
    constexpr double kSoft = 4.0;  // EA over the weight in air of everything, which then strains a line by a quarter
    constexpr double kStiffening = 100.0;
    const std::shared_ptr<const Model> model = state.model;
    double stiffest = 0.0;
    for (const SegmentConstants& c : model->segment_constants) stiffest = std::max(stiffest, c.axial_stiffness);
    double step = first_step;
    for (double stiffness = kSoft * model->force_scale; stiffness < stiffest; stiffness *= kStiffening) {
        state.model = softened(*model, stiffness);
        const std::optional<Failure> failure = continue_to_equilibrium(state, step);
        state.model = model;
        if (failure) return failure;
        step = kLargestStep;
    }
    return continue_to_equilibrium(state, step);
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

    State guess(model);
    for (int i = 0; i < model->prescribed_sites; ++i) guess.position[model->free_sites + i] = positions[i];
    FirstGuess(guess, velocity).make();
    move_steadily(guess, velocity);
    State state = guess;
    std::optional<Failure> failure = stiffen_to_equilibrium(state, kFirstStep);
    if (failure) {  // nothing draws it to rest: it swings. An equilibrium it may have all the same.
        state = guess;
        failure = stiffen_to_equilibrium(state, kLargestStep);
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
