// SPDX-License-Identifier: Apache-2.0
#include "equations.hpp"

#include <array>
#include <cmath>
#include <limits>

#include "rotation.hpp"

namespace sim_core {

namespace {

/// How an attached end moves with its body: position, velocity and acceleration of the end per rotation unknown.
struct AttachedEnd {
    Mat3 position, velocity, acceleration;
    Mat3 arm;           ///< moment in body axes of a force in tank axes
    Mat3 moment_turn;   ///< change of the moment of the present force per rotation unknown
};

AttachedEnd attached_end(const State& state, const Model::Attachment& attachment, const Vec3& force,
                         const Rates& rates) {
    const int entry = state.body_entry(attachment.body);
    const Mat3 R = state.bodies[attachment.body].attitude.toRotationMatrix();
    const Mat3 T = rates.position * right_jacobian(state.position[entry + 1]);
    const Vec3& omega = state.velocity[entry + 1];
    const Vec3& alpha = state.acceleration[entry + 1];
    const Vec3& r = attachment.place;
    const Vec3 spin = omega.cross(r);
    const Mat3 r_cross = skew(r);
    AttachedEnd end;
    end.position = -R * r_cross * T;
    end.velocity = -R * (skew(spin) * T + rates.velocity * r_cross);
    end.acceleration = -R * (skew(alpha.cross(r) + omega.cross(spin)) * T +
                             rates.velocity * (skew(spin) + skew(omega) * r_cross) + rates.acceleration * r_cross);
    end.arm = r_cross * R.transpose();
    end.moment_turn = r_cross * skew(R.transpose() * force) * T;
    return end;
}

/// Adds a derivative to the block (row, column) of an element's unknowns, if there is one.
template <int Blocks>
void add(std::vector<Mat3>& J, const int (&slot)[Blocks][Blocks], int row, int column, const Mat3& value) {
    if (slot[row][column] >= 0) J[slot[row][column]] += value;
}

/// Adds an element of `Sites` sites whose forces depend on their positions only: stiffness[i][j] is the derivative of
/// the force at site i with respect to the position of site j.
template <int Sites>
void add_elastic(std::vector<Mat3>& J, const State& state, const int (&site)[Sites],
                 const int (&slot)[2 * Sites][2 * Sites], const Vec3 (&force)[Sites],
                 const Mat3 (&stiffness)[Sites][Sites], const Rates& rates) {
    const Model& m = *state.model;
    AttachedEnd end[Sites];
    bool attached[Sites];
    for (int i = 0; i < Sites; ++i) {
        attached[i] = m.is_attached(site[i]);
        if (attached[i]) end[i] = attached_end(state, m.attachments[m.attachment_of(site[i])], force[i], rates);
    }
    for (int row = 0; row < Sites; ++row) {
        for (int column = 0; column < Sites; ++column) {
            const Mat3 translation = rates.position * stiffness[row][column];
            add(J, slot, 2 * row, 2 * column, translation);
            if (attached[row]) add(J, slot, 2 * row + 1, 2 * column, end[row].arm * translation);
            if (!attached[column]) continue;
            const Mat3 rotation = stiffness[row][column] * end[column].position;
            add(J, slot, 2 * row, 2 * column + 1, rotation);
            if (attached[row]) add(J, slot, 2 * row + 1, 2 * column + 1, end[row].arm * rotation);
        }
        if (attached[row]) add(J, slot, 2 * row + 1, 2 * row + 1, end[row].moment_turn);
    }
}

/// Adds what comes from the turning of the direction at a line's end that is clamped to a body, and the body's moment
/// there.
void add_turning_clamp(std::vector<Mat3>& J, const State& state, const Model::Clamp& clamp, const BendingCache& spring,
                       const BendingJacobian& h, const Rates& rates) {
    const Model& m = *state.model;
    const Model::Attachment& attachment = m.attachments[m.attachment_of(clamp.site[0])];
    const Mat3 R = state.bodies[attachment.body].attitude.toRotationMatrix();
    const Mat3 T = rates.position * right_jacobian(state.position[state.body_entry(attachment.body) + 1]);
    const Mat3 e_cross = skew(clamp.direction);
    const Mat3 turn = -R * e_cross * T;  // of the direction, per rotation unknown
    const AttachedEnd own = attached_end(state, attachment, spring.energy_slope[1], rates);

    const Mat3 force = h.mixed.transpose() * turn;
    add(J, clamp.slot, 0, 1, force);
    add(J, clamp.slot, 1, 1, own.arm * force);
    add(J, clamp.slot, 2, 1, -force);

    const Mat3 moment = -e_cross * R.transpose();
    const Mat3 stretch = moment * h.mixed;  // moment per span
    add(J, clamp.slot, 1, 0, -rates.position * stretch);
    add(J, clamp.slot, 1, 2, rates.position * stretch);
    add(J, clamp.slot, 1, 1,
        moment * h.first * turn - stretch * own.position - e_cross * skew(R.transpose() * spring.energy_slope[0]) * T);
    if (m.is_attached(clamp.site[1])) {
        const AttachedEnd other =
            attached_end(state, m.attachments[m.attachment_of(clamp.site[1])], -spring.energy_slope[1], rates);
        add(J, clamp.slot, 3, 1, -other.arm * force);
        add(J, clamp.slot, 1, 3, stretch * other.position);
    }
}

}  // namespace

Equations::Equations(std::shared_ptr<const Model> model)
    : model_(std::move(model)),
      solver_(model_->structure),
      constants_(model_->segment_constants),
      segments_(model_->segments.size()),
      bends_(model_->bends.size()),
      clamps_(model_->clamps.size()),
      joint_pulls_(model_->joints.size()),
      points_(model_->points.size()),
      bodies_(model_->bodies.size()),
      probe_(model_->water),
      same_water_(model_->water.is_uniform_and_steady()),
      water_(same_water_ ? 1 : model_->sites()),
      water_along_(model_->bodies.size()),
      contacts_(model_->contact_places.size()),
      site_force_(model_->sites()),
      residual_(model_->blocks()),
      pull_(model_->blocks()),
      block_length_(model_->blocks(), 1.0) {
    for (const Model::Segment& segment : model_->segments) constants_of_.push_back(segment.constants);
    on_drum_.resize(model_->lines.size(), 0);
    constants_.resize(constants_.size() + model_->winches.size());
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        block_length_[model_->rotation_block(static_cast<int>(b))] = 0.5 * model_->bodies[b].force.body().length;
    }
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        water_along_[b].resize(same_water_ ? 1 : model_->bodies[b].force.water_places());
    }
    if (same_water_) {
        probe_.at(Vec3::Zero(), water_[0]);
        for (auto& along : water_along_) along[0] = water_[0];
    }
}

void Equations::ask_water(const State& state) {
    probe_.set_time(state.time);
    for (int i = 0; i < model_->sites(); ++i) probe_.at(state.position[i], water_[i]);
    for (std::size_t b = 0; b < model_->bodies.size(); ++b) {
        const Vec3& origin = state.position[state.body_entry(static_cast<int>(b))];
        const Mat3 rotation = state.bodies[b].attitude.toRotationMatrix();
        const BodyForce& force = model_->bodies[b].force;
        for (int i = 0; i < force.water_places(); ++i) {
            const bool curved = force.feels_curvature() && i < force.body().strips;
            probe_.at(origin + rotation * force.water_place(i), water_along_[b][static_cast<std::size_t>(i)], curved);
        }
    }
}

void Equations::follow_winches(const State& state) {
    const Model& m = *model_;
    for (std::size_t w = 0; w < m.winches.size(); ++w) {
        const Winch& winch = m.winches[w];
        const WinchState& now = state.winches[w];
        const int nominal = m.segments[winch.first_segment].constants;
        const int changing = static_cast<int>(m.segment_constants.size() + w);
        for (int i = 0; i < winch.segments; ++i) constants_of_[winch.first_segment + i] = nominal;
        constants_of_[winch.first_segment + now.drum] = changing;
        on_drum_[winch.line] = now.drum;
        set_changing_segment(constants_[nominal], now.changing_length(winch), now.rate, constants_[changing]);
    }
}

void Equations::evaluate(const State& state) {
    const Model& m = *model_;
    if (!m.winches.empty()) follow_winches(state);
    if (!same_water_) ask_water(state);
    for (Vec3& force : site_force_) force.setZero();
    for (std::size_t i = 0; i < m.segments.size(); ++i) {
        const int a = m.segments[i].site[0];
        const int b = m.segments[i].site[1];
        segment_forces(constants_[constants_of_[i]],
                       {state.position[a], state.velocity[a], state.acceleration[a], water_at(a)},
                       {state.position[b], state.velocity[b], state.acceleration[b], water_at(b)}, segments_[i]);
        site_force_[a] += segments_[i].a.force;
        site_force_[b] += segments_[i].b.force;
    }
    for (std::size_t i = 0; i < m.bends.size(); ++i) {
        const int* site = m.bends[i].site;
        const Vec3& middle = state.position[site[1]];
        BendingCache& spring = bends_[i];
        bend(m.bends[i].stiffness, middle - state.position[site[0]], state.position[site[2]] - middle, spring);
        site_force_[site[0]] += spring.energy_slope[0];
        site_force_[site[1]] += spring.energy_slope[1] - spring.energy_slope[0];
        site_force_[site[2]] -= spring.energy_slope[1];
    }
    for (std::size_t i = 0; i < m.clamps.size(); ++i) {
        const int* site = m.clamps[i].site;
        BendingCache& spring = clamps_[i];
        bend(m.clamps[i].stiffness, state.clamp_direction(m.clamps[i]), state.position[site[1]] - state.position[site[0]],
             spring);
        site_force_[site[0]] += spring.energy_slope[1];
        site_force_[site[1]] -= spring.energy_slope[1];
    }
    for (std::size_t i = 0; i < m.joints.size(); ++i) {
        const int a = m.joints[i].site[0];
        const int b = m.joints[i].site[1];
        joint_pulls_[i] =
            m.joints[i].pull(state.position[a], state.position[b], state.velocity[a], state.velocity[b]);
        site_force_[a] += joint_pulls_[i];
        site_force_[b] -= joint_pulls_[i];
    }
    for (std::size_t i = 0; i < m.points.size(); ++i) {
        if (m.points[i].prescribed) continue;
        const int site = m.points[i].site;
        point_force(m.points[i].properties, m.water, water_at(site), state.position[site], state.velocity[site],
                    state.acceleration[site], points_[i]);
        site_force_[site] += points_[i].force;
    }
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
        const int site = m.contact_places[i].site;
        contact_force(*m.tank, m.tank_sides, m.contact_places[i].size, state.position[site], state.velocity[site],
                      contacts_[i]);
        site_force_[site] += contacts_[i].force;
    }
    for (int i = 0; i < m.free_sites; ++i) residual_[i] = site_force_[i];
    for (std::size_t w = 0; w < m.winches.size(); ++w) {
        const Model::Line& line = m.lines[m.winches[w].line];
        const int drum = state.winches[w].drum;
        const SegmentCache& changing = segments_[line.first_segment + drum];
        for (int i = 0; i < drum; ++i) {
            residual_[line.sites[i + 1]].setZero();
            // what is on the drum is shown as it comes off it
            segments_[line.first_segment + i].tension = changing.tension;
            segments_[line.first_segment + i].tension_slope = changing.tension_slope;
        }
    }
    for (std::size_t b = 0; b < m.bodies.size(); ++b) {
        const int body = static_cast<int>(b);
        const int entry = state.body_entry(body);
        const Mat3 rotation = state.bodies[b].attitude.toRotationMatrix();
        m.bodies[b].force.evaluate(m.water, water_along_[b],
                                   {state.position[entry], rotation, state.velocity[entry], state.acceleration[entry],
                                    state.velocity[entry + 1], state.acceleration[entry + 1]},
                                   residual_[m.translation_block(body)], residual_[m.rotation_block(body)],
                                   bodies_[b]);
    }
    for (std::size_t i = 0; i < m.attachments.size(); ++i) {
        const Model::Attachment& attachment = m.attachments[i];
        const Vec3& force = site_force_[m.first_attached_site() + i];
        residual_[m.translation_block(attachment.body)] += force;
        residual_[m.rotation_block(attachment.body)] +=
            attachment.place.cross(state.bodies[attachment.body].attitude.conjugate() * force);
    }
    for (std::size_t i = 0; i < m.clamps.size(); ++i) {
        if (!m.is_attached(m.clamps[i].site[0])) continue;
        const int body = m.attachments[m.attachment_of(m.clamps[i].site[0])].body;
        residual_[m.rotation_block(body)] -=
            m.clamps[i].direction.cross(state.bodies[body].attitude.conjugate() * clamps_[i].energy_slope[0]);
    }
}

int Equations::end_segment(int index, int end) const {
    const Model::Line& line = model_->lines[index];
    return line.first_segment + (end == 0 ? on_drum_[index] : line.segments - 1);
}

Vec3 Equations::end_force(int index, int end) const {
    const Model::Line& line = model_->lines[index];
    const SegmentCache& segment = segments_[end_segment(index, end)];
    Vec3 force = end == 0 ? segment.a.force : segment.b.force;
    const int next = line.bends[end == 0 ? 1 : line.segments - 1];
    if (next >= 0) force += end == 0 ? bends_[next].energy_slope[0] : -bends_[next].energy_slope[1];
    if (line.clamps[end] >= 0) force += clamps_[line.clamps[end]].energy_slope[1];
    return force;
}

double Equations::end_tension(int index, int end) const {
    const Model::Line& line = model_->lines[index];
    const LineSection& section = end == 0 ? line.sections.front() : line.sections.back();
    const Vec3 force = end_force(index, end);
    if (section.properties.bending_stiffness == 0.0) return force.norm();
    if (line.clamps[end] >= 0) return force.dot(clamps_[line.clamps[end]].tangent[0]);
    const Vec3& tangent = segments_[end_segment(index, end)].tangent;
    return end == 0 ? force.dot(tangent) : -force.dot(tangent);
}

Vec3 Equations::hook_load(int prescribed_point) const {
    const int site = model_->free_sites + prescribed_point;
    Vec3 load = Vec3::Zero();
    for (std::size_t i = 0; i < model_->lines.size(); ++i) {
        const Model::Line& line = model_->lines[i];
        if (line.sites.front() == site) load += end_force(static_cast<int>(i), 0);
        if (line.sites.back() == site) load += end_force(static_cast<int>(i), 1);
    }
    for (std::size_t i = 0; i < model_->joints.size(); ++i) {
        if (model_->joints[i].site[0] == site) load += joint_pulls_[i];
        if (model_->joints[i].site[1] == site) load -= joint_pulls_[i];
    }
    return load;
}

Equations::Bending Equations::bending(int index, int node) const {
    const Model::Line& line = model_->lines[index];
    const auto of = [](double stiffness, double length, const BendingCache& spring) {
        const double angle = std::atan2(spring.tangent[0].cross(spring.tangent[1]).norm(), spring.cosine);
        return Bending{stiffness * angle, angle / length};
    };
    if (line.bends[node] >= 0) {
        const Model::Bend& spring = model_->bends[line.bends[node]];
        return of(spring.stiffness, spring.length, bends_[line.bends[node]]);
    }
    const int clamp = node == 0 ? line.clamps[0] : node == line.segments ? line.clamps[1] : -1;
    if (clamp < 0) return {0.0, 0.0};
    return of(model_->clamps[clamp].stiffness, model_->clamps[clamp].length, clamps_[clamp]);
}

double Equations::residual_norm(int& where) const {
    double largest = 0.0;
    where = 0;
    for (std::size_t i = 0; i < residual_.size(); ++i) {
        const double size = residual_[i].squaredNorm() / (block_length_[i] * block_length_[i]);
        if (!(size <= largest)) {  // also true for NaN
            largest = size;
            where = static_cast<int>(i);
            if (!std::isfinite(size)) return std::numeric_limits<double>::infinity();
        }
    }
    return std::sqrt(largest);
}

double Equations::largest_displacement(const std::vector<Vec3>& displacement, int& where) const {
    double largest = 0.0;
    where = 0;
    for (std::size_t i = 0; i < displacement.size(); ++i) {
        const double size = displacement[i].squaredNorm() * block_length_[i] * block_length_[i];
        if (!(size <= largest)) {  // also true for NaN
            largest = size;
            where = static_cast<int>(i);
        }
    }
    return std::sqrt(largest);
}

double Equations::displacement_norm(const std::vector<Vec3>& displacement) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < displacement.size(); ++i) {
        sum += displacement[i].squaredNorm() * block_length_[i] * block_length_[i];
    }
    return std::sqrt(sum / static_cast<double>(displacement.size()));
}

void Equations::assemble(const State& state, const Rates& rates) {
    const Model& m = *model_;
    std::vector<Mat3>& J = solver_.blocks();
    for (Mat3& block : J) block.setZero();

    SegmentJacobian& s = segment_jacobian_;
    for (std::size_t i = 0; i < m.segments.size(); ++i) {
        const Model::Segment& segment = m.segments[i];
        segment_jacobian(constants_[constants_of_[i]], segments_[i], s);
        if (!same_water_) {
            add_water_gradients(constants_[constants_of_[i]], segments_[i], water_at(segment.site[0]),
                                water_at(segment.site[1]), s);
        }
        if (m.is_attached(segment.site[0]) || m.is_attached(segment.site[1])) {
            add_attached_pair(state, segment.site, segment.slot, segments_[i].a.force, segments_[i].b.force, s, rates);
            continue;
        }
        for (int end = 0; end < 2; ++end) {
            const int own = segment.slot[2 * end][2 * end];
            if (own < 0) continue;
            J[own] += rates.position * s.position[end][end] + rates.velocity * s.velocity[end][end] +
                      rates.acceleration * s.acceleration[end];
            const int other = segment.slot[2 * end][2 - 2 * end];
            if (other >= 0) J[other] += rates.position * s.position[end][1 - end] + rates.velocity * s.velocity[end][1 - end];
        }
    }

    if (!m.bends.empty() || !m.clamps.empty()) add_bending(state, rates);
    add_joints(state, rates);
    add_contacts(state, rates);

    for (std::size_t i = 0; i < m.points.size(); ++i) {
        if (m.points[i].prescribed) continue;
        PointJacobian p;
        point_jacobian(m.points[i].properties, m.water, water_at(m.points[i].site), points_[i], p);
        J[m.points[i].site] +=
            rates.position * p.position + rates.velocity * p.velocity + rates.acceleration * p.acceleration;
    }

    for (std::size_t b = 0; b < m.bodies.size(); ++b) {
        const int translation = m.translation_block(static_cast<int>(b));
        const int rotation = m.rotation_block(static_cast<int>(b));
        const BodyJacobian& body = bodies_[b];
        const Mat3 T = rates.position * right_jacobian(state.position[state.body_entry(static_cast<int>(b)) + 1]);
        const int rows[2] = {translation, rotation};
        for (int row = 0; row < 2; ++row) {
            J[m.structure.slot(rows[row], translation)] += rates.position * body.position.block<3, 3>(3 * row, 0) +
                                                           rates.velocity * body.velocity.block<3, 3>(3 * row, 0) +
                                                           rates.acceleration *
                                                               body.acceleration.block<3, 3>(3 * row, 0);
            J[m.structure.slot(rows[row], rotation)] += body.position.block<3, 3>(3 * row, 3) * T +
                                                        rates.velocity * body.velocity.block<3, 3>(3 * row, 3) +
                                                        rates.acceleration *
                                                            body.acceleration.block<3, 3>(3 * row, 3);
        }
    }
    if (!m.winches.empty()) hold_drums(state);
}

void Equations::hold_drums(const State& state) {
    const Model& m = *model_;
    std::vector<Mat3>& J = solver_.blocks();
    for (std::size_t w = 0; w < m.winches.size(); ++w) {
        const Model::Line& line = m.lines[m.winches[w].line];
        for (int node = 1; node <= state.winches[w].drum; ++node) {
            const int before = m.segments[line.first_segment + node - 1].slot[2][0];
            const int after = m.segments[line.first_segment + node].slot[0][2];
            if (before >= 0) J[before].setZero();
            if (after >= 0) J[after].setZero();
            J[line.sites[node]].setIdentity();
        }
    }
}

void Equations::add_attached_pair(const State& state, const int (&site)[2], const int (&slot)[4][4],
                                  const Vec3& force_a, const Vec3& force_b, const SegmentJacobian& s,
                                  const Rates& rates) {
    const Model& m = *model_;
    std::vector<Mat3>& J = solver_.blocks();
    const Vec3* force[2] = {&force_a, &force_b};
    AttachedEnd end[2];
    for (int i = 0; i < 2; ++i) {
        if (m.is_attached(site[i])) {
            end[i] = attached_end(state, m.attachments[m.attachment_of(site[i])], *force[i], rates);
        }
    }
    for (int row = 0; row < 2; ++row) {
        const bool row_attached = m.is_attached(site[row]);
        for (int column = 0; column < 2; ++column) {
            const Mat3 own_acceleration = row == column ? s.acceleration[row] : Mat3(Mat3::Zero());
            const Mat3 translation = rates.position * s.position[row][column] + rates.velocity * s.velocity[row][column] +
                                     rates.acceleration * own_acceleration;
            add(J, slot, 2 * row, 2 * column, translation);
            if (row_attached) add(J, slot, 2 * row + 1, 2 * column, end[row].arm * translation);
            if (!m.is_attached(site[column])) continue;
            const Mat3 rotation = s.position[row][column] * end[column].position +
                                  s.velocity[row][column] * end[column].velocity +
                                  own_acceleration * end[column].acceleration;
            add(J, slot, 2 * row, 2 * column + 1, rotation);
            if (row_attached) add(J, slot, 2 * row + 1, 2 * column + 1, end[row].arm * rotation);
        }
        if (row_attached) add(J, slot, 2 * row + 1, 2 * row + 1, end[row].moment_turn);
    }
}

void Equations::add_joints(const State& state, const Rates& rates) {
    SegmentJacobian j;
    for (Mat3& acceleration : j.acceleration) acceleration.setZero();
    for (std::size_t i = 0; i < model_->joints.size(); ++i) {
        const Model::Joint& joint = model_->joints[i];
        for (int row = 0; row < 2; ++row) {
            for (int column = 0; column < 2; ++column) {
                const double sign = row == column ? -1.0 : 1.0;
                j.position[row][column] = sign * joint.stiffness * Mat3::Identity();
                j.velocity[row][column] = sign * joint.damping * Mat3::Identity();
            }
        }
        add_attached_pair(state, joint.site, joint.slot, joint_pulls_[i], -joint_pulls_[i], j, rates);
    }
}

void Equations::add_contacts(const State& state, const Rates& rates) {
    const Model& m = *model_;
    std::vector<Mat3>& J = solver_.blocks();
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
        const ContactForce& c = contacts_[i];
        const int site = m.contact_places[i].site;
        if (c.force.isZero(0.0)) continue;
        const Mat3 translation = rates.position * c.position + rates.velocity * c.velocity;
        if (m.is_free(site)) {
            J[site] += translation;
            continue;
        }
        const Model::Attachment& attachment = m.attachments[m.attachment_of(site)];
        const int blocks[2] = {m.translation_block(attachment.body), m.rotation_block(attachment.body)};
        const auto block = [&](int row, int column) -> Mat3& { return J[m.structure.slot(blocks[row], blocks[column])]; };
        const AttachedEnd end = attached_end(state, attachment, c.force, rates);
        const Mat3 rotation = c.position * end.position + c.velocity * end.velocity;
        block(0, 0) += translation;
        block(1, 0) += end.arm * translation;
        block(0, 1) += rotation;
        block(1, 1) += end.arm * rotation + end.moment_turn;
    }
}

void Equations::add_bending(const State& state, const Rates& rates) {
    const Model& m = *model_;
    std::vector<Mat3>& J = solver_.blocks();
    BendingJacobian h;
    for (std::size_t i = 0; i < m.bends.size(); ++i) {
        const BendingCache& spring = bends_[i];
        bending_jacobian(spring, h);
        const Vec3& first = spring.energy_slope[0];
        const Vec3& second = spring.energy_slope[1];
        const Mat3 mixed_t = h.mixed.transpose();
        const Mat3 stiffness[3][3] = {
            {-h.first, h.first - h.mixed, h.mixed},
            {h.first - mixed_t, h.mixed + mixed_t - h.first - h.second, h.second - h.mixed},
            {mixed_t, h.second - mixed_t, -h.second}};
        add_elastic<3>(J, state, m.bends[i].site, m.bends[i].slot, {first, second - first, -second}, stiffness, rates);
    }
    for (std::size_t i = 0; i < m.clamps.size(); ++i) {
        const BendingCache& spring = clamps_[i];
        bending_jacobian(spring, h);
        const Vec3& force = spring.energy_slope[1];
        const Mat3 stiffness[2][2] = {{-h.second, h.second}, {h.second, -h.second}};
        add_elastic<2>(J, state, m.clamps[i].site, m.clamps[i].slot, {force, -force}, stiffness, rates);
        if (m.is_attached(m.clamps[i].site[0])) add_turning_clamp(J, state, m.clamps[i], spring, h, rates);
    }
}

double Equations::mobility(const State& state, int index) {
    const Model& m = *model_;
    const Model::Segment& segment = m.segments[index];
    const Vec3& t = segments_[index].tangent;
    struct Part {
        int block;
        Vec3 direction;
    };
    std::array<Part, 4> parts;
    std::size_t count = 0;
    for (int end = 0; end < 2; ++end) {
        const Vec3 pull = end == 0 ? t : Vec3(-t);
        const int site = segment.site[end];
        if (m.is_free(site)) {
            if (state.moves_freely(site)) parts[count++] = {site, pull};
        } else if (m.is_attached(site)) {
            const Model::Attachment& attachment = m.attachments[m.attachment_of(site)];
            const Quat& attitude = state.bodies[attachment.body].attitude;
            parts[count++] = {m.translation_block(attachment.body), pull};
            parts[count++] = {m.rotation_block(attachment.body), attachment.place.cross(attitude.conjugate() * pull)};
        }
    }
    for (Vec3& value : pull_) value.setZero();
    for (std::size_t i = 0; i < count; ++i) pull_[parts[i].block] += parts[i].direction;
    solver_.solve(pull_);
    double sum = 0.0;
    for (std::size_t i = 0; i < count; ++i) sum -= parts[i].direction.dot(pull_[parts[i].block]);  // J is −M
    return sum;
}

void Equations::solve(std::vector<Vec3>& displacement) const {
    for (std::size_t i = 0; i < residual_.size(); ++i) displacement[i] = -residual_[i];
    solver_.solve(displacement);
}

}  // namespace sim_core
