// SPDX-License-Identifier: Apache-2.0
// Every kind of force, every integrator, every law of motion, statics, winches, contact, step control, balances, saved
// states, halved steps and failures in short runs, for the sanitizers (SIM_CORE_SANITIZE) to look at. What the numbers should be is tested in ../../tests.
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sim_core/backward_euler.hpp"
#include "sim_core/box.hpp"
#include "sim_core/energy.hpp"
#include "sim_core/error.hpp"
#include "sim_core/forward_euler.hpp"
#include "sim_core/generalized_alpha.hpp"
#include "sim_core/heave.hpp"
#include "sim_core/hht.hpp"
#include "sim_core/newmark.hpp"
#include "sim_core/recorder.hpp"
#include "sim_core/ship_response.hpp"
#include "sim_core/simulator.hpp"
#include "sim_core/single_step_houbolt.hpp"
#include "sim_core/statics.hpp"
#include "sim_core/time_series.hpp"
#include "sim_core/turn.hpp"

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
    water.current.uniform = {0.1, 0.2, 0.0};
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

/// FNV-1a, as a saved state carries it at its end.
void mend_checksum(std::string& bytes) {
    std::uint64_t sum = 0xcbf29ce484222325ULL;
    const std::size_t end = bytes.size() - sizeof sum;
    for (std::size_t i = 0; i < end; ++i) sum = (sum ^ static_cast<unsigned char>(bytes[i])) * 0x100000001b3ULL;
    std::memcpy(bytes.data() + end, &sum, sizeof sum);
}

/// Every byte of a state of a winch and a fish turned, with a checksum that says nothing: refused, failing or running.
void test_damaged_states() {
    Water water;
    water.current.uniform = {0.1, 0.0, 0.0};
    ModelBuilder builder{water};
    builder.add_prescribed_point("tow_point");
    builder.add_free_point("weight", {5.0, 5e-4, FixedAxes{Vec3::Constant(0.004), Vec3::Constant(0.2)}});
    builder.add_body("fish", finned_fish());
    builder.add_line("wound", {"tow_point", {}, {}}, {"weight", {}, {}}, {{cable(3.0), 4}});
    builder.add_winch("wound", 1.6);
    builder.add_line("other", {"weight", {}, {}}, {"fish", Vec3(0.6, 0.0, 0.0), {}}, {{cable(1.0), 2}});
    const auto model = std::make_shared<const Model>(builder.build());
    Simulator simulator(steady_tow(model, {kTowPoint}, Vec3::Zero()), std::make_shared<GeneralizedAlpha>(0.8), 0.01,
                        NewtonSettings{4, 1e-8});
    const SteadyTow held(kTowPoint, Vec3::Zero(), 0.0);
    simulator.step(0.02, {&held});
    const std::string saved = simulator.state().save();
    int refused = 0;
    int run = 0;
    for (std::size_t i = 0; i + sizeof(std::uint64_t) < saved.size(); ++i) {
        for (const int turned : {0xff, 0x01, 0x40}) {
            std::string bytes = saved;
            bytes[i] = static_cast<char>(bytes[i] ^ turned);
            mend_checksum(bytes);
            try {
                simulator.restore(bytes);
                simulator.step(simulator.state().time + 0.01, {&held});
                ++run;
            } catch (const std::exception&) {
                ++refused;
            }
        }
    }
    check(refused > 100 && run > 1000, "damaged states are refused, fail or run");
}

/// A tow point that no solution can follow.
class Nowhere : public Motion {
  public:
    MotionSample at(double) const override { return {Vec3::Constant(std::nan("")), Vec3::Zero(), Vec3::Zero()}; }
};

void test_halved_steps(const State& start) {
    const Motions motions{&kCrank};
    Simulator simulator(start, std::make_shared<GeneralizedAlpha>(0.8), 0.2, NewtonSettings{2, 1e-8});
    simulator.step(0.4, motions);
    check(simulator.statistics().halvings > 0 && simulator.state().finite(), "hard steps are halved");

    const Nowhere nowhere;
    Simulator hopeless(start, std::make_shared<GeneralizedAlpha>(0.8), 0.2, NewtonSettings{});
    const std::string before = hopeless.state().save();
    bool stopped = false;
    try {
        hopeless.step(0.4, {&nowhere});
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

/// A hull given by a table, with a pair of fins in the downwash of another.
Body tabled_fish() {
    Body fish = finned_fish();
    fish.axial_drag = 0.0;
    fish.munk_moment = 0.0;
    Fin front = fish.fins[0];
    front.position.x() = 0.3;
    fish.fins.push_back(front);
    fish.downwash.push_back({2, 0, 0.4});
    HullTable table;
    table.attack = table.sideslip = {-0.4, 0.0, 0.4};
    for (const double attack : table.attack) {
        for (const double sideslip : table.sideslip) {
            table.coefficients.push_back({0.3 + attack * attack + sideslip * sideslip, -0.5 * sideslip, 0.5 * attack, 0.0,
                                          -0.3 * attack, -0.3 * sideslip});
        }
    }
    table.area = 0.0095;
    table.length = 1.3;
    fish.hull_table = table;
    return fish;
}

Sea sea() {
    Jonswap spectrum;
    spectrum.significant_height = 0.2;
    spectrum.peak_period = 2.0;
    spectrum.spreading = 4.0;
    spectrum.components = 20;
    return jonswap_sea(spectrum, 5.0, 9.81, 0.5);
}

const Vec3 kShip(0.0, 0.0, 0.2);
const double kFirstLength = 3.0;  // m out

/// In a rough tank: a faired line with measured characteristics, on a winch if `paid_out` says how much is out, which ends
/// at a weathervane just above the floor; from there a stiff line, clamped to the second of two bodies, the first of which the tow point holds.
std::shared_ptr<const Model> rough_tow(double length, const std::optional<double>& paid_out) {
    Water water;
    water.waves = sea();
    water.current.uniform = {0.05, 0.0, 0.0};
    water.current.profile.emplace("profile", std::vector<std::pair<double, Vec3>>{{0.0, {0.1, 0, 0}}, {-5.0, {0, 0, 0}}});
    water.current.series.emplace("series", std::vector<std::pair<double, Vec3>>{{0.0, {0, 0, 0}}, {9.0, {0, 0.1, 0}}});
    ModelBuilder builder{water};
    Tank tank;
    tank.floor = -3.5;
    tank.width = 6.0;
    tank.ends = {-50.0, 50.0};
    tank.stiffness = 1e4;
    tank.damping = 0.5;
    tank.friction = 0.3;
    builder.set_tank(tank);
    builder.add_prescribed_point("ship");
    builder.add_free_point("depressor", {9.0, 0.697e-3, Weathervane{{0.004, 0.01, 0.01}, {0.3, 0.6, 0.6}, 0.05}});
    builder.add_body("float", finned_fish());
    builder.add_body("fish", tabled_fish());
    LineProperties measured = cable(length);
    measured.axial_stiffness = Table{{0.0, 0.0}, {0.01, 1e3}, {0.02, 4e3}};
    measured.normal_drag = Table{{1e2, 1.2}, {1e5, 1.0}};
    measured.tangential_drag = Table{{1e2, 0.02}, {1e5, 0.01}};
    measured.lift = 0.05;
    builder.add_line("wound", {"ship", {}, {}}, {"depressor", {}, {}}, {{measured, 16}});
    if (paid_out) builder.add_winch("wound", *paid_out);
    LineProperties stiff = cable(1.2);
    stiff.bending_stiffness = 0.05;
    const Vec3 nose(0.65, 0.0, 0.0);
    builder.add_line("stiff", {"depressor", {}, {}}, {"fish", nose, Vec3(-Vec3::UnitX())}, {{stiff, 4}});
    builder.add_line("second", {"ship", {}, {}}, {"float", nose, {}}, {{cable(2.0), 4}});
    return std::make_shared<const Model>(builder.build());
}

ResponseOperators operators() {
    std::array<std::vector<double>, 6> amplitude, phase;
    for (std::size_t motion = 0; motion < 6; ++motion) {
        amplitude[motion] = {motion < 3 ? 0.4 : 0.1, motion < 3 ? 0.2 : 0.0};
        phase[motion] = {0.0, 1.0};
    }
    return {{0.1, 100.0}, {0.0}, amplitude, phase};
}

const Vec3 kAhead(1.0, 0.0, 0.0);
const ShipInSea kShipInSea(kShip, kAhead, sea(), operators(), Vec3(-2.0, 0.3, 0.5), 0.0);

void test_chosen_steps_and_balances() {
    const auto model = rough_tow(3.5, {});
    const double tolerance = 0.05;
    Simulator simulator(steady_tow(model, {kShip}, kAhead), std::make_shared<GeneralizedAlpha>(0.8), 0.02, NewtonSettings{},
                        StepControl{1e-4, 1e-6}, EnergyWatch{tolerance});
    const Recording recording = record_run(simulator, {&kShipInSea}, 2.0, 0.1);
    check(simulator.statistics().rejections > 0, "steps are chosen by their error");
    const EnergyBalance& balance = recording.energy.back();
    check(recording.energy.size() == 21 && std::abs(balance.numerical) <= tolerance * balance.exchanged,
          "and the energy is accounted for");
}

void test_winch_and_contact() {
    const auto model = rough_tow(8.0, kFirstLength);
    Simulator simulator(steady_tow(model, {kShip}, kAhead), std::make_shared<GeneralizedAlpha>(0.8), 0.01, NewtonSettings{});
    simulator.set_payout("wound", std::make_shared<SteadyPayout>(kFirstLength, 5.0, 1.0, 0.0, 0.2));
    const Recording out = record_run(simulator, {&kShipInSea}, 2.5, 0.1);
    check(out.paid_out.back() == 5.0 && simulator.state().winches[0].drum == 6, "a winch pays out in a sea");
    check(!simulator.contacts().events().empty(), "the depressor touches the floor");

    simulator.restore(simulator.state().save());
    simulator.set_payout("wound", std::make_shared<PayoutSeries>(Table{{2.5, 5.0}, {4.5, 2.5}}));
    const Vec3 ahead = simulator.state().position[model->free_sites] + 0.1 * kAhead;
    simulator.step_to(2.6, ahead, kAhead);
    const SteadyTow on(ahead - 2.6 * kAhead, kAhead, 0.0);
    simulator.step(4.6, {&on});
    check(simulator.state().winches[0].drum == 11, "and hauls in again, live and by a law");
}

/// Velocity is the derivative of position, and acceleration that of velocity, to the error of central differences.
void test_laws_of_motion() {
    const Vec3 velocity(1.5, 0.0, 0.0);
    const SteadyTow steady(kShip, velocity, 1.0);
    const EmergencyStop stop(kShip, velocity, 2.0, 1.5, 1.0);
    const auto turn = std::make_shared<Turn>(kShip, velocity, 0.5, 2.0, 2.0, 0.5, 0.0);
    const auto heave = std::make_shared<Sinusoid>(Vec3(Vec3::Zero()), Vec3(Vec3::Zero()), 0.1, 1.6, 0.0, 1.0, 0.0);
    const MotionSum both({turn, heave});
    const TimeSeries series({0.0, 2.0, 4.0}, {kShip, kShip + velocity, kShip}, {velocity, Vec3(Vec3::Zero()), velocity});
    const double d = 1e-5;  // s; the third derivatives are below 100 m/s³, so the error is below 1e-8
    bool alike = true;
    for (const Motion* law : {static_cast<const Motion*>(&steady), static_cast<const Motion*>(&stop),
                              static_cast<const Motion*>(&both), static_cast<const Motion*>(&series),
                              static_cast<const Motion*>(&kShipInSea), static_cast<const Motion*>(&kCrank)}) {
        for (double time = 0.05; time < 4.0; time += 0.0973) {
            const MotionSample before = law->at(time - d), now = law->at(time), after = law->at(time + d);
            alike &= ((after.position - before.position) / (2 * d) - now.velocity).norm() < 1e-7;
            alike &= ((after.velocity - before.velocity) / (2 * d) - now.acceleration).norm() < 1e-7;
        }
    }
    check(alike, "velocity and acceleration follow from the position in every law of motion");
}

}  // namespace

int main() {
    const auto model = everything();
    const State start = steady_tow(model, {kTowPoint}, kVelocity);
    test_integrators(start);
    test_saved_states(start);
    test_damaged_states();
    test_halved_steps(start);
    test_snap();
    test_records(start);
    test_chosen_steps_and_balances();
    test_winch_and_contact();
    test_laws_of_motion();
    return failures == 0 ? 0 : 1;
}
