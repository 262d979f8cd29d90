# SPDX-License-Identifier: Apache-2.0
"""Forces of accelerating water: Froude–Krylov and added mass, on points, lines and bodies."""

import math

import numpy as np
import pytest

import sim_core as sc

VOLUME = 1e-3
RATE = np.array([0.3, 0.1, 0.2])  # m/s²


def accelerating(duration=2.0):
    """Water from rest at a constant acceleration (a table of a straight line is that line)."""
    return sc.Water(
        current=sc.Current(series=[(0.0, (0.0, 0.0, 0.0)), (duration, tuple(duration * RATE))])
    )


def free(water, add):
    """What `add` puts into the builder as 'thing', on a line so long and light that it is free."""
    b = sc.ModelBuilder(water)
    b.add_prescribed_point("far")
    attachment = add(b)
    thread = sc.LineProperties(
        length=1000.0, diameter=1e-20, mass_per_length=1e-15, axial_stiffness=1.0
    )
    b.add_line("thread", "far", "thing", thread, segments=1, attachment=attachment)
    return b.build()


def far_away(place):
    return sc.SteadyTow(position=tuple(np.add(place, (0, 0, 900.0))))


def sphere(mass, drag_area=0.0, added_mass=0.5 * 1000.0 * VOLUME):
    def add(builder):
        builder.add_free_point(
            "thing", mass=mass, volume=VOLUME, drag_area=drag_area, added_mass=added_mass
        )

    return add


def fish(mass, centre_of_gravity=(0.0, 0.0, 0.0)):
    def add(builder):
        builder.add_body(
            "thing",
            sc.Body(
                mass=mass,
                inertia=(0.01, 0.2, 0.2),
                centre_of_gravity=centre_of_gravity,
                volume=VOLUME,
                diameter=0.05,
                length=0.6,
                added_mass=(0.1, 1.0, 0.9, 0.0, 0.05, 0.05),
                axial_drag=0.3,
                cross_flow_drag=1.1,
            ),
        )
        return (0.0, 0.0, 0.0)

    return add


@pytest.mark.parametrize("integrator", [sc.GeneralizedAlpha(), sc.Box(), sc.BackwardEuler()])
def test_neutral_sphere_moves_with_the_water(integrator):
    """(m + m_a) v̇ = (ρV + m_a) u̇ + drag(u − v) with m = ρV: v = u from rest, drag or not."""
    model = free(accelerating(), sphere(1000.0 * VOLUME, drag_area=0.01))
    state = sc.State(model)
    state.set_point("far", (0.0, 0.0, 890.0))
    state.set_point("thing", (0.0, 0.0, -10.0))
    simulator = sc.Simulator(model, state, integrator=integrator, max_step=0.01)
    assert simulator.state.point_acceleration("thing") == pytest.approx(RATE, abs=1e-9)
    simulator.step(1.5, far_away((0, 0, -10.0)))
    assert simulator.point_velocity("thing") == pytest.approx(1.5 * RATE, abs=1e-9)


def test_neutral_body_moves_with_the_water():
    model = free(accelerating(), fish(1000.0 * VOLUME))
    state = sc.State(model)
    state.set_point("far", (0.0, 0.0, 890.0))
    state.set_body("thing", (0.0, 0.0, -10.0), quaternion=(0.9, 0.1, -0.3, 0.2))
    simulator = sc.Simulator(model, state, max_step=0.01)
    simulator.step(1.5, far_away((0, 0, -10.0)))
    assert simulator.body_velocity("thing") == pytest.approx(1.5 * RATE, abs=1e-8)
    assert simulator.body_angular_velocity("thing") == pytest.approx(np.zeros(3), abs=1e-8)


def test_body_turns_about_its_centre_of_buoyancy_in_accelerating_water():
    """Water's pressure acts at the centre of buoyancy: a body whose mass is elsewhere turns."""
    g = 0.05
    model = free(accelerating(), fish(1000.0 * VOLUME, centre_of_gravity=(0.0, 0.0, -g)))
    state = sc.State(model)
    state.set_point("far", (0.0, 0.0, 890.0))
    state.set_body("thing", (0.0, 0.0, -10.0))
    simulator = sc.Simulator(model, state, max_step=0.01)
    # From rest, in x and pitch (added masses 0.1 and 0.05): the relative motion a of the origin
    #   (m + 0.1) a − m g α = 0,  (I + 0.05) α − m g a = m g u̇_x
    m = 1000.0 * VOLUME
    matrix = np.array([[m + 0.1, -m * g], [-m * g, 0.2 + 0.05]])
    a, alpha = np.linalg.solve(matrix, [0.0, m * g * RATE[0]])
    assert simulator.body_acceleration("thing")[0] == pytest.approx(RATE[0] + a, rel=1e-9)
    assert simulator.body_angular_acceleration("thing")[1] == pytest.approx(alpha, rel=1e-9)


def test_neutral_line_moves_with_the_water():
    """Along and across, slack, dragged or not."""
    diameter = 0.02
    area = math.pi / 4.0 * diameter**2
    b = sc.ModelBuilder(accelerating())
    b.add_prescribed_point("start")
    b.add_free_point("end")
    b.add_line(
        "line",
        "start",
        "end",
        sc.LineProperties(
            length=2.0,
            diameter=diameter,
            mass_per_length=1000.0 * area,
            axial_stiffness=100.0,
            normal_drag=1.2,
            tangential_drag=0.05,
            added_mass=1.0,
        ),
        segments=4,
    )
    model = b.build()
    state = sc.State(model)
    places = [np.array([0.1 * i, 0.2 * i, -10.0 - 0.05 * i**2]) for i in range(5)]
    state.set_point("start", places[0])
    for i in range(1, 4):
        state.set_line_node("line", i, places[i])
    state.set_point("end", places[4])
    # The start goes along with the water: p = ½ u̇ t², so the cubic through its ends is exact.
    simulator = sc.Simulator(model, state, max_step=0.01)
    simulator.step_to(1.0, position=places[0] + 0.5 * RATE, velocity=RATE)
    moved = simulator.node_positions("line") - 0.5 * RATE
    # Neutral but for the rounding of weight against buoyancy
    assert moved == pytest.approx(np.array(places), abs=1e-7)


def test_inertia_force_on_a_held_sphere():
    """(1 + Ca) ρV ∂u/∂t on a sphere so heavy that it stays, with drag where the flow is."""
    heavy, ca, drag_area = 1e6, 0.5, 0.02
    period, amplitude = 2.0, 0.4
    sea = sc.regular_waves(height=2.0 * amplitude, period=period)
    model = free(sc.Water(waves=sea), sphere(heavy, drag_area, ca * 1000.0 * VOLUME))
    k, omega = sea.wave_numbers()[0], math.pi
    for phase in (0.0, 0.25, 0.4):
        at = sc.State(model)
        at.set_point("far", (0.0, 0.0, 890.0))
        at.set_point("thing", (phase / k, 0.0, -2.0))
        total = heavy + ca * 1000.0 * VOLUME
        force = total * sc.Simulator(model, at, max_step=0.01).point_acceleration("thing")
        zeta = amplitude * math.cos(phase)
        u = (
            amplitude
            * omega
            * math.exp(k * (-2.0 - zeta))
            * np.array([math.cos(phase), 0.0, math.sin(phase)])
        )
        du = omega * np.array([u[2], 0.0, -u[0]])
        expected = (1.0 + ca) * 1000.0 * VOLUME * du
        expected += 500.0 * drag_area * np.linalg.norm(u) * u
        expected[2] += (1000.0 * VOLUME - heavy) * 9.81
        assert force == pytest.approx(expected, abs=1e-8)  # 1e-15 of its weight


def test_wave_force_and_moment_on_a_long_hull():
    """A level hull so heavy that it stays, half a wave long: (ρA + a) ∂w/∂t along it (Faltinsen
    1990, ch. 5, without forward speed), integrated exactly."""
    length, area, added = 1.3, 0.01, 8.0  # m, m², kg/m
    heavy, amplitude, depth = 1e6, 1e-3, 1.0
    sea = sc.regular_waves(height=2.0 * amplitude, period=1.29)
    k, omega = sea.wave_numbers()[0], sea.frequency[0]
    assert k * length == pytest.approx(math.pi, rel=0.01)

    def add(builder):
        hull = sc.Body(
            mass=heavy,
            inertia=np.full(3, heavy),
            volume=area * length,
            diameter=0.11,
            length=length,
            added_mass=(0.0, added * length, added * length, 0.0) + 2 * (added * length**3 / 12.0,),
            axial_drag=0.0,
            cross_flow_drag=0.0,
            munk_moment=0.0,
            strips=100,
        )
        builder.add_body("thing", hull)
        return (0.0, 0.0, 0.0)

    model = free(sc.Water(waves=sea), add)
    for phase in (0.0, 1.0, 2.0):
        state = sc.State(model)
        state.set_point("far", (0.0, 0.0, 890.0))
        state.set_body("thing", (phase / k, 0.0, -depth))
        simulator = sc.Simulator(model, state, max_step=0.01)
        # ∂w/∂t = −a ω² e^(kz) cos kx
        rate = -amplitude * omega**2 * math.exp(-k * depth)
        half = 0.5 * k * length
        along = rate * math.cos(phase) * 2.0 * math.sin(half) / k
        first = -rate * math.sin(phase) * 2.0 * (math.sin(half) - half * math.cos(half)) / k**2
        total = heavy + added * length
        force = total * simulator.body_acceleration("thing")[2]
        force += (heavy - 1000.0 * area * length) * 9.81
        inertia = heavy + added * length**3 / 12.0
        moment = inertia * simulator.body_angular_acceleration("thing")[1]
        # The stretching moves the waves by ζ, k a = 2.4e-3 of them; 100 strips: (k dx)²/24 = 4e-5
        scale = (1000.0 * area + added) * abs(rate)
        assert force == pytest.approx((1000.0 * area + added) * along, abs=4e-3 * scale * length)
        assert moment == pytest.approx(
            -(1000.0 * area + added) * first, abs=4e-3 * scale * length**2 / 4.0
        )


def test_neutral_particle_follows_the_orbit_of_small_waves():
    amplitude, period, depth = 1e-4, 2.0, 0.5
    sea = sc.regular_waves(height=2.0 * amplitude, period=period)
    model = free(sc.Water(waves=sea), sphere(1000.0 * VOLUME))
    k, omega = sea.wave_numbers()[0], math.pi
    orbit = amplitude * math.exp(-k * depth)
    # Particle on its orbit: x = −r sin(ωt − kx₀)... about (0, −depth)
    state = sc.State(model)
    state.set_point("far", (0.0, 0.0, 890.0))
    state.set_point("thing", (0.0, 0.0, -depth + orbit), (orbit * omega, 0.0, 0.0))
    simulator = sc.Simulator(model, state, max_step=0.01)
    motion = far_away((0, 0, -10.0))
    for i in range(1, 9):
        time = i * period / 4.0
        simulator.step(time, motion)
        x, _, z = simulator.point_position("thing")
        # Second order: Stokes drift k r² ω t and Wheeler's shift k a r, both below 5e-4 of r; the
        # scheme's period error at 200 steps a period is 1e-4 a radian.
        drift = k * orbit * omega * time + 2.0 * k * amplitude
        tolerance = orbit * (drift + 2e-4 * omega * time)
        assert x == pytest.approx(orbit * math.sin(omega * time), abs=tolerance)
        assert z + depth == pytest.approx(orbit * math.cos(omega * time), abs=tolerance)


def test_continues_bit_for_bit_in_moving_water():
    sea = sc.jonswap_sea(
        significant_height=0.3, peak_period=2.0, components=20, seed=1, ramp_time=1
    )
    current = sc.Current(
        profile=[(0.0, (0.5, 0, 0)), (-3.0, (0.1, 0, 0))],
        series=[(0.0, (0, 0, 0)), (5.0, (0.2, 0.1, 0))],
    )
    b = sc.ModelBuilder(sc.Water(current=current, waves=sea))
    b.add_prescribed_point("top")
    b.add_free_point("weight", mass=3.0, volume=0.5e-3, drag_area=3e-3, added_mass=0.3)
    cable = sc.LineProperties(length=2.0, diameter=0.01, mass_per_length=0.2, axial_stiffness=1e5)
    b.add_line("cable", "top", "weight", cable, segments=5)
    model = b.build()
    motion = sc.SteadyTow(position=(0, 0, 0.3), velocity=(0.5, 0, 0))
    state = sc.steady_tow(model, position=(0, 0, 0.3), velocity=(0.5, 0, 0))
    for integrator in (sc.GeneralizedAlpha(), sc.Box()):
        straight = sc.Simulator(model, state, integrator=integrator, max_step=0.01)
        straight.step(0.5, motion)
        saved = straight.save()
        resumed = sc.Simulator(model, state, integrator=integrator, max_step=0.01)
        resumed.restore(saved)
        for simulator in (straight, resumed):
            simulator.step(1.0, motion)
        assert straight.save() == resumed.save()
