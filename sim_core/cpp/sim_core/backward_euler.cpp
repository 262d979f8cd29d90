// SPDX-License-Identifier: Apache-2.0
#include "backward_euler.hpp"

namespace sim_core {

void BackwardEuler::predict(State& state, double h) const {
    for (int block = 0; block < state.model->blocks(); ++block) {
        const int i = state.entry_of_block(block);
        state.position[i] += h * state.velocity[i];
        state.acceleration[i].setZero();
        state.auxiliary[i].setZero();
    }
    state.follow_bodies();
}

void BackwardEuler::correct(State& state, const std::vector<Vec3>& displacement, double factor, double h) const {
    const Rates r = rates(h);
    for (int block = 0; block < state.model->blocks(); ++block) {
        const int i = state.entry_of_block(block);
        const Vec3 d = factor * displacement[block];
        state.position[i] += d;
        state.velocity[i] += r.velocity * d;
        state.acceleration[i] += r.acceleration * d;
        state.auxiliary[i] = state.acceleration[i];
    }
    state.follow_bodies();
}

}  // namespace sim_core
