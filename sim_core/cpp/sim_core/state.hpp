// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "model.hpp"
#include "types.hpp"

namespace sim_core {

/// The motion of a whole system at one instant. Copies are exact and independent.
struct State {
    struct BodyState {
        Quat attitude = Quat::Identity();            ///< body axes → tank axes
        Quat step_start_attitude = Quat::Identity(); ///< attitude = step_start_attitude · exp(turn)
    };

    /// Everything rests at the origin until it is set.
    explicit State(std::shared_ptr<const Model> model);

    std::shared_ptr<const Model> model;
    double time = 0.0;       ///< s
    double last_step = 0.0;  ///< s, the size of the step that led here; 0 at a start
    double next_step = 0.0;   ///< s, what the step control proposes; 0 if it has not chosen yet
    double error_ratio = 1.0; ///< of the last step's error to the tolerance, the memory of the step control
    int damped_steps = 0;    ///< so many steps follow with implicit Euler (see Simulator), at most kMostDampedSteps
    static constexpr int kMostDampedSteps = 2;
    /// False after positions or velocities were set by hand: the simulator then first solves for
    /// the accelerations.
    bool accelerations_known = true;

    /// Sites (see Model), then per body two entries: translation, rotation. For a rotation the position is the
    /// turn since the start of the step (rotation vector, body axes, rad), the velocity the angular velocity in
    /// body axes, the acceleration its rate.
    std::vector<Vec3> position, velocity, acceleration;
    std::vector<Vec3> auxiliary;  ///< the integrator's algorithmic acceleration
    std::vector<BodyState> bodies;
    std::vector<WinchState> winches;

    int body_entry(int body) const { return model->sites() + 2 * body; }

    /// Index into the arrays above of a block of unknowns.
    int entry_of_block(int block) const {
        return block < model->free_sites ? block : block + model->prescribed_sites +
                                                       static_cast<int>(model->attachments.size());
    }

    /// Direction into the line at a clamped end, in tank axes.
    Vec3 clamp_direction(const Model::Clamp& clamp) const {
        if (!model->is_attached(clamp.site[0])) return clamp.direction;
        return bodies[model->attachments[model->attachment_of(clamp.site[0])].body].attitude * clamp.direction;
    }

    /// Moves attitude and attachments to where the bodies' entries say.
    void follow_bodies();

    /// Moves the nodes on drums to where their prescribed points are.
    void follow_drums();

    /// Releases or takes in a node of a winch's line if its changing segment has become too long or too short. The node
    /// moves with the line's material. False if there is nothing to do.
    bool wind(int winch);

    /// False for prescribed points and what rides with them on a drum.
    bool moves_freely(int site) const;

    /// Present unstretched length of a segment, m; 0 on a drum.
    double segment_length(int segment) const;
    /// Present unstretched length of a line, m.
    double line_length(int line) const;

    /// Makes the present attitude the reference of the turn (at the end of a step).
    void rebase_attitudes();

    bool finite() const;

    // Setting by name. Throws InvalidInput for an unknown name or values that are not finite.
    void set_time(double time);  ///< s
    void set_point(const std::string& name, const Vec3& position, const Vec3& velocity);
    void set_body(const std::string& name, const Vec3& position, const Quat& attitude, const Vec3& velocity,
                  const Vec3& angular_velocity);
    /// Inner node 1 … segments − 1 of a line.
    void set_line_node(const std::string& name, int node, const Vec3& position, const Vec3& velocity);

    /// The exact state as bytes, and back. restore throws InvalidInput if the bytes belong to a model that differs in any value, are
    /// damaged, or say what no state of this model can be; the state is then as it was.
    std::string save() const;
    void restore(const std::string& bytes);
};

}  // namespace sim_core
