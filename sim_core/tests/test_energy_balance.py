# SPDX-License-Identifier: Apache-2.0
"""Where energy goes: nowhere without dissipation, into drag and damping with it."""

import numpy as np
import pytest

import sim_core as sc

STILL = sc.SteadyTow(position=(0, 0, 5))


def swinging_line(density=0.0, damping=0.0, normal_drag=0.0):
    """A soft line with an end mass, let go horizontally."""
    b = sc.ModelBuilder(sc.Water(density=density))
    b.add_prescribed_point("top")
    b.add_free_point("end", mass=0.5)
    line = sc.LineProperties(
        length=2.0,
        diameter=0.01,
        mass_per_length=0.3,
        axial_stiffness=500.0,
        axial_damping=damping,
        normal_drag=normal_drag,
        tangential_drag=0.0,
    )
    segments = 8
    b.add_line("line", "top", "end", line, segments=segments)
    model = b.build()
    state = sc.State(model)
    height = 5.0 if density == 0.0 else -5.0
    spacing = 2.0 / segments * 1.02
    state.set_point("top", (0, 0, height))
    for i in range(1, segments):
        state.set_line_node("line", i, (i * spacing, 0, height))
    state.set_point("end", (segments * spacing, 0, height))
    return model, state


def energies(model, state, motion, step=0.001, rho_inf=1.0):
    simulator = sc.Simulator(
        model,
        state,
        integrator=sc.GeneralizedAlpha(rho_inf=rho_inf),
        max_step=step,
        newton_tolerance=1e-13,
    )
    values = [sc.energy(simulator.state).total]
    for i in range(1, 101):
        simulator.step(0.01 * i, motion)
        values.append(sc.energy(simulator.state).total)
    return np.array(values)


def test_conserved_in_vacuum():
    model, state = swinging_line()
    total = energies(model, state, STILL)
    kinetic_scale = 9.81 * 2.0 * (0.5 + 0.3)  # potential energy of the drop
    # trapezoidal rule: the error oscillates with (ω h)²/12 of the elastic part, ω of the stiffest
    # axial mode 2√(EA/m)/ℓ = 330 rad/s: below 1 % of the few joules there
    assert np.abs(total - total[0]).max() < 2e-3 * kinetic_scale


def test_conservation_error_is_of_second_order():
    model, state = swinging_line()
    coarse = energies(model, state, STILL, step=0.000125)
    fine = energies(model, state, STILL, step=0.0000625)
    ratio = np.abs(coarse - coarse[0]).max() / np.abs(fine - fine[0]).max()
    assert 3.0 < ratio < 5.5


def test_axial_vibration_in_water_keeps_the_energy_with_that_of_its_added_mass():
    """Without drag an upright line that vibrates along itself loses nothing to the water."""
    b = sc.ModelBuilder(sc.Water())
    b.add_prescribed_point("top")
    b.add_free_point("end", mass=1.0)
    line = sc.LineProperties(
        length=2.0, diameter=0.02, mass_per_length=0.8, axial_stiffness=500.0,
        normal_drag=0.0, tangential_drag=0.0, tangential_added_mass=1.0,
    )  # fmt: skip
    b.add_line("line", "top", "end", line, segments=4)
    model = b.build()
    state = sc.State(model)
    state.set_point("top", (0, 0, -5))
    for i in range(1, 4):
        state.set_line_node("line", i, (0, 0, -5 - 0.5 * i))
    state.set_point("end", (0, 0, -7))
    step = 5e-4
    total = energies(model, state, sc.SteadyTow(position=(0, 0, -5)), step=step)
    # It drops by about W L/EA = 6 cm and more, W ≈ 10 N of the end and half the line. The error of
    # the trapezoidal rule oscillates with (ω h)²/12 of that, ω ≤ 2√(EA/(m + ρA))/(L/4) = 84 rad/s:
    # 2e-4.
    scale = 10.0 * 0.06
    assert np.abs(total - total[0]).max() < 1e-3 * scale


def test_structural_damping_only_dissipates():
    model, state = swinging_line(damping=2.0)
    total = energies(model, state, STILL, step=0.0005)
    assert total[-1] < total[0] - 0.01
    assert np.diff(total).max() < 1e-4


def test_loss_equals_work_against_drag():
    """A line in water: the energy lost is the integral of the power of the normal drag."""
    model, state = swinging_line(density=1000.0, normal_drag=1.2)
    motion = sc.SteadyTow(position=(0, 0, -5))
    simulator = sc.Simulator(
        model, state, integrator=sc.GeneralizedAlpha(rho_inf=1.0), max_step=0.0005
    )
    half = 0.5 * 1000 * 1.2 * 0.01 * (2.0 / 8) / 2  # ½ρ Cn d ℓ/2 at each end of a segment

    def drag_power():
        x, v = simulator.node_positions("line"), simulator.node_velocities("line")
        t = np.diff(x, axis=0)
        t /= np.linalg.norm(t, axis=1, keepdims=True)
        power = 0.0
        for end in (v[:-1], v[1:]):
            across = end - np.sum(end * t, axis=1, keepdims=True) * t
            power += half * np.sum(np.linalg.norm(across, axis=1) ** 3)
        return power

    def added_mass_power():
        # e (I − t tᵀ) a does work at the nodes; ½ e |v_n|² changes besides as t turns
        x, v = simulator.node_positions("line"), simulator.node_velocities("line")
        a = simulator.node_accelerations("line")
        e = 1000 * np.pi / 4 * 0.01**2 * (2.0 / 8) / 2
        t = np.diff(x, axis=0)
        length = np.linalg.norm(t, axis=1, keepdims=True)
        t /= length
        rate = np.diff(v, axis=0)
        t_rate = (rate - np.sum(rate * t, axis=1, keepdims=True) * t) / length
        power = 0.0
        for v_end, a_end in ((v[:-1], a[:-1]), (v[1:], a[1:])):
            v_t = np.sum(v_end * t, axis=1)
            work = np.sum(v_end * a_end, axis=1) - v_t * np.sum(a_end * t, axis=1)
            change = work - v_t * np.sum(v_end * t_rate, axis=1)
            power += e * np.sum(change - work)
        return power

    start = sc.energy(simulator.state).total
    lost, step = 0.0, 0.002
    before = drag_power() - added_mass_power()
    for i in range(1, 501):
        simulator.step(step * i, motion)
        now = drag_power() - added_mass_power()
        lost += 0.5 * step * (before + now)
        before = now
    change = start - sc.energy(simulator.state).total
    assert lost > 0.5
    assert change == pytest.approx(lost, rel=0.01)
