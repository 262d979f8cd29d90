// SPDX-License-Identifier: Apache-2.0
#include "recorder.hpp"

#include <cmath>

#include "error.hpp"

namespace sim_core {

namespace {

void append(Recording& recording, const Simulator& simulator) {
    const State& state = simulator.state();
    recording.time.push_back(state.time);
    const auto add = [](std::vector<double>& to, const std::vector<Vec3>& from) {
        for (const Vec3& value : from) to.insert(to.end(), value.data(), value.data() + 3);
    };
    add(recording.position, state.position);
    add(recording.velocity, state.velocity);
    add(recording.acceleration, state.acceleration);
    for (const State::BodyState& body : state.bodies) {
        const Quat& q = body.attitude;
        recording.attitude.insert(recording.attitude.end(), {q.w(), q.x(), q.y(), q.z()});
    }
    if (simulator.balance()) {
        recording.energy.push_back(simulator.balance()->energy());
        recording.momentum.push_back(simulator.balance()->momentum());
    }
    for (const WinchState& winch : state.winches) recording.paid_out.push_back(winch.paid_out);
    const Model& model = simulator.model();
    const Equations& equations = simulator.equations();
    for (std::size_t i = 0; i < model.segments.size(); ++i) {
        recording.tension.push_back(equations.tension(static_cast<int>(i)));
    }
    for (int i = 0; i < model.prescribed_sites; ++i) {
        const Vec3 load = equations.hook_load(i);
        recording.hook_load.insert(recording.hook_load.end(), load.data(), load.data() + 3);
    }
    for (std::size_t i = 0; i < model.lines.size(); ++i) {
        const int line = static_cast<int>(i);
        for (const int end : {0, 1}) recording.end_tension.push_back(equations.end_tension(line, end));
        if (!model.lines[i].bends_anywhere()) continue;
        for (int node = 0; node <= model.lines[i].segments; ++node) {
            const Equations::Bending bending = equations.bending(line, node);
            recording.bending_moment.push_back(bending.moment);
            recording.curvature.push_back(bending.curvature);
        }
    }
}

}  // namespace

Recording record_run(Simulator& simulator, const Motions& motions, double t_end, double output_step) {
    if (!(output_step > 0.0)) throw InvalidInput("output_step must be above 0 s");
    const double start = simulator.state().time;
    if (!std::isfinite(t_end) || t_end < start) throw InvalidInput("t_end must not lie before the start");
    const auto samples = static_cast<long long>(std::ceil((t_end - start) / output_step * (1.0 - 1e-12)));
    Recording recording;
    append(recording, simulator);
    for (long long i = 1; i <= samples; ++i) {
        const double time = i == samples ? t_end : start + static_cast<double>(i) * output_step;
        simulator.step(time, motions);
        append(recording, simulator);
    }
    return recording;
}

}  // namespace sim_core
