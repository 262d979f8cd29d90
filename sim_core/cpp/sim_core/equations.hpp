// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "bending.hpp"
#include "block_solver.hpp"
#include "model.hpp"
#include "state.hpp"

namespace sim_core {

/// How position, velocity and acceleration follow the unknowns of a linear system. An implicit scheme
/// solves for positions, so {1, dv/dx, da/dx}; {0, 0, 1} gives the mass matrix.
struct Rates {
    double position;
    double velocity;      ///< 1/s
    double acceleration;  ///< 1/s²
};

/// The equations of motion F(position, velocity, acceleration) = external forces − inertia = 0, with their
/// analytic Jacobian. Holds the workspace for one simulation; nothing is allocated after construction.
class Equations {
  public:
    explicit Equations(std::shared_ptr<const Model> model);

    /// Evaluates F at the state (whose attachments must follow its bodies) into residual().
    void evaluate(const State& state);

    /// Per block: force in tank axes (N), or moment about the body's origin in body axes (N·m).
    const std::vector<Vec3>& residual() const { return residual_; }

    /// Sum of the forces of segments, springs and points on a site, N, tank axes; inertia included.
    const Vec3& site_force(int site) const { return site_force_[site]; }

    /// Largest residual, N; moments are divided by half the body's length. `where` gets its block.
    double residual_norm(int& where) const;

    /// Largest block of a displacement, m; rotations count with half the body's length. `where` gets its block.
    double largest_displacement(const std::vector<Vec3>& displacement, int& where) const;

    /// Root mean square over blocks, m; rotations count with half the body's length.
    double displacement_norm(const std::vector<Vec3>& displacement) const;

    /// Assembles the matrix of dF for dx = rates.position u, dv = rates.velocity u, da = rates.acceleration u at
    /// the last evaluated state.
    void assemble(const State& state, const Rates& rates);
    const std::vector<Mat3>& jacobian_blocks() const { return solver_.blocks(); }

    /// Factors the assembled Jacobian (in place) and solves J dx = −residual.
    void factor() { solver_.factor(); }
    void solve(std::vector<Vec3>& displacement) const;

    /// Tension of a segment at the last evaluated state, N.
    double tension(int segment) const { return segments_[segment].tension; }

    /// What a line's start (0) or end (1) pulls with on what holds it, N, tank axes: the tension of the segment there, with
    /// weight, water and inertia of its outer half, and the shear of bending. What is on a drum does not count.
    Vec3 end_force(int line, int end) const;

    /// Effective tension at the very end of a line, N: of a limp line the size of its end_force, which has no other
    /// direction; with bending stiffness the part along the line there.
    double end_tension(int line, int end) const;

    /// Sum of the end forces of the lines and joints at a prescribed point, by its number, N, tank axes.
    Vec3 hook_load(int prescribed_point) const;

    /// Bending moment (N·m) and curvature (1/m) at a node of a line.
    struct Bending {
        double moment, curvature;
    };
    Bending bending(int line, int node) const;
    /// How much a unit of tension in a segment changes the rate at which its ends move apart: Σ 1/m over the masses that
    /// it pulls, added mass and turning bodies included, 1/kg. The matrix of the masses, {0, 0, 1}, must be factored.
    double mobility(const State& state, int segment);
    /// Stiffness of a segment at the last evaluated state as it would be if taut, N/m.
    double axial_stiffness(int segment) const {
        return segments_[segment].axial_stiffness / constants_[constants_of_[segment]].length;
    }

    /// Whether a segment is fully taut (beyond the rounding of its tension at slack) at the last evaluated state.
    bool taut(int segment) const { return segments_[segment].tension_slope == 1.0; }

    const Model& model() const { return *model_; }

    /// What the water does at a site, and at the water places of a body, at the last evaluated state.
    const WaterMotion& water_at(int site) const { return water_[same_water_ ? 0 : site]; }
    const std::vector<WaterMotion>& water_along(int body) const { return water_along_[body]; }

  private:
    void ask_water(const State& state);
    void add_attached_pair(const State& state, const int (&site)[2], const int (&slot)[4][4], const Vec3& force_a,
                           const Vec3& force_b, const SegmentJacobian& jacobian, const Rates& rates);
    void add_joints(const State& state, const Rates& rates);
    void add_bending(const State& state, const Rates& rates);
    void add_contacts(const State& state, const Rates& rates);
    void follow_winches(const State& state);
    int end_segment(int line, int end) const;
    void hold_drums(const State& state);

    std::shared_ptr<const Model> model_;
    BlockSolver solver_;
    /// Those of the model and, at the end, one for the changing segment of each winch.
    std::vector<SegmentConstants> constants_;
    std::vector<int> constants_of_;  ///< per segment
    std::vector<int> on_drum_;       ///< per line: segments on a drum
    std::vector<SegmentCache> segments_;
    std::vector<BendingCache> bends_;
    std::vector<BendingCache> clamps_;
    std::vector<Vec3> joint_pulls_;  ///< on the first place of each joint, N
    std::vector<PointCache> points_;  ///< those of prescribed points are unused
    std::vector<BodyJacobian> bodies_;
    WaterProbe probe_;
    bool same_water_;  ///< everywhere and always
    std::vector<WaterMotion> water_;  ///< at the sites; one for all if it is the same
    std::vector<std::vector<WaterMotion>> water_along_;  ///< likewise, at each body's water places
    std::vector<ContactForce> contacts_;  ///< of the model's contact places
    std::vector<Vec3> site_force_;
    std::vector<Vec3> residual_;
    std::vector<Vec3> pull_;  ///< room for mobility
    std::vector<double> block_length_;  ///< 1 for a translation, half the body's length for a rotation
    SegmentJacobian segment_jacobian_;
};

}  // namespace sim_core
