// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator.hpp"

namespace sim_core {

/// The step that Newmark, HHT-α, generalised-α and the single-step Houbolt method share; they differ in its weights.
///
///   q₁ = q₀ + h v₀ + h² (p₀ a₀ + p₁ a₁),   v₁ = v₀ + h (w₀ a₀ + w₁ a₁)
///   (1 − αm) a₁ + αm a₀ = (1 − αf) v̇₁ + αf v̇₀,   M v̇₁ = F(q₁, v₁, t₁)
///
/// in the form of Arnold & Brüls (2007, Multibody Syst. Dyn. 18, 185–202): the equations of motion hold exactly at
/// the end of each step, with the physical acceleration v̇ there; a is the method's own. For a linear system with
/// constant mass this is the scheme as first published; with a mass matrix that turns with the cable it keeps its
/// order. Solved for positions.
class AlphaFamily : public SingleSolve {
  public:
    Rates rates(double h) const final {
        return {1.0, w_.velocity_end / (w_.position_end * h),
                (1.0 - w_.alpha_m) / ((1.0 - w_.alpha_f) * w_.position_end * h * h)};
    }
    /// First guess: the acceleration stays.
    void predict(State& state, double h) const final;
    void correct(State& state, const std::vector<Vec3>& displacement, double factor, double h) const final;

  protected:
    struct Weights {
        double alpha_m, alpha_f;
        double position_start, position_end;  ///< p₀, p₁ > 0
        double velocity_start, velocity_end;  ///< w₀, w₁
    };

    /// The weights of Newmark's formulas: p₁ = β, w₁ = γ.
    static Weights newmark_weights(double alpha_m, double alpha_f, double beta, double gamma) {
        return {alpha_m, alpha_f, 0.5 - beta, beta, 1.0 - gamma, gamma};
    }

    explicit AlphaFamily(const Weights& weights) : w_(weights) {}

  private:
    Weights w_;
};

}  // namespace sim_core
