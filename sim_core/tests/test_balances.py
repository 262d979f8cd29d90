# SPDX-License-Identifier: Apache-2.0
"""Energy and momentum that the core counts, on problems in which it is known where they go."""

import math

import numpy as np
import pytest

import sim_core as sc

FAR = sc.SteadyTow(position=(0, 0, 0))
STORED = ("kinetic", "potential", "elastic")
WORK = ("tow_points", "buoyancy", "added_mass", "drag", "damping", "other", "impact", "numerical")


def counted(model, state, motion, t_end, **settings):
    simulator = sc.Simulator(model, state, **settings)
    simulator.start_balance()
    simulator.step(t_end, motion)
    return simulator


def pendulum():
    """A mass on a stiff massless wire, let go at 60° with the stretch of its pull there."""
    b = sc.ModelBuilder(sc.Water(density=0.0))
    b.add_prescribed_point("pivot")
    b.add_free_point("bob", mass=1.0)
    wire = sc.LineProperties(length=1.0, diameter=1e-3, mass_per_length=1e-9, axial_stiffness=1e5)
    b.add_line("wire", "pivot", "bob", wire, segments=1)
    model = b.build()
    state = sc.State(model)
    reach = 1 + 9.81 * math.cos(math.pi / 3) / 1e5
    state.set_point("bob", (reach * math.sin(math.pi / 3), 0, -reach * math.cos(math.pi / 3)))
    return model, state


def test_what_is_stored_changes_by_the_work_done(nit_model):
    """The forms add up, and those of a run are those of a simulator."""
    model = nit_model(segments=(4, 1, 3), axial_damping=50.0)
    motion = sc.Sinusoid(
        mean=(0, 0, 0.2), velocity=(1, 0, 0), amplitude=0.06, period=2, ramp_time=1
    )
    result = sc.run(model, motion, t_end=2.0, output_step=0.5, balance=True)
    e, p = result.energy, result.momentum
    assert e["exchanged"][-1] > 1.0
    assert sum(e[k] for k in STORED) == pytest.approx(sum(e[k] for k in WORK), abs=1e-9)
    assert p["change"] == pytest.approx(sum(v for k, v in p.items() if k != "change"), abs=1e-9)
    assert all(v[0] == 0 for v in e.values())
    start = sc.steady_tow(model, position=(0, 0, 0.2), velocity=(1, 0, 0))
    simulator = sc.Simulator(model, start)
    simulator.start_balance()
    for t in result.time[1:]:
        simulator.step(t, motion)
    assert simulator.energy_balance.drag == e["drag"][-1]
    assert simulator.momentum_balance.drag.tolist() == p["drag"][-1].tolist()
    assert e["drag"][-1] < 0 and e["damping"][-1] < 0


def test_counts_only_when_asked(nit_model):
    model = nit_model(segments=(2, 1, 2))
    simulator = sc.Simulator(model, sc.steady_tow(model, position=(0, 0, 0.2)))
    with pytest.raises(sc.InvalidInput, match="start_balance"):
        _ = simulator.energy_balance
    simulator.start_balance()
    simulator.step(0.1, sc.SteadyTow(position=(0, 0, 0.2)))
    silent = sc.Simulator(model, sc.steady_tow(model, position=(0, 0, 0.2)))
    silent.step(0.1, sc.SteadyTow(position=(0, 0, 0.2)))
    assert silent.save() == simulator.save()  # counting changes nothing


def test_pendulum_turns_height_into_speed():
    model, state = pendulum()
    errors = []
    for step in (0.004, 0.002):
        simulator = counted(
            model, state, FAR, 0.5, integrator=sc.Newmark(), max_step=step, newton_tolerance=1e-13
        )
        e = simulator.energy_balance
        drop = -1 * 9.81 * (simulator.point_position("bob")[2] - state.point_position("bob")[2])
        assert e.potential == pytest.approx(-drop, rel=1e-6)
        # the pivot does not move, nothing resists; what is left is of second order
        assert (e.tow_points, e.drag, e.damping, e.impact) == (0, 0, 0, 0)
        errors.append(e.numerical / e.exchanged)
        p = simulator.momentum_balance
        assert p.change == pytest.approx(simulator.point_velocity("bob"), rel=1e-6)
    assert abs(errors[0]) < 1e-3
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.3)


def test_falling_sphere_gives_its_weight_to_the_water(free_sphere):
    """v = v_t tanh(t/τ): the drag takes m_e v_t² [ln cosh s − tanh²s / 2], m_e the mass with its
    added mass, s = t/τ; its impulse is m_e v_t (s − tanh s)."""
    mass, volume, added = 5.25, 0.697e-3, 0.35
    area = 0.0045
    model = free_sphere(mass, volume, area, added)
    state = sc.State(model)
    state.set_point("far", (0, 0, -500))
    state.set_point("sphere", (0, 0, -10))
    simulator = counted(model, state, sc.SteadyTow(position=(0, 0, -500)), 1.0, max_step=0.001)
    e, p = simulator.energy_balance, simulator.momentum_balance
    wet = (mass - 1000 * volume) * 9.81
    terminal = math.sqrt(2 * wet / (1000 * area))
    effective = mass + added
    s = wet / (effective * terminal)  # t = 1 s
    tanh = math.tanh(s)
    fall = effective * terminal**2 / wet * math.log(math.cosh(s))
    speed = terminal * tanh
    # the trapezoidal rule is good to h² (1e-6) of smooth changes within τ ≈ 0.3 s
    near = {"rel": 1e-4}
    assert e.drag == pytest.approx(-(wet * fall - effective * speed**2 / 2), **near)
    assert e.added_mass == pytest.approx(-added * speed**2 / 2, **near)
    assert e.kinetic == pytest.approx(mass * speed**2 / 2, **near)
    assert e.potential == pytest.approx(-mass * 9.81 * fall, **near)
    assert e.buoyancy == pytest.approx(-1000 * volume * 9.81 * fall, **near)
    assert abs(e.numerical) < 1e-5 * e.exchanged
    assert p.weight[2] == pytest.approx(-mass * 9.81)
    assert p.drag[2] == pytest.approx(wet - effective * speed, **near)
    assert p.added_mass[2] == pytest.approx(added * speed, **near)
    assert p.change[2] == pytest.approx(-mass * speed, **near)
    assert np.abs(p.numerical).max() < 1e-5 * mass * speed


def test_body_tumbling_in_ideal_fluid_keeps_energy_with_the_water(free_body):
    """What the body loses the water has: ½ V·M_a·V of the added-mass matrix."""
    added = np.diag([0.5, 4.0, 5.0, 0.01, 0.3, 0.4])
    body = sc.Body(
        mass=5.0, inertia=(0.02, 0.4, 0.5), volume=5e-3, diameter=0.1, length=1.0,
        added_mass=added.tolist(), axial_drag=0, cross_flow_drag=0,
    )  # fmt: skip
    model = free_body(body)
    state = sc.State(model)
    state.set_point("far", (0, 0, -500))
    state.set_body("fish", (0, 0, -20), velocity=(0.5, 0.2, 0), angular_velocity=(0.3, 1.0, 0.4))

    def water_energy(s):
        w, x, y, z = s.body_quaternion("fish")
        R = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        V = np.r_[R.T @ s.body_velocity("fish"), s.body_angular_velocity("fish")]
        return 0.5 * V @ added @ V

    simulator = counted(
        model, state, sc.SteadyTow(position=(0, 0, -500)), 3.0, max_step=0.002,
        integrator=sc.GeneralizedAlpha(rho_inf=1.0),
    )  # fmt: skip
    e = simulator.energy_balance
    to_water = water_energy(simulator) - water_energy(state)
    assert e.exchanged > 0.5
    assert e.kinetic == pytest.approx(-to_water, abs=1e-4 * e.exchanged)
    assert e.added_mass + e.drag == pytest.approx(-to_water, abs=1e-4 * e.exchanged)
    assert abs(e.numerical) < 1e-4 * e.exchanged


def test_wire_that_stops_a_weight_takes_its_energy():
    """An inelastic impact: all of m g h but the little that the stretched wire holds at the end."""
    b = sc.ModelBuilder(sc.Water(density=0.0))
    b.add_prescribed_point("top")
    b.add_free_point("weight", mass=2.0)
    wire = sc.LineProperties(length=1.0, diameter=0.002, mass_per_length=0.02, axial_stiffness=6e5)
    b.add_line("wire", "top", "weight", wire, segments=1)
    model = b.build()
    state = sc.State(model)
    state.set_point("weight", (0, 0, -0.5))
    settings = {"energy_tolerance": 0.01, "inelastic_snaps": True}
    e = counted(model, state, FAR, 2.0, **settings).energy_balance
    drop = 9.81 * 0.5 * 2.0  # half of the wire's mass goes along: ½ %
    assert e.impact == pytest.approx(-drop, rel=0.03)
    assert abs(e.numerical) < 0.01 * e.exchanged


def test_bob_on_an_elastic_line_bounces():
    """A soft line without damping: kinetic, elastic and potential energy in turn, none lost."""
    b = sc.ModelBuilder(sc.Water(density=0.0))
    b.add_prescribed_point("top")
    b.add_free_point("bob", mass=1.0)
    line = sc.LineProperties(length=1.0, diameter=1e-3, mass_per_length=1e-9, axial_stiffness=100.0)
    b.add_line("line", "top", "bob", line, segments=1)
    model = b.build()
    state = sc.State(model)
    state.set_point("bob", (0, 0, -1.15))
    simulator = counted(
        model, state, FAR, math.pi / 10, integrator=sc.Newmark(), max_step=0.001
    )  # half a period, ω = 10 rad/s
    e = simulator.energy_balance
    # about a stretch of g/ω² = 0.0981 m: from 0.15 m to 2 · 0.0981 − 0.15
    assert e.elastic == pytest.approx(50 * (0.0462**2 - 0.15**2), rel=1e-3)
    assert e.potential == pytest.approx(9.81 * 2 * (0.15 - 0.0981), rel=1e-3)
    assert e.elastic + e.potential == pytest.approx(-e.kinetic, abs=1e-5)
    assert abs(e.numerical) < 1e-5 * e.exchanged


def test_waves_and_current_leave_nothing_unclassified():
    """A line that reaches out of the waves: all forces have a kind, and the balance closes."""
    sea = sc.regular_waves(height=0.3, period=2.0, direction=0.5, ramp_time=1.0)
    b = sc.ModelBuilder(sc.Water(current=(0.3, -0.1, 0), waves=sea))
    b.add_prescribed_point("tow_point")
    b.add_free_point("depressor", mass=5.0, volume=1e-3, drag_area=0.01, added_mass=0.5)
    line = sc.LineProperties(
        length=4.0, diameter=0.02, mass_per_length=0.6, axial_stiffness=1e5, axial_damping=100.0,
        bending_stiffness=2.0,
    )  # fmt: skip
    b.add_line("line", "tow_point", "depressor", line, segments=8)
    motion = sc.SteadyTow(position=(0, 0, 0.5), velocity=(1, 0, 0))
    result = sc.run(b.build(), motion, t_end=6.0, output_step=1.0, balance=True)
    e = {k: v[-1] for k, v in result.energy.items()}
    assert e["exchanged"] > 10
    assert abs(e["other"]) < 1e-9 * e["exchanged"]
    assert abs(e["numerical"]) < 2e-3 * e["exchanged"]
    assert e["damping"] < 0


def test_tow_point_pays_for_the_drag(wu_chwang_model):
    """The tow of Wu & Chwang: its work over two periods is what drag takes and what is stored."""
    model = wu_chwang_model()
    motion = sc.SliderCrank(
        mean=(0, 0, -2), velocity=(1.75, 0, 0), crank_radius=0.1, rod_length=0.35, period=1.6,
        ramp_time=3.2,
    )  # fmt: skip
    result = sc.run(model, motion, t_end=11.2, output_step=1.6, balance=True)
    e = {k: v[-1] - v[-3] for k, v in result.energy.items()}
    stored = sum(e[k] for k in STORED)
    assert e["tow_points"] > 50
    assert e["tow_points"] + e["drag"] + e["buoyancy"] + e["added_mass"] == pytest.approx(
        stored, abs=1e-3 * e["exchanged"]
    )
    assert abs(stored) < 0.05 * e["tow_points"]
    assert abs(e["numerical"]) < 1e-3 * e["exchanged"]
    assert e["other"] == pytest.approx(0, abs=1e-9 * e["exchanged"])
    tension_work = e["tow_points"] / (2 * 1.6 * 1.75)  # a mean force of some newtons
    assert 5 < tension_work < 60
    momentum = result.momentum["numerical"]
    assert np.abs(momentum[-1] - momentum[-3]).max() < 1e-3 * abs(
        result.momentum["weight"][-1, 2] - result.momentum["weight"][-3, 2]
    )
