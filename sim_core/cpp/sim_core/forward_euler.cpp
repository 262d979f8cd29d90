// SPDX-License-Identifier: Apache-2.0
#include "forward_euler.hpp"

namespace sim_core {

void ForwardEuler::predict(State& state, double h) const {
    for (int block = 0; block < state.model->blocks(); ++block) {
        const int i = state.entry_of_block(block);
        state.position[i] += h * state.velocity[i];
        state.velocity[i] += h * state.acceleration[i];
        state.auxiliary[i] = state.acceleration[i];
    }
    state.follow_bodies();
}

void ForwardEuler::correct(State& state, const std::vector<Vec3>& acceleration, double factor, double) const {
    for (int block = 0; block < state.model->blocks(); ++block) {
        const int i = state.entry_of_block(block);
        state.acceleration[i] += factor * acceleration[block];
        state.auxiliary[i] = state.acceleration[i];
    }
    state.follow_bodies();
}

}  // namespace sim_core
