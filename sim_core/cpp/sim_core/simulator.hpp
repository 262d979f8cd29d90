// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "backward_euler.hpp"
#include "balance.hpp"
#include "equations.hpp"
#include "integrator.hpp"
#include "motion.hpp"
#include "newton.hpp"
#include "payout.hpp"
#include "state.hpp"

namespace sim_core {

/// One law of motion per prescribed point, in the order of Model::prescribed_point.
using Motions = std::vector<const Motion*>;

/// Choice of the step by an estimate of its error.
///
/// The displacement of a step is held against the one that follows from the accelerations at its two ends, taken as linear
/// between them,  e = Δq − h v₀ − h² (2 v̇₀ + v̇₁)/6,  which is of a higher order: the estimate of Zienkiewicz & Xie (1991,
/// Earthq. Eng. Struct. Dyn. 20, 871–887) with the physical accelerations, so that it holds for every scheme alike. A
/// step with an error above the tolerance is taken again. The next step follows from the errors of the last two (PI
/// control: Hairer & Wanner 1996, Solving Ordinary Differential Equations II, § IV.2).
struct StepControl {
    double tolerance;  ///< of the error of a step, m, at the worst node; rotations count with half the body's length
    double min_step;   ///< s
};

/// A watch over the balance of energy.
///
/// A step is taken again with half the size where its own remainder is above `tolerance` times what it exchanges and would
/// bring the remainder of all steps above `tolerance` times what they have exchanged. So at every instant the balance is kept
/// within the tolerance, or the simulation stops with an error. Both but for a rounding of 1e-9 m times the weight in air
/// a step.
struct EnergyWatch {
    double tolerance;
    /// What is lost where a snap is not resolved belongs to the physics, an inelastic impact, and is no remainder.
    bool inelastic_snaps = false;
};

/// A line that went taut or slack with a jump of tension within a step.
struct Snap {
    int segment;
    double time;              ///< s, at the end of the step
    double steps_per_period;  ///< of the ends of the segment against one another
    double reach;             ///< m: how far they swing with the speed at which they met, w/ω
    bool impact = false;      ///< not resolved, and taken as an inelastic impact
};

struct StepStatistics {
    std::int64_t steps = 0;              ///< accepted steps of the integrator
    std::int64_t newton_iterations = 0;  ///< in all attempts
    std::int64_t halvings = 0;           ///< attempts that Newton's iteration could not solve
    std::int64_t rejections = 0;         ///< attempts with too large an error, estimated or of the energy balance
    std::int64_t snaps = 0;              ///< steps in which a line went taut or slack with a jump
    std::int64_t impacts = 0;            ///< those of them that were not resolved and taken as inelastic impacts
};

/// Advances one state in time.
///
/// A step that Newton's iteration cannot solve is tried again with half the size, down to 2⁻¹² of
/// `max_step`; then ConvergenceError names the place and the time, and the state stays at the last good instant.
/// A line snaps where a segment goes from slack to taut or back within a step, and the jump of its tension changes the
/// acceleration of its ends against one another by more than gravity's. Whether the step resolves that is a matter of
/// ω = √(k Σ1/m), the frequency of these ends on the segment. Up to ω h = 2 (with step control ½) the integrator goes on by itself. Beyond, a scheme
/// that keeps energy or remembers accelerations would turn what it does not resolve into motion that is not there: such a
/// step is taken again with implicit Euler, and the next two likewise. Momentum is conserved, what the step
/// cannot resolve is damped, as in an inelastic impact. Step control and energy watch judge these steps like all
/// others. An integrator may decline that (Integrator::damps_snaps).
///
/// Where the velocity of a prescribed point or the rate of a winch jumps from one call of step() to the next, or from the
/// state, the force of damping jumps with it and the accelerations are not those that the state remembers: the first
/// step is then one of implicit Euler, which asks for none.
///
/// Not safe for use from several threads at once; use one simulator each.
class Simulator {
  public:
    /// `max_step` is the largest step size, s. Without a `control` all steps are as large as that allows. A state whose
    /// accelerations are unknown gets them here.
    Simulator(const State& state, std::shared_ptr<const Integrator> integrator, double max_step,
              const NewtonSettings& newton, const std::optional<StepControl>& control = std::nullopt,
              const std::optional<EnergyWatch>& watch = std::nullopt);

    const State& state() const { return state_; }
    const Model& model() const { return *state_.model; }
    const StepStatistics& statistics() const { return statistics_; }
    double max_step() const { return max_step_; }

    /// Steps of equal size, at most max_step, or as the step control chooses, until exactly `t_end`. The laws are evaluated inside each step.
    void step(double t_end, const Motions& motions);

    /// The same for the one prescribed point of a model, moved along the cubic from where it is to the given position
    /// and velocity at t_end.
    void step_to(double t_end, const Vec3& position, const Vec3& velocity);

    /// The length of a line that its winch pays out or hauls in from now on; no law stops the winch. Throws InvalidInput if
    /// the line has no winch, or another length is out now than the law says.
    void set_payout(const std::string& line, std::shared_ptr<const Payout> law);

    /// The equations at the present state, for the loads in the lines.
    const Equations& equations() const { return equations_; }

    /// Counts energy and momentum from now on; costs about as much as the steps themselves.
    void start_balance();
    /// None until it was started. Restoring a state starts it anew.
    const std::optional<Balance>& balance() const { return balance_; }
    /// The impact, or where there was none the snap, with the fewest steps per period since the start, or since a state was
    /// restored.
    const std::optional<Snap>& least_resolved_snap() const { return least_resolved_snap_; }
    /// The largest tension of a segment of the whole model at the end of any step, likewise, N.
    double peak_tension(int segment) const { return peak_tension_[segment]; }
    /// What touched the tank since the start, or since the state was restored.
    const ContactWatch& contacts() const { return contacts_; }

    /// Replaces the state by a saved one of the same model. A state whose accelerations are unknown gets them.
    /// Throws InvalidInput (State::restore) or ConvergenceError, and the simulator is as it was.
    void restore(const std::string& bytes);

  private:
    NewtonResult attempt(const Integrator& integrator, double h, double t_end, const Motions& motions);
    NewtonResult solve(const Scheme& scheme, double h, double t_end, const Motions& motions);
    void accept(double size, bool impact);
    void note(const Snap& snap);
    bool keeps_balance(const EnergyBalance& step) const;
    double remainder(const EnergyBalance& energy) const;
    double step_error(double h);
    void remember_tensions();
    std::optional<Snap> find_snap(double h);
    void begin();
    void solve_accelerations();
    bool jumps(const Motions& motions) const;
    PayoutSample payout_at(std::size_t winch, double time) const;
    void check_payouts(double time) const;
    void wind();

    State state_;
    State backup_;
    std::shared_ptr<const Integrator> integrator_;
    BackwardEuler damped_integrator_;
    double max_step_;
    NewtonSettings newton_;
    std::optional<StepControl> control_;
    std::optional<EnergyWatch> watch_;
    std::optional<Balance> balance_;
    Equations equations_;
    NewtonWorkspace work_;
    std::vector<std::shared_ptr<const Payout>> payouts_;  ///< per winch
    Motions one_motion_{nullptr};  ///< room for step_to
    std::vector<double> start_tension_;  ///< of each segment at the start of the step, N
    std::vector<char> start_taut_;
    std::vector<double> peak_tension_;
    std::optional<Snap> least_resolved_snap_;
    int worst_error_block_ = 0;  ///< of the last step error
    StepStatistics statistics_;
    ContactWatch contacts_;
};

}  // namespace sim_core
