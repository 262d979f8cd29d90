// SPDX-License-Identifier: Apache-2.0
// The step allocates nothing, and the block solver solves what it should.
// With the argument "time" it prints the cost of a step instead.
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>
#include <random>

#include "sim_core/box.hpp"
#include "sim_core/generalized_alpha.hpp"
#include "sim_core/heave.hpp"
#include "sim_core/simulator.hpp"
#include "sim_core/statics.hpp"

namespace {

std::atomic<long> allocations{0};

int failures = 0;

void check(bool holds, const char* what) {
    std::printf("%s: %s\n", holds ? "ok" : "FAILED", what);
    if (!holds) ++failures;
}

using namespace sim_core;

/// A two-part tow with a fish on fins, `segments` in all.
std::shared_ptr<const Model> two_part_tow(int segments, const Water& water = {}, const std::optional<Tank>& tank = {}) {
    ModelBuilder builder{water};
    if (tank) builder.set_tank(*tank);
    builder.add_prescribed_point("tow_point");
    builder.add_free_point("junction", {});
    builder.add_free_point("depressor", {5.25, 0.697e-3, FixedAxes{Vec3::Constant(0.0045), Vec3::Constant(0.35)}});
    Body fish;
    fish.mass = 12.5;
    fish.inertia = Vec3(0.02, 1.8, 1.8).asDiagonal();
    fish.centre_of_gravity = {0.0, 0.0, -0.01};
    fish.volume = 0.0125;
    fish.diameter = 0.11;
    fish.length = 1.3;
    fish.added_mass.diagonal() << 0.6, 12.5, 12.5, 0.0, 1.7, 1.7;
    fish.axial_drag = 1.0;
    fish.cross_flow_drag = 1.1;
    for (const double side : {-0.1, 0.1}) {
        Fin fin;
        fin.position = {-0.55, side, 0.0};
        fin.area = 0.012;
        fin.lift_slope = 3.0;
        fin.drag = 0.02;
        fin.stall_angle = 0.3;
        fish.fins.push_back(fin);
        fin.position = {-0.55, 0.0, side};
        fin.normal = Vec3::UnitY();
        fish.fins.push_back(fin);
    }
    builder.add_body("fish", fish);
    LineProperties cable;
    cable.diameter = 0.009;
    cable.mass_per_length = 0.15;
    cable.axial_stiffness = 628e3;
    const int secondary = segments / 3;
    const int depressor = segments / 10;
    cable.length = 2.84;
    builder.add_line("primary", {"tow_point", {}, {}}, {"junction", {}, {}}, {{cable, segments - secondary - depressor}});
    cable.length = 0.3;
    builder.add_line("depressor_cable", {"junction", {}, {}}, {"depressor", {}, {}}, {{cable, depressor}});
    cable.length = 1.5;
    builder.add_line("secondary", {"junction", {}, {}}, {"fish", Vec3(0.65, 0.0, 0.0), {}}, {{cable, secondary}});
    return std::make_shared<const Model>(builder.build());
}

Simulator start(int segments, std::shared_ptr<const Integrator> integrator, const Water& water = {},
                const std::optional<Tank>& tank = {}) {
    const auto model = two_part_tow(segments, water, tank);
    const State state = steady_tow(model, {Vec3(0, 0, -2)}, Vec3(1.75, 0, 0));
    return {state, std::move(integrator), 0.005, NewtonSettings{}};
}

const Sinusoid kMotion(Vec3(0, 0, -2), Vec3(1.75, 0, 0), 0.1, 1.6, 0.0, 3.0, 0.0);

/// Waves of so many trains on a current that varies over depth and in time.
Water moving_water(int trains) {
    Jonswap spectrum;
    spectrum.significant_height = 0.3;
    spectrum.peak_period = 2.0;
    spectrum.components = trains;
    Water water;
    water.waves = jonswap_sea(spectrum, 5.0, water.gravity, 2.0);
    water.current.profile.emplace("profile", std::vector<std::pair<double, Vec3>>{{0.0, {0.1, 0, 0}}, {-5.0, {0, 0, 0}}});
    water.current.series.emplace("series", std::vector<std::pair<double, Vec3>>{{0.0, {0, 0, 0}}, {9.0, {0, 0.1, 0}}});
    return water;
}

void test_step_allocates_nothing(std::shared_ptr<const Integrator> integrator, const Water& water = {},
                                 const std::optional<Tank>& tank = {}) {
    Simulator simulator = start(40, std::move(integrator), water, tank);
    const Motions motions{&kMotion};
    simulator.step(0.01, motions);
    const long before = allocations;
    simulator.step(8.0, motions);
    simulator.step_to(8.005, kMotion.at(8.005).position, kMotion.at(8.005).velocity);
    check(allocations == before, "stepping allocates no memory");
    check(simulator.statistics().newton_iterations >= simulator.statistics().steps, "and does iterate");
    if (tank) check(!simulator.contacts().events().empty(), "and touches the floor");
}

void test_a_running_winch_allocates_nothing() {
    ModelBuilder builder{Water{}};
    builder.add_prescribed_point("winch");
    FreePoint weight{};
    weight.mass = 5.0;
    builder.add_free_point("weight", weight);
    LineProperties cable;
    cable.length = 20.0;
    cable.diameter = 0.01;
    cable.mass_per_length = 0.2;
    cable.axial_stiffness = Table{{0.0, 0.0}, {0.01, 1e3}, {0.02, 4e3}};
    cable.normal_drag = Table{{1e2, 1.2}, {1e5, 1.0}};
    builder.add_line("line", {"winch", {}, {}}, {"weight", {}, {}}, {{cable, 20}});
    builder.add_winch("line", 5.0);
    const auto model = std::make_shared<const Model>(builder.build());
    const State state = steady_tow(model, {Vec3(0, 0, -1)}, Vec3(1, 0, 0));
    Simulator simulator(state, std::make_shared<GeneralizedAlpha>(0.8), 0.005, NewtonSettings{});
    simulator.set_payout("line", std::make_shared<SteadyPayout>(5.0, 12.0, 1.0, 0.0, 1.0));
    const SteadyTow tow(Vec3(0, 0, -1), Vec3(1, 0, 0), 0.0);
    const Motions motions{&tow};
    simulator.step(0.01, motions);
    const long before = allocations;
    simulator.step(9.0, motions);
    check(allocations == before, "nor does a winch that releases nodes");
    check(simulator.state().winches[0].drum == 8, "and it does release them");
}

/// A random matrix on a ring with a tail (fill-in needed) against a dense solution.
void test_block_solver_with_a_closed_loop() {
    const int size = 9;
    std::vector<std::pair<int, int>> couplings;
    for (int i = 0; i < 6; ++i) couplings.emplace_back(i, (i + 1) % 6);
    for (int i = 5; i < 8; ++i) couplings.emplace_back(i, i + 1);
    const BlockStructure structure(size, couplings);
    BlockSolver solver(structure);
    std::mt19937 generator(1);
    std::uniform_real_distribution<double> random(-1.0, 1.0);
    const auto fill = [&](Mat3& block, double diagonal) {
        for (int k = 0; k < 9; ++k) block(k) = random(generator);
        block += diagonal * Mat3::Identity();
    };
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(3 * size, 3 * size);
    for (Mat3& block : solver.blocks()) block.setZero();
    for (int i = 0; i < size; ++i) fill(solver.blocks()[i], 8.0);
    for (const auto& [i, j] : couplings) {
        fill(solver.blocks()[structure.slot(i, j)], 0.0);
        fill(solver.blocks()[structure.slot(j, i)], 0.0);
    }
    for (int i = 0; i < size; ++i) {
        for (int j = 0; j < size; ++j) {
            if (structure.slot(i, j) >= 0) dense.block<3, 3>(3 * i, 3 * j) = solver.blocks()[structure.slot(i, j)];
        }
    }
    std::vector<Vec3> x(size);
    Eigen::VectorXd right(3 * size);
    for (int i = 0; i < size; ++i) right.segment<3>(3 * i) = x[i] = Vec3::Random();
    solver.factor();
    solver.solve(x);
    const Eigen::VectorXd expected = dense.lu().solve(right);
    double error = 0.0;
    for (int i = 0; i < size; ++i) error = std::max(error, (x[i] - expected.segment<3>(3 * i)).norm());
    check(error < 1e-13, "block elimination solves a closed loop");
}

void test_tree_has_no_fill() {
    const auto model = two_part_tow(100);
    // One block per unknown block, two per coupling: a chain of segments, and 3 couplings at the fish.
    const int blocks = model->blocks();
    check(model->structure.slots() == blocks + 2 * (100 - 1 - 1 + 3), "a tree of lines needs no fill-in");
}

void print_cost(const Water& water, std::initializer_list<int> sizes) {
    for (const int segments : sizes) {
        Simulator simulator = start(segments, std::make_shared<GeneralizedAlpha>(0.8), water);
        const Motions motions{&kMotion};
        simulator.step(4.0, motions);
        double best = 1e300;
        double iterations = 0.0;
        for (int i = 0; i < 5; ++i) {
            const StepStatistics before = simulator.statistics();
            const auto begin = std::chrono::steady_clock::now();
            simulator.step(simulator.state().time + 2.0, motions);
            const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
            const double steps = static_cast<double>(simulator.statistics().steps - before.steps);
            iterations = (simulator.statistics().newton_iterations - before.newton_iterations) / steps;
            best = std::min(best, took.count() / steps);
        }
        std::printf("%5d segments: %7.1f us a step, %.2f Newton iterations\n", segments, best * 1e6, iterations);
    }
}

}  // namespace

// Counting versions of the global allocation functions.
void* operator new(std::size_t size) {
    ++allocations;
    if (void* p = std::malloc(size)) return p;
    throw std::bad_alloc();
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }

int main(int argc, char** argv) {
    if (argc > 1 && std::strcmp(argv[1], "time") == 0) {
        print_cost({}, {20, 40, 80, 160, 320, 640, 1280});
        for (const int trains : {1, 50, 200}) {
            std::printf("in waves of %d trains:\n", trains);
            print_cost(moving_water(trains), {40, 320});
        }
        return 0;
    }
    test_step_allocates_nothing(std::make_shared<GeneralizedAlpha>(0.8));
    test_step_allocates_nothing(std::make_shared<Box>());  // a step in two parts
    Tank tank;
    tank.floor = -4.0;  // between where the depressor runs and where its heave takes it
    tank.stiffness = 1e4;
    test_step_allocates_nothing(std::make_shared<GeneralizedAlpha>(0.8), moving_water(50), tank);
    test_a_running_winch_allocates_nothing();
    test_block_solver_with_a_closed_loop();
    test_tree_has_no_fill();
    return failures == 0 ? 0 : 1;
}
