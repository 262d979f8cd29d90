// SPDX-License-Identifier: Apache-2.0
#include "balance.hpp"

#include <cmath>
#include <utility>

#include "bending.hpp"

namespace sim_core {

namespace {

constexpr double EnergyBalance::*kStoredForms[] = {&EnergyBalance::kinetic, &EnergyBalance::potential,
                                                   &EnergyBalance::elastic};
constexpr double EnergyBalance::*kWorkForms[] = {&EnergyBalance::tow_points, &EnergyBalance::buoyancy,
                                                 &EnergyBalance::added_mass, &EnergyBalance::drag,
                                                 &EnergyBalance::damping,    &EnergyBalance::other};
constexpr Vec3 MomentumBalance::*kMomentumForms[] = {
    &MomentumBalance::change,     &MomentumBalance::tow_points, &MomentumBalance::weight, &MomentumBalance::buoyancy,
    &MomentumBalance::added_mass, &MomentumBalance::drag,       &MomentumBalance::other,  &MomentumBalance::numerical};

}  // namespace

Balance::Balance(const Model& model)
    : start_forces_(model),
      end_forces_(model),
      start_tow_(model.prescribed_sites, Vec3::Zero()),
      end_tow_(start_tow_),
      start_{},
      end_{},
      displacement_(model.sites() + 2 * model.bodies.size(), Vec3::Zero()) {}

void Balance::begin(const Equations& equations, const State& state) {
    measure(equations, state);
    std::swap(start_forces_, end_forces_);
    std::swap(start_tow_, end_tow_);
    start_ = end_;
    energy_ = {};
    momentum_ = {};
}

const EnergyBalance& Balance::measure_step(const State& start, const State& end, const Equations& equations,
                                           double end_share, bool impact) {
    const Model& m = *end.model;
    measure(equations, end);
    end_share_ = end_share;
    step_ = end.time - start.time;
    for (std::size_t i = 0; i < displacement_.size(); ++i) displacement_[i] = end.position[i] - start.position[i];

    double tow_work = 0.0;
    Vec3 tow_impulse = Vec3::Zero();
    for (int i = 0; i < m.prescribed_sites; ++i) {
        const Vec3 force = (1.0 - end_share) * start_tow_[i] + end_share * end_tow_[i];
        tow_work += force.dot(displacement_[m.free_sites + i]);
        tow_impulse += step_ * force;
    }
    EnergyBalance& e = step_energy_;
    e = {};
    e.kinetic = end_.kinetic - start_.kinetic;
    e.potential = end_.potential - start_.potential;
    e.elastic = end_.elastic - start_.elastic;
    e.tow_points = tow_work;
    e.buoyancy = work(ForceKind::buoyancy);
    e.added_mass = work(ForceKind::added_mass);
    e.drag = work(ForceKind::drag);
    e.damping = work(ForceKind::damping);
    e.other = work(ForceKind::other);
    double remainder = 0.0;
    for (const auto change : kStoredForms) {
        remainder += e.*change;
        e.exchanged += 0.5 * std::abs(e.*change);
    }
    for (const auto done : kWorkForms) {
        remainder -= e.*done;
        e.exchanged += 0.5 * std::abs(e.*done);
    }
    (impact ? e.impact : e.numerical) = remainder;

    MomentumBalance& p = step_momentum_;
    p.change = end_.momentum - start_.momentum;
    p.tow_points = tow_impulse;
    p.weight = impulse(ForceKind::weight, end);
    p.buoyancy = impulse(ForceKind::buoyancy, end);
    p.added_mass = impulse(ForceKind::added_mass, end);
    p.drag = impulse(ForceKind::drag, end);
    p.other = impulse(ForceKind::other, end);
    p.numerical = p.change - p.tow_points - p.weight - p.buoyancy - p.added_mass - p.drag - p.other;
    return e;
}

void Balance::add_step() {
    for (const auto form : kStoredForms) energy_.*form += step_energy_.*form;
    for (const auto form : kWorkForms) energy_.*form += step_energy_.*form;
    for (const auto form : {&EnergyBalance::impact, &EnergyBalance::numerical, &EnergyBalance::exchanged}) {
        energy_.*form += step_energy_.*form;
    }
    for (const auto form : kMomentumForms) momentum_.*form += step_momentum_.*form;
    std::swap(start_forces_, end_forces_);
    std::swap(start_tow_, end_tow_);
    start_ = end_;
}

void Balance::measure(const Equations& equations, const State& state) {
    const Model& m = *state.model;
    end_forces_.evaluate(equations, state);
    for (int i = 0; i < m.prescribed_sites; ++i) {
        // What the tow point needs for the inertia of its own half segment is left out here and in the kinetic energy: it is
        // the law's, not the integrator's.
        const int site = m.free_sites + i;
        end_tow_[i] = end_forces_.of(ForceKind::inertia)[site] - equations.site_force(site);
    }
    end_ = stored(state);
}

double Balance::work(ForceKind kind) const {
    double sum = 0.0;
    const std::vector<Vec3>& start = start_forces_.of(kind);
    const std::vector<Vec3>& end = end_forces_.of(kind);
    for (std::size_t i = 0; i < displacement_.size(); ++i) {
        sum += ((1.0 - end_share_) * start[i] + end_share_ * end[i]).dot(displacement_[i]);
    }
    return sum;
}

Vec3 Balance::impulse(ForceKind kind, const State& state) const {
    Vec3 sum = Vec3::Zero();
    const auto add = [&](int entry) {
        sum += (1.0 - end_share_) * start_forces_.of(kind)[entry] + end_share_ * end_forces_.of(kind)[entry];
    };
    for (int site = 0; site < state.model->sites(); ++site) add(site);
    for (std::size_t i = 0; i < state.bodies.size(); ++i) add(state.body_entry(static_cast<int>(i)));
    return step_ * sum;
}

Balance::Stored Balance::stored(const State& state) {
    const Model& m = *state.model;
    const double g = m.water.gravity;
    Stored sum{0.0, 0.0, 0.0, Vec3::Zero()};
    const auto add_mass = [&](int site, double mass) {
        sum.potential += mass * g * state.position[site].z();
        if (site >= m.free_sites && !m.is_attached(site)) return;
        sum.kinetic += 0.5 * mass * state.velocity[site].squaredNorm();
        sum.momentum += mass * state.velocity[site];
    };
    for (const Model::Segment& segment : m.segments) {
        const SegmentConstants& c = m.segment_constants[segment.constants];
        for (const int site : segment.site) add_mass(site, c.half_mass);
        sum.elastic += segment_elastic_energy(c, state.position[segment.site[0]], state.position[segment.site[1]]);
    }
    for (const Model::Point& point : m.points) {
        if (!point.prescribed) add_mass(point.site, point.properties.mass);
    }
    for (const Model::Bend& spring : m.bends) {
        const Vec3& middle = state.position[spring.site[1]];
        sum.elastic += bending_energy(spring.stiffness, middle - state.position[spring.site[0]],
                                      state.position[spring.site[2]] - middle);
    }
    for (const Model::Joint& joint : m.joints) {
        sum.elastic += 0.5 * joint.stiffness * (state.position[joint.site[1]] - state.position[joint.site[0]]).squaredNorm();
    }
    for (const Model::Clamp& spring : m.clamps) {
        sum.elastic += bending_energy(spring.stiffness, state.clamp_direction(spring),
                                      state.position[spring.site[1]] - state.position[spring.site[0]]);
    }
    for (std::size_t i = 0; i < m.bodies.size(); ++i) {
        const Body& body = m.bodies[i].force.body();
        const int entry = state.body_entry(static_cast<int>(i));
        const Quat& attitude = state.bodies[i].attitude;
        const Vec3 v = attitude.conjugate() * state.velocity[entry];
        const Vec3& w = state.velocity[entry + 1];
        const Vec3& c = body.centre_of_gravity;
        sum.kinetic += 0.5 * (body.mass * v.squaredNorm() + w.dot(body.inertia * w)) + body.mass * v.dot(w.cross(c));
        sum.potential += body.mass * g * (state.position[entry] + attitude * c).z();
        sum.momentum += body.mass * (state.velocity[entry] + attitude * w.cross(c));
    }
    return sum;
}

}  // namespace sim_core
