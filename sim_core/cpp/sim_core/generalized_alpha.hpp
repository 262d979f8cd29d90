// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator.hpp"

namespace sim_core {

/// Generalised-α (Chung & Hulbert 1993, J. Appl. Mech. 60, 371–375), in the form of Arnold & Brüls (2007,
/// Multibody Syst. Dyn. 18, 185–202): second order, unconditionally stable for linear systems, spectral radius
/// ρ∞ at infinite frequency. ρ∞ = 1 damps nothing (trapezoidal rule), ρ∞ = 0 annihilates what the step does not resolve.
///
///   q₁ = q₀ + h v₀ + h² ((½ − β) a₀ + β a₁),   v₁ = v₀ + h ((1 − γ) a₀ + γ a₁)
///   (1 − αm) a₁ + αm a₀ = (1 − αf) v̇₁ + αf v̇₀,   M v̇₁ = F(q₁, v₁, t₁)
///
/// The equations of motion hold exactly at the end of each step, with the physical acceleration v̇ there; a is
/// the method's own. For a linear system with constant mass this is the scheme of 1993; with a mass
/// matrix that turns with the cable it stays second order.
class GeneralizedAlpha : public Integrator {
  public:
    /// Throws InvalidInput unless 0 ≤ rho_inf ≤ 1.
    explicit GeneralizedAlpha(double rho_inf = 0.8);

    double rho_inf() const { return rho_inf_; }

    Rates rates(double h) const override {
        return {1.0, gamma_ / (beta_ * h), (1.0 - alpha_m_) / ((1.0 - alpha_f_) * beta_ * h * h)};
    }
    /// First guess: the acceleration stays.
    void predict(State& state, double h) const override;
    void correct(State& state, const std::vector<Vec3>& displacement, double factor, double h) const override;

  private:
    double rho_inf_;
    double alpha_m_;
    double alpha_f_;
    double beta_;
    double gamma_;
};

}  // namespace sim_core
