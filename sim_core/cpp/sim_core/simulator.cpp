// SPDX-License-Identifier: Apache-2.0
#include "simulator.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>
#include <utility>

#include "error.hpp"
#include "time_series.hpp"

namespace sim_core {

namespace {

/// ω h beyond which a snap is not resolved: three steps a period. Newmark's schemes stop and turn back within a step what has
/// come that far, and what they then remember of its acceleration goes wrong.
constexpr double kResolved = 2.0;
/// The same with step control, which can make the steps smaller: what it takes as resolved is so within some per cent. Between
/// these bounds light nodes that hit again and again gain energy, and the control would follow them without end.
constexpr double kResolvedByControl = 0.5;

/// Bound of the error of the stretch that a segment reaches after a resolved snap, m: (ω h)²/4 of w/ω.
double peak_error(const Snap& snap) {
    const double omega_h = 2.0 * std::numbers::pi / snap.steps_per_period;
    return 0.25 * omega_h * omega_h * snap.reach;
}

}  // namespace

Simulator::Simulator(const State& state, std::shared_ptr<const Integrator> integrator, double max_step,
                     const NewtonSettings& newton, const std::optional<StepControl>& control,
                     const std::optional<EnergyWatch>& watch)
    : state_(state),
      backup_(state),
      integrator_(std::move(integrator)),
      max_step_(max_step),
      newton_(newton),
      control_(control),
      watch_(watch),
      equations_(state.model),
      work_(state.model->blocks()),
      payouts_(state.model->winches.size()),
      start_tension_(state.model->segments.size()),
      start_taut_(state.model->segments.size()),
      peak_tension_(state.model->segments.size()),
      contacts_(*state.model) {
    if (!(max_step > 0.0) || !std::isfinite(max_step)) throw InvalidInput("max_step must be above 0 s");
    if (!(newton.tolerance > 0.0)) throw InvalidInput("newton_tolerance must be above 0");
    if (newton.max_iterations < 1) throw InvalidInput("max_iterations must be at least 1");
    if (control_) {
        if (!(control_->tolerance > 0.0)) throw InvalidInput("error_tolerance must be above 0 m");
        if (!(control_->min_step > 0.0 && control_->min_step <= max_step)) {
            throw InvalidInput("min_step must lie between 0 and max_step");
        }
        if (!integrator_->adaptive()) throw InvalidInput("error_tolerance needs an implicit integrator");
    }
    if (watch_ && !(watch_->tolerance > 0.0)) throw InvalidInput("energy_tolerance must be above 0");
    begin();
    if (watch_) start_balance();
}

void Simulator::begin() {
    if (!state_.accelerations_known) {  // set by hand
        state_.rebase_attitudes();
        state_.follow_bodies();
        solve_accelerations();
    }
    equations_.evaluate(state_);
    if (balance_) balance_->begin(equations_, state_);
    contacts_.forget();
    contacts_.look(state_);
    for (std::size_t i = 0; i < peak_tension_.size(); ++i) peak_tension_[i] = equations_.tension(static_cast<int>(i));
    least_resolved_snap_.reset();
}

bool Simulator::jumps(const Motions& motions) const {
    // A law may jump at this very instant: what it says just after it is what counts.
    const double time = state_.time + 1e-12 * (1.0 + std::abs(state_.time));
    constexpr double kRounding = 1e-6;  // at 1e5 m/s² what smooth laws change by till then
    bool jump = false;
    for (int i = 0; i < model().prescribed_sites; ++i) {
        const Vec3 velocity = motions[i]->at(time).velocity;
        const Vec3& before = state_.velocity[model().free_sites + i];
        jump = jump || (velocity - before).norm() > kRounding * (1.0 + before.norm());
    }
    for (std::size_t i = 0; i < payouts_.size(); ++i) {
        const double before = state_.winches[i].rate;
        jump = jump || std::abs(payout_at(i, time).rate - before) > kRounding * (1.0 + std::abs(before));
    }
    return jump;
}

void Simulator::solve_accelerations() {
    // F is linear in the accelerations: one solve with the mass matrix, from zero.
    for (int block = 0; block < model().blocks(); ++block) state_.acceleration[state_.entry_of_block(block)].setZero();
    state_.follow_bodies();
    equations_.evaluate(state_);
    equations_.assemble(state_, {0.0, 0.0, 1.0});
    equations_.factor();
    equations_.solve(work_.displacement);
    for (int block = 0; block < model().blocks(); ++block) {
        const int i = state_.entry_of_block(block);
        state_.acceleration[i] = work_.displacement[block];
        state_.auxiliary[i] = work_.displacement[block];
    }
    state_.follow_bodies();
    state_.follow_drums();
    if (!state_.finite()) throw ConvergenceError("the accelerations of the initial state are not finite");
    state_.accelerations_known = true;
    state_.last_step = 0.0;
}

NewtonResult Simulator::attempt(const Integrator& integrator, double h, double t_end, const Motions& motions) {
    const int last = integrator.substeps() - 1;
    double time = state_.time;
    for (int i = 0; i < last; ++i) {
        const Substep part = integrator.substep(i);
        time += part.fraction * h;
        const NewtonResult result = solve(part.scheme, part.fraction * h, time, motions);
        if (!result.converged) return result;
    }
    const Substep part = integrator.substep(last);
    return solve(part.scheme, part.fraction * h, t_end, motions);
}

NewtonResult Simulator::solve(const Scheme& scheme, double h, double t_end, const Motions& motions) {
    scheme.predict(state_, h);
    state_.time = t_end;
    for (int i = 0; i < model().prescribed_sites; ++i) {
        const int site = model().free_sites + i;
        const MotionSample sample = motions[i]->at(t_end);
        state_.position[site] = sample.position;
        state_.velocity[site] = sample.velocity;
        state_.acceleration[site] = sample.acceleration;
    }
    for (std::size_t i = 0; i < payouts_.size(); ++i) {
        const PayoutSample payout = payout_at(i, t_end);
        state_.winches[i].paid_out = payout.length;
        state_.winches[i].rate = payout.rate;
    }
    state_.follow_drums();
    const NewtonResult result = solve_newton(
        equations_, state_, scheme.rates(h), newton_, newton_tolerance(model(), state_, newton_), work_,
        [&](const std::vector<Vec3>& change, double factor) { scheme.correct(state_, change, factor, h); });
    statistics_.newton_iterations += result.iterations;
    return result;
}

void Simulator::set_payout(const std::string& line, std::shared_ptr<const Payout> law) {
    const int winch = model().winch_index(line);
    if (law) {
        const double out = state_.winches[winch].paid_out;
        const double asked = law->at(state_.time).length;
        if (!(std::abs(asked - out) <= 1e-6 * model().winches[winch].segment_length)) {
            throw InvalidInput("line '" + line + "': the payout law says " + std::to_string(asked) + " m at t = " +
                               std::to_string(state_.time) + " s, but " + std::to_string(out) + " m are out");
        }
    }
    payouts_[winch] = std::move(law);
}

PayoutSample Simulator::payout_at(std::size_t winch, double time) const {
    if (payouts_[winch]) return payouts_[winch]->at(time);
    return {state_.winches[winch].paid_out, 0.0};
}

void Simulator::check_payouts(double time) const {
    for (std::size_t i = 0; i < payouts_.size(); ++i) {
        const Winch& winch = model().winches[i];
        const double length = payout_at(i, time).length;
        const bool too_long = length > winch.longest() * (1.0 + 1e-12);
        if (!too_long && length >= winch.shortest() * (1.0 - 1e-12)) continue;
        std::ostringstream message;
        message << "line '" << model().lines[winch.line].name << "': " << length << " m out at t = " << time
                << " s is " << (too_long ? "more than its longest length of " : "less than its shortest length of ")
                << (too_long ? winch.longest() : winch.shortest()) << " m; stop the winch before";
        throw InvalidInput(message.str());
    }
}

void Simulator::wind() {
    bool wound = false;
    for (std::size_t i = 0; i < payouts_.size(); ++i) {
        while (state_.wind(static_cast<int>(i))) wound = true;
    }
    if (!wound) return;
    solve_accelerations();
    equations_.evaluate(state_);
}

void Simulator::remember_tensions() {
    for (std::size_t i = 0; i < start_tension_.size(); ++i) {
        start_tension_[i] = equations_.tension(static_cast<int>(i));
        start_taut_[i] = equations_.taut(static_cast<int>(i));
    }
}

std::optional<Snap> Simulator::find_snap(double h) {
    std::optional<Snap> worst;
    bool factored = false;
    for (std::size_t i = 0; i < start_tension_.size(); ++i) {
        const int segment = static_cast<int>(i);
        if (equations_.taut(segment) == static_cast<bool>(start_taut_[i])) continue;
        if (!factored) {
            factored = true;
            equations_.assemble(state_, {0.0, 0.0, 1.0});
            equations_.factor();
        }
        const double mobility = equations_.mobility(state_, segment);
        const double jump = std::abs(equations_.tension(segment) - start_tension_[i]);
        if (jump * mobility <= model().water.gravity) continue;
        const double frequency = std::sqrt(equations_.axial_stiffness(segment) * mobility);
        const double steps = 2.0 * std::numbers::pi / (frequency * h);
        const int(&site)[2] = model().segments[i].site;
        const Vec3 span = backup_.position[site[1]] - backup_.position[site[0]];
        const double speed = std::abs(span.normalized().dot(backup_.velocity[site[1]] - backup_.velocity[site[0]]));
        const double reach = speed / frequency;
        if (!worst || steps < worst->steps_per_period) worst = Snap{segment, state_.time, steps, reach};
    }
    return worst;
}

void Simulator::step(double t_end, const Motions& motions) {
    if (!std::isfinite(t_end) || t_end < state_.time) {
        throw InvalidInput("t_end must not lie before the present time " + std::to_string(state_.time) + " s");
    }
    if (motions.size() != static_cast<std::size_t>(model().prescribed_sites)) {
        throw InvalidInput("there must be one motion for each of the " + std::to_string(model().prescribed_sites) +
                           " prescribed points");
    }
    constexpr int kMostHalvings = 12;
    const double span = t_end - state_.time;
    if (span == 0.0) return;
    const double full_step = control_ ? max_step_ : span / std::max(1.0, std::ceil(span / max_step_ * (1.0 - 1e-12)));
    const double smallest_step = control_ ? control_->min_step : std::ldexp(full_step, -kMostHalvings);
    double h = control_ && state_.next_step > 0.0 ? std::clamp(state_.next_step, smallest_step, full_step) : full_step;
    bool jump = integrator_->damps_snaps() && jumps(motions);
    int halvings = 0;
    while (state_.time < t_end) {
        const double remaining = t_end - state_.time;
        const bool last = remaining <= h * (1.0 + 1e-9);
        // Two equal steps at the end rather than a whole one and a remnant
        const double size = last ? remaining : control_ && remaining < 2.0 * h ? 0.5 * remaining : h;
        const double next_time = last ? t_end : state_.time + size;
        check_payouts(next_time);
        backup_ = state_;
        remember_tensions();
        bool damped = state_.damped_steps > 0 || jump;
        NewtonResult result = attempt(damped ? damped_integrator_ : *integrator_, size, next_time, motions);
        std::optional<Snap> snap;
        if (result.converged && integrator_->damps_snaps()) snap = find_snap(size);
        const double resolved = control_ ? kResolvedByControl : kResolved;
        const bool impact = snap && 2.0 * std::numbers::pi > resolved * snap->steps_per_period;
        if (snap) snap->impact = impact;
        if (impact && !damped) {
            damped = true;
            state_ = backup_;
            result = attempt(damped_integrator_, size, next_time, motions);
        }
        if (result.converged) {
            double error = control_ ? step_error(size) : 0.0;
            if (snap && !impact) error = std::max(error, peak_error(*snap));
            const double ratio = control_ ? error / control_->tolerance : 0.0;
            state_.time = next_time;
            const EnergyBalance* energy = nullptr;
            if (balance_ && ratio <= 1.0) {
                const double end_share = damped ? damped_integrator_.end_share() : integrator_->end_share();
                // The step in which a line comes taut only takes it to its length; what moves is stopped in the next.
                const bool stops = impact || backup_.damped_steps == State::kMostDampedSteps;
                energy = &balance_->measure_step(backup_, state_, equations_, end_share, stops);
            }
            const bool balanced = !watch_ || !energy || keeps_balance(*energy);
            if (ratio <= 1.0 && balanced) {
                if (snap) note(*snap);
                accept(size, impact);
                jump = false;
                wind();
                if (control_) {
                    const double growth = 0.9 * std::pow(std::max(ratio, 1e-4), -0.7 / 3.0) *
                                          std::pow(std::max(state_.error_ratio, 1e-4), 0.4 / 3.0);
                    // A step cut short to end at t_end is no reason to go on with shorter ones.
                    const double least = size < h ? h : smallest_step;
                    h = std::clamp(size * std::clamp(growth, 0.3, 2.0), least, full_step);
                    state_.error_ratio = ratio;
                } else if (!control_ && halvings > 0) {  // carefully back to the full step
                    --halvings;
                    h = std::min(full_step, 2.0 * h);
                }
                state_.next_step = control_ ? h : 0.0;
                continue;
            }
            ++statistics_.rejections;
            if (balanced) {
                h = size * std::clamp(0.9 * std::pow(ratio, -1.0 / 3.0), 0.2, 0.9);
            } else {
                h = 0.5 * size;
                ++halvings;
            }
            if (h < smallest_step * (1.0 - 1e-9)) {
                std::ostringstream message;
                if (balanced) {
                    message << "the error of a step of " << size << " s is " << ratio * control_->tolerance << " m";
                } else {
                    step_error(size);
                    message << "the energy balance is off by " << remainder(balance_->energy()) + remainder(*energy)
                            << " J of " << balance_->energy().exchanged + energy->exchanged << " J with a step of "
                            << size << " s";
                }
                message << " at t = " << next_time << " s, worst at " << model().describe_block(worst_error_block_)
                        << "; give a larger tolerance or a smaller step";
                state_ = backup_;
                equations_.evaluate(state_);
                throw ConvergenceError(message.str());
            }
        } else {
            ++statistics_.halvings;
            ++halvings;
            h = 0.5 * size;
        }
        state_ = backup_;
        equations_.evaluate(state_);
        if (h < smallest_step * (1.0 - 1e-9)) {
            std::ostringstream message;
            message << "no solution at " << model().describe_block(result.worst_block) << " at t = " << next_time
                    << " s (residual " << result.residual << " N with a step of " << size
                    << " s); check the input there or give a smaller max_step";
            throw ConvergenceError(message.str());
        }
    }
}

bool Simulator::keeps_balance(const EnergyBalance& step) const {
    const EnergyBalance& before = balance_->energy();
    const double rounding = 1e-9 * model().force_scale;
    return std::abs(remainder(step)) <= watch_->tolerance * step.exchanged + rounding ||
           std::abs(remainder(before) + remainder(step)) <= watch_->tolerance * (before.exchanged + step.exchanged);
}

double Simulator::remainder(const EnergyBalance& energy) const {
    return watch_->inelastic_snaps ? energy.numerical : energy.numerical + energy.impact;
}

void Simulator::note(const Snap& snap) {
    ++statistics_.snaps;
    if (snap.impact) ++statistics_.impacts;
    const auto resolution = [](const Snap& s) { return std::pair(!s.impact, s.steps_per_period); };
    if (!least_resolved_snap_ || resolution(snap) < resolution(*least_resolved_snap_)) least_resolved_snap_ = snap;
}

void Simulator::accept(double size, bool impact) {
    if (balance_) balance_->add_step();
    state_.rebase_attitudes();
    state_.last_step = size;
    contacts_.look(state_);
    ++statistics_.steps;
    for (std::size_t i = 0; i < peak_tension_.size(); ++i) {
        peak_tension_[i] = std::max(peak_tension_[i], equations_.tension(static_cast<int>(i)));
    }
    if (impact) {
        state_.damped_steps = State::kMostDampedSteps;
    } else if (state_.damped_steps > 0) {
        --state_.damped_steps;
    }
}

double Simulator::step_error(double h) {
    for (int block = 0; block < model().blocks(); ++block) {
        const int i = state_.entry_of_block(block);
        work_.displacement[block] = state_.position[i] - backup_.position[i] - h * backup_.velocity[i] -
                                    (h * h / 6.0) * (2.0 * backup_.acceleration[i] + state_.acceleration[i]);
    }
    return equations_.largest_displacement(work_.displacement, worst_error_block_);
}

void Simulator::start_balance() {
    if (!model().winches.empty()) {
        throw InvalidInput("balances do not count what a winch does: leave out balance and energy_tolerance");
    }
    balance_.emplace(model());
    balance_->begin(equations_, state_);
}

void Simulator::step_to(double t_end, const Vec3& position, const Vec3& velocity) {
    if (model().prescribed_sites != 1) {
        throw InvalidInput("step_to moves the only prescribed point of a model; this one has " +
                           std::to_string(model().prescribed_sites));
    }
    if (!position.allFinite() || !velocity.allFinite()) {
        throw InvalidInput("position and velocity of the tow point must be finite");
    }
    if (!(t_end > state_.time)) {
        throw InvalidInput("t_end must lie after the present time " + std::to_string(state_.time) + " s");
    }
    const int site = model().free_sites;
    const HermiteSegment cubic(state_.time, state_.position[site], state_.velocity[site], t_end, position, velocity);
    one_motion_[0] = &cubic;
    step(t_end, one_motion_);
}

void Simulator::restore(const std::string& bytes) {
    State restored = state_;
    restored.restore(bytes);
    std::swap(state_, restored);
    try {
        begin();
    } catch (...) {
        state_ = restored;
        equations_.evaluate(state_);
        throw;
    }
}

}  // namespace sim_core
