// SPDX-License-Identifier: Apache-2.0
#include "energy.hpp"

#include "bending.hpp"
#include "segment.hpp"

namespace sim_core {

Energy energy(const State& state) {
    const Model& model = *state.model;
    const Water& water = model.water;
    WaterProbe probe(water);
    probe.set_time(state.time);
    WaterMotion here;
    Energy e{0.0, 0.0, 0.0, 0.0};
    const auto immersed = [](double z) { return z < 0.0 ? 1.0 : 0.0; };
    for (std::size_t i = 0; i < model.segments.size(); ++i) {
        const Model::Segment& segment = model.segments[i];
        const double length = state.segment_length(static_cast<int>(i));
        if (length == 0.0) continue;  // on a drum
        SegmentConstants c;
        set_changing_segment(model.segment_constants[segment.constants], length, 0.0, c);
        const Vec3& a = state.position[segment.site[0]];
        const Vec3& b = state.position[segment.site[1]];
        const Vec3 t = (b - a).normalized();
        e.elastic += segment_elastic_energy(c, a, b);
        for (const int site : segment.site) {
            if (!state.moves_freely(site)) continue;
            const Vec3& v = state.velocity[site];
            const double z = state.position[site].z();
            const double along = v.dot(t);
            const Vec3 across = v - along * t;
            e.kinetic += 0.5 * (c.half_mass * v.squaredNorm() +
                                immersed(z) * (c.half_added_mass * across.squaredNorm() +
                                               c.half_tangential_added_mass * along * along));
            e.gravity += (c.half_weight - immersed(z) * c.half_buoyancy) * z;
        }
    }
    for (const Model::Bend& spring : model.bends) {
        const Vec3& middle = state.position[spring.site[1]];
        e.bending += bending_energy(spring.stiffness, middle - state.position[spring.site[0]],
                                    state.position[spring.site[2]] - middle);
    }
    for (const Model::Joint& joint : model.joints) {
        e.elastic += 0.5 * joint.stiffness * (state.position[joint.site[1]] - state.position[joint.site[0]]).squaredNorm();
    }
    for (const Model::Clamp& spring : model.clamps) {
        e.bending += bending_energy(spring.stiffness, state.clamp_direction(spring),
                                    state.position[spring.site[1]] - state.position[spring.site[0]]);
    }
    for (const Model::Point& point : model.points) {
        if (point.prescribed) continue;
        const FreePoint& p = point.properties;
        const double z = state.position[point.site].z();
        const Vec3& v = state.velocity[point.site];
        probe.at(state.position[point.site], here);
        const Vec3 added_mass = p.resistance(here.velocity - v).added_mass;
        e.kinetic += 0.5 * (p.mass * v.squaredNorm() + immersed(z) * added_mass.dot(v.cwiseAbs2()));
        e.gravity += (p.mass - immersed(z) * water.density * p.volume) * water.gravity * z;
    }
    for (std::size_t b = 0; b < model.bodies.size(); ++b) {
        const Body& body = model.bodies[b].force.body();
        const int entry = state.body_entry(static_cast<int>(b));
        const Quat& attitude = state.bodies[b].attitude;
        const Vec3 v = attitude.conjugate() * state.velocity[entry];
        const Vec3& w = state.velocity[entry + 1];
        const double z = state.position[entry].z();
        Eigen::Matrix<double, 6, 1> motion;
        motion << v, w;
        e.kinetic += 0.5 * (body.mass * v.squaredNorm() + w.dot(body.inertia * w)) +
                     body.mass * v.dot(w.cross(body.centre_of_gravity)) +
                     0.5 * immersed(z) * motion.dot(body.added_mass * motion);
        const double cg_z = z + (attitude * body.centre_of_gravity).z();
        const double cb_z = z + (attitude * body.centre_of_buoyancy).z();
        e.gravity += body.mass * water.gravity * cg_z - immersed(z) * water.density * water.gravity * body.volume * cb_z;
    }
    return e;
}

}  // namespace sim_core
