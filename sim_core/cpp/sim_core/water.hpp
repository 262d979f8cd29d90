// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "current.hpp"
#include "sea.hpp"
#include "types.hpp"
#include "wave_kernel.hpp"

namespace sim_core {

/// What the water does at one place and time, tank axes. Gradients: row i, column j is the derivative of
/// component i with respect to coordinate j.
struct WaterMotion {
    Vec3 velocity = Vec3::Zero();             ///< u, m/s
    Vec3 acceleration = Vec3::Zero();         ///< ∂u/∂t, m/s²
    Mat3 velocity_gradient = Mat3::Zero();    ///< 1/s
    Mat3 acceleration_gradient = Mat3::Zero();  ///< 1/s²
    /// Derivatives of velocity_gradient with respect to the three coordinates, 1/(m s). Found only where it is asked for.
    std::array<Mat3, 3> velocity_curvature = {Mat3::Zero(), Mat3::Zero(), Mat3::Zero()};
    double elevation = 0.0;                   ///< of the surface above still water, m
    double elevation_x = 0.0;                 ///< its slopes
    double elevation_y = 0.0;

    /// Derivative of the height above the surface with respect to the place.
    Vec3 height_slope() const { return {-elevation_x, -elevation_y, 1.0}; }
};

/// The water below the surface: a current, and waves on it. Tank axes: x along the run, z up, z = 0 at still water.
struct Water {
    double density = 1000.0;   ///< kg/m³
    double gravity = 9.81;     ///< m/s²
    Current current;
    std::optional<Sea> waves;
    double kinematic_viscosity = 1.0e-6;  ///< m²/s; fresh water of 20 °C

    /// The same motion everywhere and always: WaterMotion of the uniform current.
    bool is_uniform_and_steady() const { return !waves && current.is_uniform_and_steady(); }

    /// Whether it changes in time.
    bool changes() const { return waves || current.series; }

    /// This water without waves, and with its current as it is at a time (s).
    Water calm(double time) const;
};

/// Asks the water what it does at many places at one instant. Holds the workspace of one simulation: nothing is
/// allocated after construction.
///
/// Waves are linear (Airy), in the tank's frame, added to the current without interaction. Above and below still water
/// Wheeler's stretching applies (Wheeler 1970, J. Petrol. Technol. 22, 359–367): velocity, acceleration and their
/// gradients are those of linear theory at the height z' = (z − ζ) d/(d + ζ). A place above the surface has the motion of the
/// surface below it.
class WaterProbe {
  public:
    explicit WaterProbe(const Water& water);
    WaterProbe(const Water& water, const WaveKernel& kernel);

    /// The instant (s) of what is asked next.
    void set_time(double time);

    /// With `curved`, the velocity's curvature, too.
    void at(const Vec3& position, WaterMotion& motion, bool curved = false);

  private:
    void add_waves(const Vec3& position, WaterMotion& motion, bool curved);

    Current current_;
    Vec3 series_velocity_ = Vec3::Zero();      // of the current at this instant
    Vec3 series_acceleration_ = Vec3::Zero();
    double depth_ = 0.0;
    double ramp_time_ = 0.0;
    double strength_ = 1.0;       // of the waves at this instant, from the ramp
    double strength_rate_ = 0.0;  // 1/s
    // Per train, and filled up with trains of no amplitude
    std::vector<double> k_, k_x_, k_y_, frequency_, phase_, decay_, finite_, phase_now_;
    std::vector<double> weights_;  // rows of the kernel
    std::vector<double> room_;
    WaveKernel kernel_;
};

/// Immersed fraction of something that reaches `half_height` up and down from its centre.
struct Wetness {
    double fraction;  ///< 0 dry … 1 immersed
    double slope;     ///< derivative with respect to the dimensionless depth
};

/// Of a sphere, exactly: a cubic. `depth` is that of the centre below the surface divided by the half height. Used for what is
/// neither sphere nor circle, too: it has a continuous slope, which the Newton iteration needs, and is right in the mean for
/// any symmetric section; half segments of lines are off by at most 0.04 (level) and 0.10 (steep) of themselves.
inline Wetness wetness(double depth) {
    if (depth >= 1.0) return {1.0, 0.0};
    if (depth <= -1.0) return {0.0, 0.0};
    return {0.5 + depth * (0.75 - 0.25 * depth * depth), 0.75 * (1.0 - depth * depth)};
}

/// Of a circle: the area of its segment below the surface.
inline Wetness circle_wetness(double depth) {
    if (depth >= 1.0) return {1.0, 0.0};
    if (depth <= -1.0) return {0.0, 0.0};
    const double half_chord = std::sqrt(1.0 - depth * depth);
    return {0.5 + std::numbers::inv_pi * (std::asin(depth) + depth * half_chord),
            2.0 * std::numbers::inv_pi * half_chord};
}

}  // namespace sim_core
