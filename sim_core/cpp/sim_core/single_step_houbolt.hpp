// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alpha_family.hpp"

namespace sim_core {

/// The single-step form of Houbolt's method (Chung & Hulbert 1994, Comput. Methods Appl. Mech. Eng. 118, 1–11; Houbolt
/// 1950, J. Aeronaut. Sci. 17, 540–550): annihilates what the step does not resolve.
///
///   q₁ = q₀ + h v₀ + h² (β₀ â₀ + β₁ â₁),   v₁ = v₀ + h (γ₀ â₀ + γ₁ â₁),   M (â₁ − ½ â₀) = F₁/(2β₁)
///   β₁ = ½ (½ + γ₁),   β₀ = ½ − β₁,   γ₀ = ½ (½ − γ₁)
///
/// On an undamped linear system positions obey Houbolt's recurrence for every γ₁. γ₁ = 3/2 is second order and the same as
/// generalised-α with ρ∞ = 0. Otherwise v₁ is the velocity a fraction of the step off (by ½ (1/β₁ − 1) h), which
/// leaves first order in what starts with a velocity or is damped. Here a = β₁ â, which tends to v̇.
class SingleStepHoubolt : public AlphaFamily {
  public:
    /// Throws InvalidInput unless ½ ≤ gamma_1 ≤ 3/2.
    explicit SingleStepHoubolt(double gamma_1 = 1.5);

    double gamma_1() const { return gamma_1_; }

  private:
    static Weights weights(double gamma_1);
    double gamma_1_;
};

}  // namespace sim_core
