// SPDX-License-Identifier: Apache-2.0
#include "forces_by_kind.hpp"

#include <algorithm>

#include "bending.hpp"

namespace sim_core {

ForcesByKind::ForcesByKind(const Model& model) {
    forces_.fill(std::vector<Vec3>(model.sites() + 2 * model.bodies.size(), Vec3::Zero()));
    std::size_t most_places = 1;
    for (const Model::BodyEntry& body : model.bodies) {
        most_places = std::max(most_places, static_cast<std::size_t>(body.force.water_places()));
    }
    resting_water_.resize(most_places);
}

void ForcesByKind::evaluate(const Equations& equations, const State& state) {
    for (std::vector<Vec3>& forces : forces_) {
        for (Vec3& force : forces) force.setZero();
    }
    add_segments(equations, state);
    add_points(equations, state);
    add_bodies(equations, state);
    add_bending(state);
    add_joints(state);
    find_other(equations, state);
}

void ForcesByKind::add_segments(const Equations& equations, const State& state) {
    const Model& m = *state.model;
    const Vec3 none = Vec3::Zero();
    SegmentCache whole, undamped, drifting, resting;
    for (const Model::Segment& segment : m.segments) {
        const SegmentConstants& c = m.segment_constants[segment.constants];
        SegmentConstants elastic = c;
        elastic.axial_damping = 0.0;
        const int a = segment.site[0];
        const int b = segment.site[1];
        const Vec3& x_a = state.position[a];
        const Vec3& x_b = state.position[b];
        const WaterMotion& water_a = equations.water_at(a);
        const WaterMotion& water_b = equations.water_at(b);
        const EndMotion a_end{x_a, state.velocity[a], state.acceleration[a], water_a};
        const EndMotion b_end{x_b, state.velocity[b], state.acceleration[b], water_b};
        segment_forces(c, a_end, b_end, whole);
        segment_forces(elastic, a_end, b_end, undamped);
        segment_forces(elastic, {x_a, water_a.velocity, state.acceleration[a], water_a},
                       {x_b, water_b.velocity, state.acceleration[b], water_b}, drifting);
        segment_forces(elastic, {x_a, water_a.velocity, none, water_a}, {x_b, water_b.velocity, none, water_b},
                       resting);
        const EndCache* ends[4][2] = {{&whole.a, &whole.b}, {&undamped.a, &undamped.b},
                                      {&drifting.a, &drifting.b}, {&resting.a, &resting.b}};
        for (int i = 0; i < 2; ++i) {
            const int site = segment.site[i];
            const Vec3 pull = (i == 0 ? 1.0 : -1.0) * resting.tension * resting.tangent;
            const Vec3 weight(0.0, 0.0, -c.half_weight);
            const Vec3 inertia = -c.half_mass * state.acceleration[site];
            at(ForceKind::weight)[site] += weight;
            at(ForceKind::inertia)[site] += inertia;
            at(ForceKind::elastic)[site] += pull;
            at(ForceKind::damping)[site] += ends[0][i]->force - ends[1][i]->force;
            at(ForceKind::drag)[site] += ends[1][i]->force - ends[2][i]->force;
            at(ForceKind::added_mass)[site] += ends[2][i]->force - ends[3][i]->force - inertia;
            at(ForceKind::buoyancy)[site] += ends[3][i]->force - pull - weight;
        }
    }
}

void ForcesByKind::add_points(const Equations& equations, const State& state) {
    const Model& m = *state.model;
    PointCache whole, drifting, resting;
    for (const Model::Point& point : m.points) {
        if (point.prescribed) continue;
        const FreePoint& p = point.properties;
        const int site = point.site;
        const Vec3& x = state.position[site];
        const WaterMotion& here = equations.water_at(site);
        point_force(p, m.water, here, x, state.velocity[site], state.acceleration[site], whole);
        point_force(p, m.water, here, x, state.velocity[site], Vec3::Zero(), drifting);
        point_force(p, m.water, here, x, here.velocity, Vec3::Zero(), resting);
        const Vec3 weight(0.0, 0.0, -p.mass * m.water.gravity);
        const Vec3 inertia = -p.mass * state.acceleration[site];
        at(ForceKind::weight)[site] += weight;
        at(ForceKind::inertia)[site] += inertia;
        // The added mass of a weathervane hangs on its velocity, so the acceleration is taken away first.
        at(ForceKind::added_mass)[site] += whole.force - drifting.force - inertia;
        at(ForceKind::drag)[site] += drifting.force - resting.force;
        at(ForceKind::buoyancy)[site] += resting.force - weight;
    }
}

void ForcesByKind::add_bodies(const Equations& equations, const State& state) {
    const Model& m = *state.model;
    const Vec3 none = Vec3::Zero();
    BodyJacobian unused;
    for (std::size_t i = 0; i < m.bodies.size(); ++i) {
        const BodyForce& force = m.bodies[i].force;
        const Body& body = force.body();
        const int entry = state.body_entry(static_cast<int>(i));
        const Mat3 R = state.bodies[i].attitude.toRotationMatrix();
        const Vec3& x = state.position[entry];
        const Vec3& v = state.velocity[entry];
        const Vec3& a = state.acceleration[entry];
        const Vec3& w = state.velocity[entry + 1];
        const Vec3& alpha = state.acceleration[entry + 1];
        const std::vector<WaterMotion>& along = equations.water_along(static_cast<int>(i));
        resting_water_ = along;
        for (WaterMotion& water : resting_water_) water.velocity.setZero();
        Vec3 whole[2], moving[2], resting[2];
        force.evaluate(m.water, along, {x, R, v, a, w, alpha}, whole[0], whole[1], unused);
        force.evaluate(m.water, along, {x, R, v, none, w, none}, moving[0], moving[1], unused);
        force.evaluate(m.water, resting_water_, {x, R, none, none, none, none}, resting[0], resting[1], unused);
        const Vec3& c = body.centre_of_gravity;
        const Vec3 weight(0.0, 0.0, -body.mass * m.water.gravity);
        const Vec3 linear[2] = {Vec3(-body.mass * (a + R * alpha.cross(c))),
                                Vec3(-body.inertia * alpha - body.mass * c.cross(R.transpose() * a))};
        const Vec3 centrifugal[2] = {Vec3(-body.mass * (R * w.cross(w.cross(c)))), Vec3(-w.cross(body.inertia * w))};
        const Vec3 weights[2] = {weight, c.cross(R.transpose() * weight)};
        for (int part = 0; part < 2; ++part) {
            at(ForceKind::weight)[entry + part] += weights[part];
            at(ForceKind::inertia)[entry + part] += linear[part] + centrifugal[part];
            at(ForceKind::added_mass)[entry + part] += whole[part] - moving[part] - linear[part];
            at(ForceKind::drag)[entry + part] += moving[part] - resting[part] - centrifugal[part];
            at(ForceKind::buoyancy)[entry + part] += resting[part] - weights[part];
        }
    }
}

void ForcesByKind::add_bending(const State& state) {
    const Model& m = *state.model;
    std::vector<Vec3>& elastic = at(ForceKind::elastic);
    BendingCache spring;
    for (const Model::Bend& joint : m.bends) {
        const Vec3& middle = state.position[joint.site[1]];
        bend(joint.stiffness, middle - state.position[joint.site[0]], state.position[joint.site[2]] - middle, spring);
        elastic[joint.site[0]] += spring.energy_slope[0];
        elastic[joint.site[1]] += spring.energy_slope[1] - spring.energy_slope[0];
        elastic[joint.site[2]] -= spring.energy_slope[1];
    }
    for (const Model::Clamp& clamp : m.clamps) {
        bend(clamp.stiffness, state.clamp_direction(clamp),
             state.position[clamp.site[1]] - state.position[clamp.site[0]], spring);
        elastic[clamp.site[0]] += spring.energy_slope[1];
        elastic[clamp.site[1]] -= spring.energy_slope[1];
        if (!m.is_attached(clamp.site[0])) continue;
        const int body = m.attachments[m.attachment_of(clamp.site[0])].body;
        elastic[state.body_entry(body) + 1] -=
            clamp.direction.cross(state.bodies[body].attitude.conjugate() * spring.energy_slope[0]);
    }
}

void ForcesByKind::add_joints(const State& state) {
    const Vec3 none = Vec3::Zero();
    for (const Model::Joint& joint : state.model->joints) {
        const int a = joint.site[0];
        const int b = joint.site[1];
        const Vec3 spring = joint.pull(state.position[a], state.position[b], none, none);
        const Vec3 dashpot = joint.pull(none, none, state.velocity[a], state.velocity[b]);
        at(ForceKind::elastic)[a] += spring;
        at(ForceKind::elastic)[b] -= spring;
        at(ForceKind::damping)[a] += dashpot;
        at(ForceKind::damping)[b] -= dashpot;
    }
}

void ForcesByKind::find_other(const Equations& equations, const State& state) {
    const Model& m = *state.model;
    std::vector<Vec3>& other = at(ForceKind::other);
    for (int site = 0; site < m.sites(); ++site) other[site] = equations.site_force(site);
    for (std::size_t i = 0; i < m.bodies.size(); ++i) {
        const int body = static_cast<int>(i);
        other[state.body_entry(body)] = equations.residual()[m.translation_block(body)];
        other[state.body_entry(body) + 1] = equations.residual()[m.rotation_block(body)];
    }
    for (std::size_t i = 0; i < m.attachments.size(); ++i) {
        const Model::Attachment& attachment = m.attachments[i];
        const int entry = state.body_entry(attachment.body);
        const Vec3& force = equations.site_force(m.first_attached_site() + static_cast<int>(i));
        other[entry] -= force;
        other[entry + 1] -= attachment.place.cross(state.bodies[attachment.body].attitude.conjugate() * force);
    }
    for (int kind = 0; kind < kForceKinds; ++kind) {
        if (kind == static_cast<int>(ForceKind::other)) continue;
        for (std::size_t entry = 0; entry < other.size(); ++entry) other[entry] -= forces_[kind][entry];
    }
}

}  // namespace sim_core
