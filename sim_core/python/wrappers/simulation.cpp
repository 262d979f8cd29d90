// SPDX-License-Identifier: Apache-2.0
#include <nanobind/ndarray.h>
#include <nanobind/stl/tuple.h>

#include <algorithm>
#include <tuple>

#include "conversions.hpp"
#include "sim_core/backward_euler.hpp"
#include "sim_core/box.hpp"
#include "sim_core/energy.hpp"
#include "sim_core/equations.hpp"
#include "sim_core/forward_euler.hpp"
#include "sim_core/generalized_alpha.hpp"
#include "sim_core/hht.hpp"
#include "sim_core/newmark.hpp"
#include "sim_core/recorder.hpp"
#include "sim_core/single_step_houbolt.hpp"
#include "sim_core/statics.hpp"

namespace sim_core::python {

using namespace nb::literals;

namespace {

using MotionArgument = std::variant<const Motion*, std::map<std::string, const Motion*>>;
using PositionArgument = std::variant<Triple, std::map<std::string, Triple>>;

Motions to_motions(const Model& model, const MotionArgument& argument) {
    return per_prescribed_point<const Motion*>(model, argument, "motion");
}

Rows3 line_rows(const State& state, const std::vector<Vec3>& values, const std::string& line) {
    const std::vector<int>& sites = state.model->lines[state.model->line_index(line)].sites;
    Rows3 rows(sites.size(), 3);
    for (std::size_t i = 0; i < sites.size(); ++i) rows.row(i) = values[sites[i]].transpose();
    return rows;
}

Vec3 at_point(const State& state, const std::vector<Vec3>& values, const std::string& point) {
    return values[state.model->points[state.model->point_index(point)].site];
}

Vec3 at_body(const State& state, const std::vector<Vec3>& values, const std::string& body, int part) {
    return values[state.body_entry(state.model->body_index(body)) + part];
}

/// The readers that a State and a Simulator have in common.
template <class Class, class Get>
void bind_readers(Class& cls, Get get) {
    using Self = typename Class::Type;
    const auto line_reader = [&](const char* name, std::vector<Vec3> State::*values, const char* doc) {
        cls.def(name, [get, values](const Self& s, const std::string& line) {
            return line_rows(get(s), get(s).*values, line);
        }, "line"_a, doc);
    };
    const auto point_reader = [&](const char* name, std::vector<Vec3> State::*values, const char* doc) {
        cls.def(name, [get, values](const Self& s, const std::string& point) {
            return at_point(get(s), get(s).*values, point);
        }, "point"_a, doc);
    };
    const auto body_reader = [&](const char* name, std::vector<Vec3> State::*values, int part, const char* doc) {
        cls.def(name, [get, values, part](const Self& s, const std::string& body) {
            return at_body(get(s), get(s).*values, body, part);
        }, "body"_a, doc);
    };
    cls.def_prop_ro("time", [get](const Self& s) { return get(s).time; }, "s");
    cls.def_prop_ro("model", [get](const Self& s) { return SharedModel{get(s).model}; });
    line_reader("node_positions", &State::position, "(segments + 1, 3) m, tank axes, from the line's start to its end.");
    line_reader("node_velocities", &State::velocity, "(segments + 1, 3) m/s, tank axes.");
    line_reader("node_accelerations", &State::acceleration, "(segments + 1, 3) m/s², tank axes.");
    point_reader("point_position", &State::position, "(3,) m, tank axes.");
    point_reader("point_velocity", &State::velocity, "(3,) m/s, tank axes.");
    point_reader("point_acceleration", &State::acceleration, "(3,) m/s², tank axes.");
    body_reader("body_position", &State::position, 0, "(3,) m, of the body's origin in tank axes.");
    body_reader("body_velocity", &State::velocity, 0, "(3,) m/s, of the body's origin in tank axes.");
    body_reader("body_acceleration", &State::acceleration, 0, "(3,) m/s², of the body's origin in tank axes.");
    body_reader("body_angular_velocity", &State::velocity, 1, "(3,) rad/s, body axes.");
    body_reader("body_angular_acceleration", &State::acceleration, 1, "(3,) rad/s², body axes.");
    cls.def("paid_out", [get](const Self& s, const std::string& line) {
        return get(s).winches[get(s).model->winch_index(line)].paid_out;
    }, "line"_a, "m, unstretched length of a line on a winch that is out.");
    cls.def("body_quaternion", [get](const Self& s, const std::string& body) {
        const Quat& q = get(s).bodies[get(s).model->body_index(body)].attitude;
        return Eigen::Vector4d(q.w(), q.x(), q.y(), q.z());
    }, "body"_a, "(4,) w, x, y, z of the unit quaternion body axes → tank axes.");
}

/// The name of the line that has a segment.
std::string line_of(const Model& model, int segment) {
    const auto has = [segment](const Model::Line& line) {
        return segment >= line.first_segment && segment < line.first_segment + line.segments;
    };
    return std::find_if(model.lines.begin(), model.lines.end(), has)->name;
}

const Balance& counted(const Simulator& simulator) {
    if (!simulator.balance()) throw InvalidInput("nothing was counted: call start_balance() first");
    return *simulator.balance();
}

template <class Sums, class Value>
struct Form {
    const char* name;
    Value Sums::*value;
    const char* doc;
};

constexpr Form<EnergyBalance, double> kEnergyForms[] = {
    {"kinetic", &EnergyBalance::kinetic, "Change of the kinetic energy of the system's own mass, J."},
    {"potential", &EnergyBalance::potential, "Change of the potential energy of weight, J."},
    {"elastic", &EnergyBalance::elastic, "Change of the elastic energy of tension and bending, J."},
    {"tow_points", &EnergyBalance::tow_points, "Work of the forces that move the prescribed points, J."},
    {"buoyancy", &EnergyBalance::buoyancy, "Work of buoyancy, in waves of their pressure too, J."},
    {"added_mass", &EnergyBalance::added_mass, "Work of the reaction of the accelerated water, J."},
    {"drag", &EnergyBalance::drag, "Work of drag and lift; of bodies, of the Munk moment too, J."},
    {"damping", &EnergyBalance::damping, "Work of structural damping, J."},
    {"other", &EnergyBalance::other, "Work of all other forces, J."},
    {"impact", &EnergyBalance::impact, "Lost in steps with implicit Euler where a line snapped and the step did not resolve it, J."},
    {"numerical", &EnergyBalance::numerical, "What the integration in time makes or loses: the remainder, J."},
    {"exchanged", &EnergyBalance::exchanged, "Passed from one form to another in all, the measure for the remainder, J."},
};

constexpr Form<MomentumBalance, Vec3> kMomentumForms[] = {
    {"change", &MomentumBalance::change, "(3,) N·s, change of the momentum of the system's own mass."},
    {"tow_points", &MomentumBalance::tow_points, "(3,) N·s, impulse of the forces that move the prescribed points."},
    {"weight", &MomentumBalance::weight, "(3,) N·s"},
    {"buoyancy", &MomentumBalance::buoyancy, "(3,) N·s"},
    {"added_mass", &MomentumBalance::added_mass, "(3,) N·s"},
    {"drag", &MomentumBalance::drag, "(3,) N·s"},
    {"other", &MomentumBalance::other, "(3,) N·s"},
    {"numerical", &MomentumBalance::numerical, "(3,) N·s, the remainder."},
};

nb::object array(std::vector<double> values, std::initializer_list<std::size_t> shape) {
    auto* owned = new std::vector<double>(std::move(values));
    nb::capsule owner(owned, [](void* p) noexcept { delete static_cast<std::vector<double>*>(p); });
    return nb::cast(nb::ndarray<nb::numpy, double>(owned->data(), shape, owner));
}

/// One array over the samples for each form.
template <class Sums, class Value, std::size_t count>
nb::dict balance_arrays(const std::vector<Sums>& samples, const Form<Sums, Value> (&forms)[count]) {
    nb::dict arrays;
    for (const auto& form : forms) {
        std::vector<double> values;
        for (const Sums& sample : samples) {
            if constexpr (std::is_same_v<Value, double>) {
                values.push_back(sample.*form.value);
            } else {
                const Vec3& vector = sample.*form.value;
                values.insert(values.end(), vector.data(), vector.data() + 3);
            }
        }
        if constexpr (std::is_same_v<Value, double>) {
            arrays[form.name] = array(std::move(values), {samples.size()});
        } else {
            arrays[form.name] = array(std::move(values), {samples.size(), 3});
        }
    }
    return arrays;
}

template <class Class, class Forms>
void bind_forms(Class& cls, const Forms& forms) {
    for (const auto& form : forms) {
        cls.def_prop_ro(form.name, [value = form.value](const typename Class::Type& s) { return s.*value; }, form.doc);
    }
}

/// The bending moment or the curvature at the nodes of a line.
Eigen::VectorXd along_line(const Simulator& simulator, const std::string& name, double Equations::Bending::*value) {
    const int line = simulator.model().line_index(name);
    Eigen::VectorXd values(simulator.model().lines[line].segments + 1);
    for (int node = 0; node < values.size(); ++node) values[node] = simulator.equations().bending(line, node).*value;
    return values;
}

/// The state after a displacement of its unknowns as the Newton iteration makes it.
State displaced(const State& state, const Eigen::VectorXd& displacement, const Rates& rates) {
    if (displacement.size() != 3 * state.model->blocks()) throw InvalidInput("displacement has the wrong length");
    State moved = state;
    for (int block = 0; block < state.model->blocks(); ++block) {
        const int i = state.entry_of_block(block);
        const Vec3 d = displacement.segment<3>(3 * block);
        moved.position[i] += rates.position * d;
        moved.velocity[i] += rates.velocity * d;
        moved.acceleration[i] += rates.acceleration * d;
    }
    moved.follow_bodies();
    return moved;
}

Eigen::VectorXd residual(const State& state) {
    Equations equations(state.model);
    equations.evaluate(state);
    Eigen::VectorXd all(3 * state.model->blocks());
    for (int block = 0; block < state.model->blocks(); ++block) {
        all.segment<3>(3 * block) = equations.residual()[block];
    }
    return all;
}

Eigen::MatrixXd jacobian(const State& state, const Rates& rates) {
    Equations equations(state.model);
    equations.evaluate(state);
    equations.assemble(state, rates);
    const int blocks = state.model->blocks();
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(3 * blocks, 3 * blocks);
    for (int i = 0; i < blocks; ++i) {
        for (int j = 0; j < blocks; ++j) {
            const int slot = state.model->structure.slot(i, j);
            if (slot >= 0) dense.block<3, 3>(3 * i, 3 * j) = equations.jacobian_blocks()[slot];
        }
    }
    return dense;
}

/// Assembles the Jacobian so many times, and each time solves with it if asked to: to be timed.
void linear_systems(const State& state, const Rates& rates, int repeats, bool solve) {
    Equations equations(state.model);
    std::vector<Vec3> displacement(state.model->blocks());
    equations.evaluate(state);
    for (int i = 0; i < repeats; ++i) {
        equations.assemble(state, rates);
        if (!solve) continue;
        equations.factor();
        equations.solve(displacement);
    }
}

}  // namespace

void bind_simulation(nb::module_& module) {
    nb::class_<State> state(module, "State", R"(The motion of a whole system at one instant.

A new one has everything at rest at the origin; steady_tow() makes one in equilibrium. After
something was set by hand the simulator first solves for the accelerations.)");
    state.def("__init__", [](State* self, const SharedModel& model) { new (self) State(model.model); }, "model"_a)
        .def("copy", [](const State& s) { return State(s); }, "An independent, exact copy.")
        .def("set_time", &State::set_time, "time"_a,
             "Set the time, s: motions and moving water are taken from there on.")
        .def(
            "set_point",
            [](State& s, const std::string& point, const Triple& position, const Triple& velocity) {
                s.set_point(point, to_vec3(position), to_vec3(velocity));
            },
            "point"_a, "position"_a, "velocity"_a = Triple{}, "Set a point: m, m/s in tank axes.")
        .def(
            "set_line_node",
            [](State& s, const std::string& line, int node, const Triple& position, const Triple& velocity) {
                s.set_line_node(line, node, to_vec3(position), to_vec3(velocity));
            },
            "line"_a, "node"_a, "position"_a, "velocity"_a = Triple{},
            "Set inner node 1 … segments − 1 of a line: m, m/s in tank axes.")
        .def(
            "set_body",
            [](State& s, const std::string& body, const Triple& position, const std::array<double, 4>& q,
               const Triple& velocity, const Triple& angular_velocity) {
                s.set_body(body, to_vec3(position), Quat(q[0], q[1], q[2], q[3]), to_vec3(velocity),
                           to_vec3(angular_velocity));
            },
            "body"_a, "position"_a, "quaternion"_a = std::array<double, 4>{1.0, 0.0, 0.0, 0.0},
            "velocity"_a = Triple{}, "angular_velocity"_a = Triple{},
            "Set a body: origin m and m/s in tank axes, quaternion (w, x, y, z) body → tank, rad/s in body axes.")
        .def(
            "save",
            [](const State& s) {
                const std::string bytes = s.save();
                return nb::bytes(bytes.data(), bytes.size());
            },
            "The exact state as bytes (for this model, on machines of the same byte order).")
        .def(
            "restore", [](State& s, nb::bytes bytes) { s.restore(std::string(bytes.c_str(), bytes.size())); },
            "bytes"_a,
            "Take over a saved state of the same model. InvalidInput if it is of one that differs in any value, or damaged;\n"
            "the state is then as it was.")
        .def("__copy__", [](const State& s) { return State(s); })
        .def("__deepcopy__", [](const State& s, nb::handle) { return State(s); }, "memo"_a)
        .def("__getstate__",
             [](const State& s) {
                 const std::string bytes = s.save();
                 return nb::make_tuple(SharedModel{s.model}, nb::bytes(bytes.data(), bytes.size()));
             })
        .def("__setstate__", [](State& s, const nb::tuple& saved) {
            State state(nb::cast<SharedModel>(saved[0]).model);
            const nb::bytes bytes = nb::cast<nb::bytes>(saved[1]);
            state.restore(std::string(bytes.c_str(), bytes.size()));
            new (&s) State(std::move(state));
        });
    bind_readers(state, [](const State& s) -> const State& { return s; });

    nb::class_<Integrator>(module, "Integrator", "A time integration scheme.");
    nb::class_<ForwardEuler, Integrator>(module, "ForwardEuler", R"(Explicit Euler: first order; makes energy.

Stable only for max_step ≤ 2ζ/ω of every mode, which a stiff cable puts far below a millisecond: for comparison.)")
        .def(nb::init<>());
    nb::class_<BackwardEuler, Integrator>(module, "BackwardEuler",
                                          "Implicit Euler: first order, strongly damped; can only lose energy.")
        .def(nb::init<>());
    nb::class_<Newmark, Integrator>(module, "Newmark", R"(Newmark's method (Newmark 1959).

beta = 1/4, gamma = 1/2 (average acceleration) is second order and damps nothing; gamma > 1/2 damps, at first order.
2 beta ≥ gamma ≥ 1/2, the unconditionally stable ones.)")
        .def(nb::init<double, double>(), nb::kw_only(), "beta"_a = 0.25, "gamma"_a = 0.5)
        .def_prop_ro("beta", &Newmark::beta)
        .def_prop_ro("gamma", &Newmark::gamma);
    nb::class_<Hht, Integrator>(module, "HHT", R"(HHT-α integrator (Hilber, Hughes & Taylor 1977).

Second order, unconditionally stable on linear systems; alpha (−1/3 … 0): the spectral radius at infinite frequency is
(1 + alpha)/(1 − alpha).)")
        .def(nb::init<double>(), nb::kw_only(), "alpha"_a = -0.1)
        .def_prop_ro("alpha", &Hht::alpha);
    nb::class_<GeneralizedAlpha, Integrator>(module, "GeneralizedAlpha", R"(Generalised-α integrator (Chung & Hulbert 1993; Arnold & Brüls 2007).

Second order, unconditionally stable on linear systems; rho_inf (0 … 1) is the spectral radius at infinite frequency:
1 damps nothing, 0 damps most.)")
        .def(nb::init<double>(), nb::kw_only(), "rho_inf"_a = 0.8)
        .def_prop_ro("rho_inf", &GeneralizedAlpha::rho_inf);
    nb::class_<SingleStepHoubolt, Integrator>(module, "SingleStepHoubolt", R"(Single-step Houbolt method (Chung & Hulbert 1994).

Annihilates what the step does not resolve. gamma_1 (1/2 … 3/2): 3/2 is second order and equal to
GeneralizedAlpha(rho_inf=0); the others leave first order, since their velocities are a fraction of a step off.)")
        .def(nb::init<double>(), nb::kw_only(), "gamma_1"_a = 1.5)
        .def_prop_ro("gamma_1", &SingleStepHoubolt::gamma_1);
    nb::class_<Box, Integrator>(module, "Box", R"(Box scheme (Ablow & Schechter 1983): for lumped masses the implicit midpoint rule.

Second order, damps nothing; what the step does not resolve alternates from step to step.)")
        .def(nb::init<>());

    nb::class_<Energy>(module, "Energy", "Mechanical energy of what moves freely, J.")
        .def_ro("kinetic", &Energy::kinetic, "J, added mass included")
        .def_ro("gravity", &Energy::gravity, "J, weight minus buoyancy; exact if everything is dry or immersed")
        .def_ro("elastic", &Energy::elastic, "J, of the tension")
        .def_ro("bending", &Energy::bending, "J")
        .def_prop_ro("total", [](const Energy& e) { return e.kinetic + e.gravity + e.elastic + e.bending; }, "J");
    module.def("energy", &energy, "state"_a, "Mechanical energy of a state.");

    nb::class_<EnergyBalance> energy_balance(module, "EnergyBalance", R"(Where energy went, J.

kinetic + potential + elastic = tow_points + buoyancy + added_mass + drag + damping + other + impact + numerical: what
is stored changes by the work done on the system.)");
    bind_forms(energy_balance, kEnergyForms);
    nb::class_<MomentumBalance> momentum_balance(module, "MomentumBalance", R"(Where momentum went, N·s in tank axes.

change = tow_points + weight + buoyancy + added_mass + drag + other + numerical.)");
    bind_forms(momentum_balance, kMomentumForms);

    nb::class_<Simulator> simulator(module, "Simulator", R"(Advances one state in time.

integrator: GeneralizedAlpha(rho_inf=0.8) by default; max_step: s, the largest step; newton_tolerance: largest residual relative to the weight in air of the system;
max_iterations: Newton iterations before a step is halved. Each step that cannot be solved is halved, down to
max_step/4096, then ConvergenceError is raised and the state stays at the last good instant.
error_tolerance: m; with it steps are chosen by their estimated error of displacement at the worst node (rotations count
with half the body's length), from min_step (s, by default max_step/10000) to max_step; not for ForwardEuler.
energy_tolerance: with it the balance of energy is counted and watched: a step that would bring its remainder above this
share of all energy exchanged is halved, and where that does not help ConvergenceError is raised. What unresolved snaps lose
is part of the remainder, unless inelastic_snaps says that in what is modelled it is lost.
A step in which a line snaps taut or slack faster than it can resolve (less than three steps in a period of the ends of
the segment against one another, with error_tolerance 4 pi) is taken with implicit Euler, and the two after it: an impact without rebound (not with
ForwardEuler, whose instability it would hide). See snaps, impacts and least_resolved_snap.
The GIL is released while stepping; use each simulator from one thread at a time.)");
    simulator
        .def(
            "__init__",
            [](Simulator* self, const SharedModel& model, const State& state, std::shared_ptr<Integrator> integrator,
               double max_step, double newton_tolerance, int max_iterations, std::optional<double> error_tolerance,
               std::optional<double> min_step, std::optional<double> energy_tolerance, bool inelastic_snaps) {
                if (state.model->fingerprint != model.model->fingerprint) {
                    throw InvalidInput("the state belongs to another model");
                }
                if (!integrator) integrator = std::make_shared<GeneralizedAlpha>();
                std::optional<StepControl> control;
                if (error_tolerance) control = {*error_tolerance, min_step.value_or(1e-4 * max_step)};
                new (self) Simulator(state, std::move(integrator), max_step, {max_iterations, newton_tolerance}, control,
                                     energy_tolerance ? std::optional(EnergyWatch{*energy_tolerance, inelastic_snaps})
                                                      : std::nullopt);
            },
            "model"_a, "state"_a, nb::kw_only(), "integrator"_a = nb::none(), "max_step"_a = 0.005,
            "newton_tolerance"_a = NewtonSettings{}.tolerance, "max_iterations"_a = NewtonSettings{}.max_iterations,
            "error_tolerance"_a = nb::none(), "min_step"_a = nb::none(), "energy_tolerance"_a = nb::none(),
            "inelastic_snaps"_a = false)
        .def(
            "step",
            [](Simulator& s, double t_end, const MotionArgument& motion) {
                const Motions motions = to_motions(s.model(), motion);
                nb::gil_scoped_release released;
                s.step(t_end, motions);
            },
            "t_end"_a, "motion"_a,
            "Step until exactly t_end (s) with a law of motion (or a dict of one for each prescribed point), which\n"
            "is evaluated inside the steps.")
        .def(
            "step_to",
            [](Simulator& s, double t_end, const Triple& position, const Triple& velocity) {
                nb::gil_scoped_release released;
                s.step_to(t_end, to_vec3(position), to_vec3(velocity));
            },
            "t_end"_a, "position"_a, "velocity"_a,
            "Live input: step until t_end (s) while the tow point follows the cubic from its present position and\n"
            "velocity to the given ones (m, m/s in tank axes).")
        .def(
            "set_payout",
            [](Simulator& s, const std::string& line, std::shared_ptr<Payout> law) {
                s.set_payout(line, std::move(law));
            },
            "line"_a, "law"_a.none(),
            "From now on a line's winch pays out or hauls in by this law, which must begin with what is out now; None\n"
            "stops it. Beyond the line's longest and shortest length stepping raises InvalidInput and the state stays at\n"
            "the last good instant.")
        .def(
            "tensions",
            [](const Simulator& s, const std::string& name) {
                const Model::Line& line = s.model().lines[s.model().line_index(name)];
                Eigen::VectorXd tensions(line.segments);
                for (int i = 0; i < line.segments; ++i) tensions[i] = s.equations().tension(line.first_segment + i);
                return tensions;
            },
            "line"_a, "(segments,) N, in the middle of each segment, from the line's start to its end.")
        .def(
            "end_tensions",
            [](const Simulator& s, const std::string& name) {
                const int line = s.model().line_index(name);
                return Eigen::Vector2d(s.equations().end_tension(line, 0), s.equations().end_tension(line, 1));
            },
            "line"_a, "(2,) N, at the very start and end of a line: with the loads on the half segments there.")
        .def(
            "hook_load",
            [](const Simulator& s, const std::string& name) {
                for (int i = 0; i < s.model().prescribed_sites; ++i) {
                    if (s.model().prescribed_point(i).name == name) return s.equations().hook_load(i);
                }
                (void)s.model().point_index(name);  // throws if there is none of this name
                throw InvalidInput("point '" + name + "' moves freely: only a prescribed point has a hook load");
            },
            "point"_a,
            "(3,) N, tank axes: what the lines pull with on a prescribed point, weight, drag and inertia of their last\n"
            "half segments included.")
        .def(
            "bending_moments",
            [](const Simulator& s, const std::string& name) { return along_line(s, name, &Equations::Bending::moment); },
            "line"_a, "(segments + 1,) N·m, of the nodes from the line's start to its end; 0 where it is limp.")
        .def(
            "curvatures",
            [](const Simulator& s, const std::string& name) {
                return along_line(s, name, &Equations::Bending::curvature);
            },
            "line"_a, "(segments + 1,) 1/m, likewise: bending moment over bending stiffness.")
        .def(
            "peak_tensions",
            [](const Simulator& s, const std::string& name) {
                const Model::Line& line = s.model().lines[s.model().line_index(name)];
                Eigen::VectorXd tensions(line.segments);
                for (int i = 0; i < line.segments; ++i) tensions[i] = s.peak_tension(line.first_segment + i);
                return tensions;
            },
            "line"_a, "(segments,) N, the largest at the end of any step since the start or the last restore.")
        .def_prop_ro("state", [](const Simulator& s) { return State(s.state()); }, "A copy of the present state.")
        .def(
            "save",
            [](const Simulator& s) {
                const std::string bytes = s.state().save();
                return nb::bytes(bytes.data(), bytes.size());
            },
            "The exact state as bytes: a simulator restored from it continues bit for bit alike.")
        .def(
            "restore", [](Simulator& s, nb::bytes bytes) { s.restore(std::string(bytes.c_str(), bytes.size())); },
            "bytes"_a,
            "Take over a saved state of the same model, and solve for its accelerations if it was set by\n"
            "hand. InvalidInput if it is damaged, or of a model that differs in any value; the simulator is then as it was.")
        .def_prop_ro(
            "contacts",
            [](const Simulator& s) {
                std::vector<Contact> contacts;
                for (const ContactEvent& event : s.contacts().events()) {
                    contacts.push_back({s.model().contact_places[event.place].name,
                                        s.model().tank_sides[event.side].name, event.position, event.time,
                                        event.released});
                }
                return contacts;
            },
            "What touched the tank since the start or the last restore, in order of time; the first 1000.")
        .def_prop_ro("contacts_lost", [](const Simulator& s) { return s.contacts().lost(); },
                     "Contacts beyond those.")
        .def("copy", [](const Simulator& s) { return std::make_unique<Simulator>(s); },
             "An independent simulator at the same state.")
        .def("start_balance", &Simulator::start_balance,
             "Count energy and momentum from now on: see energy_balance and momentum_balance.")
        .def_prop_ro(
            "energy_balance", [](const Simulator& s) { return counted(s).energy(); },
            "Where energy went since start_balance().")
        .def_prop_ro(
            "momentum_balance", [](const Simulator& s) { return counted(s).momentum(); },
            "Where momentum went since start_balance().")
        .def_prop_ro("max_step", &Simulator::max_step, "s")
        .def_prop_ro("steps", [](const Simulator& s) { return s.statistics().steps; }, "Accepted integrator steps.")
        .def_prop_ro("newton_iterations", [](const Simulator& s) { return s.statistics().newton_iterations; },
                     "Newton iterations in all steps so far.")
        .def_prop_ro("halvings", [](const Simulator& s) { return s.statistics().halvings; },
                     "How often a step had to be repeated with half the size.")
        .def_prop_ro("rejections", [](const Simulator& s) { return s.statistics().rejections; },
                     "How often a step was repeated because of its error_tolerance or energy_tolerance.")
        .def_prop_ro("snaps", [](const Simulator& s) { return s.statistics().snaps; },
                     "Steps in which a line snapped taut or slack.")
        .def_prop_ro("impacts", [](const Simulator& s) { return s.statistics().impacts; },
                     "Those of the snaps that no step resolved: taken as inelastic impacts.")
        .def_prop_ro(
            "least_resolved_snap",
            [](const Simulator& s) -> std::optional<std::tuple<std::string, double, double, bool>> {
                const auto& snap = s.least_resolved_snap();
                if (!snap) return std::nullopt;
                return std::tuple(line_of(s.model(), snap->segment), snap->time, snap->steps_per_period, snap->impact);
            },
            "Of the impact, or where there was none the snap, with the fewest steps per period since the start or the last\n"
            "restore: line, time (s), steps per period, whether it is an impact.");
    bind_readers(simulator, [](const Simulator& s) -> const State& { return s.state(); });

    module.def(
        "steady_tow",
        [](const SharedModel& model, const PositionArgument& position, const Triple& velocity) {
            std::vector<Vec3> positions;
            for (const Triple& p : per_prescribed_point<Triple>(*model.model, position, "position")) {
                positions.push_back(to_vec3(p));
            }
            nb::gil_scoped_release released;
            return steady_tow(model.model, positions, to_vec3(velocity));
        },
        "model"_a, nb::kw_only(), "position"_a, "velocity"_a = Triple{},
        "The state of steady tow at a constant velocity (m/s, tank axes; zero: hanging at rest), at time 0.\n\n"
        "position: (3,) m of the prescribed point, or a dict of one for each. Solved by pseudo-transient continuation;\n"
        "ConvergenceError names the place that could not be brought to equilibrium.");

    module.def(
        "_record_run",
        [](Simulator& simulator, const MotionArgument& motion, double t_end, double output_step) {
            const Model& model = simulator.model();
            const Motions motions = to_motions(model, motion);
            Recording r;
            {
                nb::gil_scoped_release released;
                r = record_run(simulator, motions, t_end, output_step);
            }
            const std::size_t samples = r.time.size();
            const std::size_t entries = simulator.state().position.size();
            nb::dict arrays;
            arrays["time"] = array(std::move(r.time), {samples});
            arrays["position"] = array(std::move(r.position), {samples, entries, 3});
            arrays["velocity"] = array(std::move(r.velocity), {samples, entries, 3});
            arrays["acceleration"] = array(std::move(r.acceleration), {samples, entries, 3});
            arrays["attitude"] = array(std::move(r.attitude), {samples, model.bodies.size(), 4});
            if (!r.energy.empty()) {
                arrays["energy"] = balance_arrays(r.energy, kEnergyForms);
                arrays["momentum"] = balance_arrays(r.momentum, kMomentumForms);
            }
            arrays["tension"] = array(std::move(r.tension), {samples, model.segments.size()});
            arrays["hook_load"] =
                array(std::move(r.hook_load), {samples, static_cast<std::size_t>(model.prescribed_sites), 3});
            arrays["end_tension"] = array(std::move(r.end_tension), {samples, model.lines.size(), 2});
            const std::size_t bent = r.curvature.size() / samples;
            arrays["bending_moment"] = array(std::move(r.bending_moment), {samples, bent});
            arrays["curvature"] = array(std::move(r.curvature), {samples, bent});
            arrays["paid_out"] = array(std::move(r.paid_out), {samples, model.winches.size()});
            return arrays;
        },
        "simulator"_a, "motion"_a, "t_end"_a, "output_step"_a);

    // The equations themselves, for verification.
    module.def("_residual", &residual, "state"_a);
    module.def(
        "_jacobian",
        [](const State& s, const Triple& rates) { return jacobian(s, {rates[0], rates[1], rates[2]}); }, "state"_a,
        "rates"_a);
    module.def(
        "_displaced",
        [](const State& s, const Eigen::VectorXd& displacement, const Triple& rates) {
            return displaced(s, displacement, {rates[0], rates[1], rates[2]});
        },
        "state"_a, "displacement"_a, "rates"_a);
    module.def(
        "_linear_systems",
        [](const State& s, const Triple& rates, int repeats, bool solve) {
            linear_systems(s, {rates[0], rates[1], rates[2]}, repeats, solve);
        },
        "state"_a, "rates"_a, "repeats"_a, "solve"_a);
}

}  // namespace sim_core::python
