// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alpha_family.hpp"

namespace sim_core {

/// Generalised-α (Chung & Hulbert 1993, J. Appl. Mech. 60, 371–375): second order, unconditionally stable for linear
/// systems, spectral radius ρ∞ at infinite frequency. ρ∞ = 1 damps nothing, ρ∞ = 0 annihilates what the
/// step does not resolve.
///
///   αm = (2ρ∞ − 1)/(ρ∞ + 1),   αf = ρ∞/(ρ∞ + 1),   γ = ½ + αf − αm,   β = ¼ (1 + αf − αm)²
class GeneralizedAlpha : public AlphaFamily {
  public:
    /// Throws InvalidInput unless 0 ≤ rho_inf ≤ 1.
    explicit GeneralizedAlpha(double rho_inf = 0.8);

    double rho_inf() const { return rho_inf_; }

  private:
    static Weights weights(double rho_inf);
    double rho_inf_;
};

}  // namespace sim_core
