// SPDX-License-Identifier: Apache-2.0
#include "generalized_alpha.hpp"

#include "error.hpp"

namespace sim_core {

GeneralizedAlpha::GeneralizedAlpha(double rho_inf) : rho_inf_(rho_inf) {
    if (!(rho_inf >= 0.0 && rho_inf <= 1.0)) throw InvalidInput("rho_inf must lie between 0 and 1");
    alpha_m_ = (2.0 * rho_inf - 1.0) / (rho_inf + 1.0);
    alpha_f_ = rho_inf / (rho_inf + 1.0);
    gamma_ = 0.5 + alpha_f_ - alpha_m_;
    beta_ = 0.25 * (1.0 + alpha_f_ - alpha_m_) * (1.0 + alpha_f_ - alpha_m_);
}

void GeneralizedAlpha::predict(State& state, double h) const {
    // a lags v̇ by (αm − αf) h: rescale the lag when the step size changes, which keeps second order.
    const double lag_ratio = state.last_step > 0.0 ? h / state.last_step : 1.0;
    for (int block = 0; block < state.model->blocks(); ++block) {
        const int i = state.entry_of_block(block);
        const Vec3 rate = state.acceleration[i];
        const Vec3 a0 = rate + lag_ratio * (state.auxiliary[i] - rate);
        const Vec3 a1 = (rate - alpha_m_ * a0) / (1.0 - alpha_m_);
        state.position[i] += h * state.velocity[i] + (h * h) * ((0.5 - beta_) * a0 + beta_ * a1);
        state.velocity[i] += h * ((1.0 - gamma_) * a0 + gamma_ * a1);
        state.auxiliary[i] = a1;
    }
    state.follow_bodies();
}

void GeneralizedAlpha::correct(State& state, const std::vector<Vec3>& displacement, double factor, double h) const {
    const double velocity_factor = factor * rates(h).velocity;
    const double acceleration_factor = factor * rates(h).acceleration;
    const double auxiliary_factor = factor / (beta_ * h * h);
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
