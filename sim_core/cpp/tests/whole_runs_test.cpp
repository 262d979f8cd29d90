// SPDX-License-Identifier: Apache-2.0
// Every kind of force, every integrator, statics, saved states, halved steps and failures in short runs, for the
// sanitizers (SIM_CORE_SANITIZE) to look at. What the numbers should be is tested in ../../tests.
#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

#include "sim_core/backward_euler.hpp"
#include "sim_core/box.hpp"
#include "sim_core/energy.hpp"
#include "sim_core/error.hpp"
#include "sim_core/forward_euler.hpp"
#include "sim_core/generalized_alpha.hpp"
#include "sim_core/hht.hpp"
#include "sim_core/newmark.hpp"
#include "sim_core/recorder.hpp"
#include "sim_core/simulator.hpp"
#include "sim_core/single_step_houbolt.hpp"
#include "sim_core/statics.hpp"

namespace {

using namespace sim_core;

int failures = 0;

void check(bool holds, const char* what) {
    std::printf("%s: %s\n", holds ? "ok" : "FAILED", what);
    if (!holds) ++failures;
}

LineProperties cable(double length) {
    LineProperties p;
    p.length = length;
    p.diameter = 0.01;
    p.mass_per_length = 0.2;
    p.axial_stiffness = 5e4;
    p.axial_damping = 20.0;
    return p;
}

Body finned_fish() {
    Body fish;
    fish.mass = 12.5;
    fish.inertia = Vec3(0.02, 1.8, 1.8).asDiagonal();
    fish.centre_of_gravity = {0.0, 0.0, -0.01};
    fish.volume = 0.0125;
    fish.diameter = 0.11;
    fish.length = 1.3;
    fish.added_mass.diagonal() << 0.6, 12.5, 12.5, 0.0, 1.7, 1.7;
    fish.axial_drag = 0.3;
    fish.cross_flow_drag = 1.1;
    for (const Vec3& normal : {Vec3(Vec3::UnitZ()), Vec3(Vec3::UnitY())}) {
        Fin fin;
        fin.position = {-0.55, 0.0, 0.1};
        fin.normal = normal;
        fin.area = 0.02;
        fin.lift_slope = 3.0;
        fin.drag = 0.02;
        fin.stall_angle = 0.3;
        fin.cross_flow_drag = 1.0;
        fish.fins.push_back(fin);
    }
    return fish;
}

/// A tow from above the surface in a current: a clamped line with bending stiffness and two sections, a depressor
/// with a fin, and a fish on two legs (a closed loop).
std::shared_ptr<const Model> everything() {
    Water water;
    water.current = {0.1, 0.2, 0.0};
    ModelBuilder builder{water};
    builder.add_prescribed_point("tow_point");
    builder.add_free_point("junction", {0.2, 1e-4, FixedAxes{Vec3::Constant(0.002), Vec3::Constant(0.05)}});
    builder.add_free_point("depressor", {6.2, 0.697e-3, Weathervane{{0.004, 0.01, 0.01}, {0.3, 0.6, 0.6}, 0.05}});
    builder.add_body("fish", finned_fish());
    LineProperties stiff = cable(0.5);
    stiff.bending_stiffness = 0.05;
    builder.add_line("primary", {"tow_point", {}, Vec3(-0.5, 0.0, -1.0)}, {"junction", {}, {}}, {{stiff, 3}, {cable(1.5), 5}});
    builder.add_line("depressor_cable", {"junction", {}, {}}, {"depressor", {}, {}}, {{cable(0.3), 2}});
    builder.add_line("leg", {"junction", {}, {}}, {"fish", Vec3(0.6, 0.0, 0.05), {}}, {{cable(1.2), 4}});
    builder.add_line("other_leg", {"fish", Vec3(0.3, 0.0, 0.05), {}}, {"junction", {}, {}}, {{cable(1.45), 4}});
    return std::make_shared<const Model>(builder.build());
}

const Vec3 kTowPoint(0.0, 0.0, 0.2);
const Vec3 kVelocity(1.5, 0.0, 0.0);
const SliderCrank kCrank(kTowPoint + Vec3(0.0, 0.0, 0.1), kVelocity, 0.1, 0.35, 1.6, 0.0, 1.6, 0.0);

void test_integrators(const State& start) {
    const Motions motions{&kCrank};
    struct Case {
        std::shared_ptr<const Integrator> integrator;
        double step, duration;  // s
    };
    for (const Case& c : {Case{std::make_shared<BackwardEuler>(), 0.01, 0.8}, Case{std::make_shared<Box>(), 0.005, 0.4},
                          Case{std::make_shared<ForwardEuler>(), 2e-6, 2e-4}, Case{std::make_shared<Hht>(-0.1), 0.01, 0.8},
                          Case{std::make_shared<GeneralizedAlpha>(0.8), 0.01, 0.8},
                          Case{std::make_shared<Newmark>(0.25, 0.5), 0.01, 0.8},
                          Case{std::make_shared<SingleStepHoubolt>(1.5), 0.01, 0.8}}) {
        Simulator simulator(start, c.integrator, c.step, NewtonSettings{});
        simulator.step(c.duration, motions);
        check(simulator.state().finite() && simulator.statistics().steps >= std::lround(c.duration / c.step),
              "an integrator gets through");
    }
}

void test_saved_states(const State& start) {
    const Motions motions{&kCrank};
    Simulator simulator(start, std::make_shared<GeneralizedAlpha>(0.8), 0.01, NewtonSettings{});
    simulator.step(0.5, motions);
    const std::string saved = simulator.state().save();
    Simulator copy = simulator;
    simulator.step(1.0, motions);
    copy.step(1.0, motions);
    check(copy.state().save() == simulator.state().save(), "a copied simulator continues alike");
    Simulator other(start, std::make_shared<GeneralizedAlpha>(0.8), 0.01, NewtonSettings{});
    other.restore(saved);
    other.step(1.0, motions);
    check(other.state().save() == simulator.state().save(), "a restored state continues bit for bit");
    bool refused = false;
    try {
        other.restore(saved.substr(0, saved.size() - 8));
    } catch (const InvalidInput&) {
        refused = true;
    }
    check(refused && other.state().save() == simulator.state().save(), "a state cut short changes nothing");
}

void test_halved_steps(const State& start) {
    const Motions motions{&kCrank};
    Simulator simulator(start, std::make_shared<GeneralizedAlpha>(0.8), 0.2, NewtonSettings{2, 1e-8});
    simulator.step(0.4, motions);
    check(simulator.statistics().halvings > 0 && simulator.state().finite(), "hard steps are halved");

    Simulator hopeless(start, std::make_shared<GeneralizedAlpha>(0.8), 0.2, NewtonSettings{0, 1e-12});
    const std::string before = hopeless.state().save();
    bool stopped = false;
    try {
        hopeless.step(0.4, motions);
    } catch (const ConvergenceError&) {
        stopped = true;
    }
    check(stopped && hopeless.state().save() == before, "what cannot be solved stops at the last good state");
}

void test_snap() {
    ModelBuilder builder{Water{}};
    builder.add_prescribed_point("tow_point");
    builder.add_free_point("weight", {5.0, 5e-4, FixedAxes{Vec3::Constant(0.004), Vec3::Constant(0.2)}});
    builder.add_line("line", {"tow_point", {}, {}}, {"weight", {}, {}}, {{cable(2.0), 8}});
    const auto model = std::make_shared<const Model>(builder.build());
    const State hanging = steady_tow(model, {Vec3(0, 0, -1)}, Vec3::Zero());
    const Sinusoid jerk(Vec3(0, 0, -1), Vec3::Zero(), 0.5, 1.0, 0.0, 0.5, 0.0);  // 2 g
    Simulator simulator(hanging, std::make_shared<GeneralizedAlpha>(0.8), 0.005, NewtonSettings{});
    simulator.step(3.0, {&jerk});
    check(simulator.statistics().snaps > 0, "a line goes slack and snaps");
}

void test_records(const State& start) {
    Simulator simulator(start, std::make_shared<GeneralizedAlpha>(0.8), 0.01, NewtonSettings{});
    const Recording recording = record_run(simulator, {&kCrank}, 0.35, 0.1);
    check(recording.time.size() == 5 && recording.tension.size() == 5 * start.model->segments.size(),
          "a run is recorded to its end");
    const Energy e = energy(simulator.state());
    check(std::isfinite(e.kinetic + e.gravity + e.elastic) && e.kinetic > 0.0, "and has energy");
}

}  // namespace

int main() {
    const auto model = everything();
    const State start = steady_tow(model, {kTowPoint}, kVelocity);
    test_integrators(start);
    test_saved_states(start);
    test_halved_steps(start);
    test_snap();
    test_records(start);
    return failures == 0 ? 0 : 1;
}
