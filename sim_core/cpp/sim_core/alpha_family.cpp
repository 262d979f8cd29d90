// SPDX-License-Identifier: Apache-2.0
#include "alpha_family.hpp"

namespace sim_core {

void AlphaFamily::predict(State& state, double h) const {
    // a lags v̇ by (αm − αf) h: rescale the lag when the step size changes, which keeps second order.
    const double lag_ratio = state.last_step > 0.0 ? h / state.last_step : 1.0;
    for (int block = 0; block < state.model->blocks(); ++block) {
        const int i = state.entry_of_block(block);
        const Vec3 rate = state.acceleration[i];
        const Vec3 a0 = rate + lag_ratio * (state.auxiliary[i] - rate);
        const Vec3 a1 = (rate - w_.alpha_m * a0) / (1.0 - w_.alpha_m);
        state.position[i] += h * state.velocity[i] + (h * h) * (w_.position_start * a0 + w_.position_end * a1);
        state.velocity[i] += h * (w_.velocity_start * a0 + w_.velocity_end * a1);
        state.auxiliary[i] = a1;
    }
    state.follow_bodies();
}

void AlphaFamily::correct(State& state, const std::vector<Vec3>& displacement, double factor, double h) const {
    const Rates r = rates(h);
    const double velocity_factor = factor * r.velocity;
    const double acceleration_factor = factor * r.acceleration;
    const double auxiliary_factor = factor / (w_.position_end * h * h);
    for (int block = 0; block < state.model->blocks(); ++block) {
        const int i = state.entry_of_block(block);
        const Vec3& d = displacement[block];
        state.position[i] += factor * d;
        state.velocity[i] += velocity_factor * d;
        state.acceleration[i] += acceleration_factor * d;
        state.auxiliary[i] += auxiliary_factor * d;
    }
    state.follow_bodies();
}

}  // namespace sim_core
