# SPDX-License-Identifier: Apache-2.0
"""A falling sphere, a floating sphere, a large pendulum, and drag and added mass per axis."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import ellipk

import sim_core as sc
from sim_core import _core

STILL = sc.SteadyTow(position=(0, 0, 0))


def test_falling_sphere(free_sphere):
    """v = v_t tanh(t/τ), v_t = √(2W/(ρ Cd A)), τ = (m + m_a) v_t / W."""
    mass, volume, drag_area, added = 6.2, 0.697e-3, 0.47 * math.pi / 4 * 0.11**2, 0.35
    weight = (mass - 1000 * volume) * 9.81
    v_t = math.sqrt(2 * weight / (1000 * drag_area))
    tau = (mass + added) * v_t / weight
    model = free_sphere(mass, volume, drag_area, added)
    state = sc.State(model)
    state.set_point("sphere", (0, 0, -10))
    # Second order: the error is about (h/τ)²/12 = 2e-8 of v_t.
    simulator = sc.Simulator(model, state, max_step=tau / 2000)
    for t in (0.3 * tau, tau, 3 * tau):
        simulator.step(t, STILL)
        velocity = simulator.point_velocity("sphere")[2]
        assert velocity == pytest.approx(-v_t * math.tanh(t / tau), rel=1e-6)


def test_sphere_of_half_the_density_floats_half_immersed(free_sphere):
    volume = 0.697e-3
    model = free_sphere(500 * volume, volume, 0.004, 0.3)
    state = sc.steady_tow(model, position=(0, 0, 0))
    assert state.point_position("sphere")[2] == pytest.approx(0.0, abs=1e-6)


def test_large_pendulum():
    """T = 4 √(ℓ/g) K(sin²(θ0/2)); no energy is lost or made."""
    length, theta0 = 2.0, 1.4
    b = sc.ModelBuilder(sc.Water(density=0.0))
    b.add_prescribed_point("pivot")
    b.add_free_point("bob", mass=1.0)
    rod = sc.LineProperties(
        length=length, diameter=0.001, mass_per_length=1e-9, axial_stiffness=1e8
    )
    b.add_line("rod", "pivot", "bob", rod, segments=1)
    model = b.build()
    state = sc.State(model)
    state.set_point("bob", (length * math.sin(theta0), 0, -length * math.cos(theta0)))
    period = 4 * math.sqrt(length / 9.81) * ellipk(math.sin(theta0 / 2) ** 2)
    # h = T/4000: the period error is (2π/4000)²/12 = 2e-7
    result = sc.run(
        model,
        STILL,
        state=state,
        t_end=5.2 * period,
        output_step=period / 400,
        max_step=period / 4000,
    )
    x, t = result.points["bob"].position[:, 0], result.time
    down = np.flatnonzero((x[:-1] > 0) & (x[1:] <= 0))
    # cubic through four samples around each crossing: interpolation error below 1e-9 of the period
    crossings = []
    for i in down:
        window = slice(i - 1, i + 3)
        roots = np.polynomial.Polynomial.fit(t[window], x[window], 3).roots()
        real = roots[np.abs(roots.imag) < 1e-9].real
        crossings.append(real[np.argmin(np.abs(real - t[i]))])
    assert np.diff(crossings) == pytest.approx(np.full(len(crossings) - 1, period), rel=1e-5)
    swing = 9.81 * length * (1 - math.cos(theta0))
    start = -9.81 * length * math.cos(theta0)
    assert sc.energy(result.final_state).total == pytest.approx(start, abs=1e-5 * swing)


def force_on(model, velocity, acceleration=(0, 0, 0)):
    """Force on the only free point (tank axes), its inertia included."""
    state = sc.State(model)
    state.set_point("vane", (0, 0, -10), velocity)
    return _core._residual(_core._displaced(state, np.array(acceleration), (0, 0, 1)))


def free_point(add, current=(0, 0, 0)):
    """A model of one free point on a line so long and light that it is free."""
    b = sc.ModelBuilder(sc.Water(current=current))
    b.add_prescribed_point("far")
    add(b)
    thread = sc.LineProperties(
        length=1000.0, diameter=1e-20, mass_per_length=1e-15, axial_stiffness=1.0
    )
    b.add_line("thread", "far", "vane", thread, segments=1)
    return b.build()


AREAS, ADDED = (0.002, 0.02, 0.01), (0.3, 2.5, 1.1)


def vane(turning_speed, current=(0, 0, 0)):
    return free_point(
        lambda b: b.add_weathervane(
            "vane",
            mass=5.0,
            volume=5e-3,  # neutral: no weight is left
            drag_area=AREAS,
            added_mass=ADDED,
            turning_speed=turning_speed,
        ),
        current,
    )


def test_drag_and_added_mass_along_tank_axes():
    """Each axis alone: ½ρ A u² and (m + m_a) a; along a diagonal ½ρ A_i |u| u_i."""
    model = free_point(
        lambda b: b.add_free_point("vane", mass=5.0, volume=5e-3, drag_area=AREAS, added_mass=ADDED)
    )
    for axis in range(3):
        unit = np.eye(3)[axis]
        drag = force_on(model, 1.5 * unit)
        assert drag == pytest.approx(-0.5 * 1000 * AREAS[axis] * 1.5**2 * unit, abs=1e-9)
        inertia = force_on(model, (0, 0, 0), 2.0 * unit)
        assert inertia == pytest.approx(-2.0 * (5.0 + ADDED[axis]) * unit, abs=1e-9)
    v = np.array([1.0, -0.5, 0.7])
    expected = -0.5 * 1000 * np.array(AREAS) * np.linalg.norm(v) * v
    assert force_on(model, v) == pytest.approx(expected, abs=1e-9)


@given(
    heading=st.floats(-math.pi, math.pi),
    speed=st.floats(0.5, 5.0),
    drift=st.tuples(st.floats(-2, 2), st.floats(-2, 2)),
)
def test_weathervane_faces_the_flow(heading, speed, drift):
    """Whatever way it is towed and the water flows, the drag is that along the axis, in the
    direction of the relative flow. Exact but for (turning_speed/speed)² of the difference
    of the areas."""
    model = vane(turning_speed=1e-4, current=(*drift, 0.0))
    flow = speed * np.array([math.cos(heading), math.sin(heading), 0.0])
    force = force_on(model, np.array([*drift, 0.0]) - flow)
    assert force == pytest.approx(0.5 * 1000 * AREAS[0] * speed * flow, abs=1e-6 * speed**2)


def test_weathervane_at_rest_has_the_mean_of_along_and_across():
    model = vane(turning_speed=1.0)
    slow = 1e-6
    drag = force_on(model, (slow, 0, 0))[0]
    assert drag == pytest.approx(-0.5 * 1000 * (AREAS[0] + AREAS[1]) / 2 * slow**2, rel=1e-9)
    inertia = force_on(model, (0, 0, 0), (1.0, 0, 2.0))
    expected = [-(5.0 + (ADDED[0] + ADDED[1]) / 2), 0, -2.0 * (5.0 + ADDED[2])]
    assert inertia == pytest.approx(expected, rel=1e-12)
    # at the turning speed half way between the mean and along
    half = force_on(model, (0, 1.0, 0))[1]
    assert half == pytest.approx(-0.5 * 1000 * (0.75 * AREAS[0] + 0.25 * AREAS[1]), rel=1e-12)


def test_weathervane_in_a_turn_has_the_impulse_along_its_axis():
    """On a circle the axis turns with the velocity: the water's impulse is m_along v, its rate
    m_along v²/r inwards, whatever the added mass across."""
    model = vane(turning_speed=1e-4)
    speed, radius = 2.0, 8.0
    force = force_on(model, (speed, 0, 0), (0, speed**2 / radius, 0))
    assert force[1] == pytest.approx(-(5.0 + ADDED[0]) * speed**2 / radius, rel=1e-6)


def test_weathervane_of_equal_areas_is_a_sphere(free_sphere):
    sphere = free_sphere(5.0, 5e-3, 0.01, 0.7)
    model = free_point(
        lambda b: b.add_weathervane(
            "vane", mass=5.0, volume=5e-3, drag_area=[0.01] * 3, added_mass=[0.7] * 3
        )
    )
    velocity, acceleration = (0.3, -0.4, 0.2), np.array([0.5, 0.1, -1.0])
    state = sc.State(sphere)
    state.set_point("sphere", (0, 0, -10), velocity)
    expected = _core._residual(_core._displaced(state, acceleration, (0, 0, 1)))
    assert force_on(model, velocity, acceleration) == pytest.approx(expected, abs=1e-12)


def test_fin_depressor_hangs_at_the_angle_of_its_drag():
    """Steady tow: the cable's end is at tan φ = weight / drag along the axis."""
    b = sc.ModelBuilder(sc.Water())
    b.add_prescribed_point("top")
    b.add_weathervane("end", mass=6.0, volume=1e-3, drag_area=(0.02, 0.2, 0.1))
    thread = sc.LineProperties(length=2.0, diameter=1e-8, mass_per_length=1e-9, axial_stiffness=1e9)
    b.add_line("line", "top", "end", thread, segments=1)
    speed = 2.0
    state = sc.steady_tow(b.build(), position=(0, 0, -1), velocity=(1.6, -1.2, 0))
    x, y, z = state.point_position("end")
    area = 0.02 + 0.5 * (0.2 - 0.02) / (1 + (speed / 0.05) ** 2)
    drag = 0.5 * 1000 * area * speed**2
    # the thread's own drag area, 1.2 × 1e-8 m × 1 m at the end, is 6e-7 of the depressor's
    assert math.atan2(-1 - z, math.hypot(x, y)) == pytest.approx(
        math.atan2(5.0 * 9.81, drag), abs=1e-6
    )
    assert math.atan2(y, x) == pytest.approx(math.atan2(1.2, -1.6), abs=1e-9)


def test_refuses_a_vane_without_a_turning_speed():
    with pytest.raises(sc.InvalidInput, match="'vane': turning_speed"):
        vane(turning_speed=0.0)
    with pytest.raises(sc.InvalidInput, match="'vane': mass, volume, drag_area"):
        free_point(lambda b: b.add_free_point("vane", drag_area=(0.1, -0.1, 0.1)))
