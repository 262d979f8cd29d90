# SPDX-License-Identifier: Apache-2.0
"""Loads in lines, by balances and closed forms: hook load, end tensions, moment, curvature."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipk, ellipkinc

import sim_core as sc

G = 9.81


def wire(length, **changes):
    values = {"diameter": 0.01, "mass_per_length": 0.4, "axial_stiffness": 6e5, "added_mass": 0.0}
    return sc.LineProperties(length=length, **values | changes)


def drag(velocity, nodes, line, segments, density):
    """(3,) N on all of a line: ½ρ Cn d |u_n| u_n + ½ρ Ct π d |u_t| u_t per length, by segments."""
    u = -np.asarray(velocity)
    total = np.zeros(3)
    for step in np.diff(nodes, axis=0):
        t = step / np.linalg.norm(step)
        along = u @ t
        across = u - along * t
        per_length = 0.5 * density * line.normal_drag * line.diameter * np.linalg.norm(across)
        total += per_length * across * line.length / segments
        skin = 0.5 * density * line.tangential_drag * math.pi * line.diameter
        total += skin * abs(along) * along * t * line.length / segments
    return total


@pytest.mark.parametrize("speed", [0.0, 1.5])
def test_hook_load_of_a_steady_tow_is_weight_buoyancy_and_drag_of_everything(speed):
    """Newton's first law for the whole: nothing accelerates, so the pull on the tow point is the
    sum of all other forces. To newton_tolerance, 1e-9 of the weight, a node: 1e-7 of all."""
    line, mass, volume, area, segments = wire(8.0), 20.0, 4e-3, 0.02, 12
    tow = sc.System(
        water=sc.Water(density=1000.0),
        points={
            "ship": sc.PrescribedPoint(),
            "depressor": sc.FreePoint(mass=mass, volume=volume, drag_area=area),
        },
        lines={"cable": sc.Line("ship", "depressor", line, segments=segments)},
    )
    velocity = (speed, 0.3 * speed, 0.0)
    state = sc.steady_tow(tow.build(), position=(0, 0, -1.0), velocity=velocity)
    simulator = sc.Simulator(state.model, state)
    nodes = simulator.node_positions("cable")
    u = -np.array(velocity)
    expected = drag(velocity, nodes, line, segments, 1000.0)
    expected += 0.5 * 1000.0 * area * np.linalg.norm(u) * u
    displaced = 1000.0 * (volume + math.pi / 4 * line.diameter**2 * line.length)
    expected[2] += (displaced - mass - line.mass_per_length * line.length) * G
    load = simulator.hook_load("ship")
    assert load == pytest.approx(expected, abs=1e-7 * mass * G)
    # A limp line pulls in one direction only, its own.
    top, bottom = simulator.end_tensions("cable")
    assert top == pytest.approx(np.linalg.norm(load), rel=1e-12)
    weight = np.array([0.0, 0.0, (1000.0 * volume - mass) * G])
    held = weight + 0.5 * 1000.0 * area * np.linalg.norm(u) * u
    assert bottom == pytest.approx(np.linalg.norm(held), rel=1e-7)


def test_hook_load_carries_the_inertia_of_everything():
    """Newton's second law in vacuum, with the accelerations that the run recorded: a line of one
    segment has half its mass at each end. To newton_tolerance."""
    line, mass = wire(5.0), 20.0
    heavy = line.mass_per_length * line.length
    tow = sc.System(
        water=sc.Water(density=0.0),
        points={"crane": sc.PrescribedPoint(), "load": sc.FreePoint(mass=mass)},
        lines={"cable": sc.Line("crane", "load", line, segments=1)},
    )
    motion = sc.Sinusoid(mean=(0, 0, 0), velocity=(1, 0, 0), amplitude=0.3, period=2.5)
    run = sc.run(tow.build(), motion, t_end=3.0, output_step=0.1)
    crane, load = run.points["crane"], run.points["load"]
    gravity = np.array([0.0, 0.0, -G])
    expected = (mass + heavy / 2) * (gravity - load.acceleration)
    expected += heavy / 2 * (gravity - crane.acceleration)
    assert np.ptp(expected[:, 2]) > 30.0  # N: there is inertia
    assert crane.hook_load == pytest.approx(expected, abs=1e-6 * mass * G)
    assert load.hook_load is None
    assert run.lines["cable"].start_tension == pytest.approx(
        np.linalg.norm(crane.hook_load, axis=1), rel=1e-12
    )


def test_end_tensions_of_a_long_hanging_line_hold_all_of_it():
    """6000 m of line in 300 segments, in air: T(0) = (w L + W), T(L) = W. The segments' own
    tensions, those of their middles, are w ℓ/2 = 39 N off. Statics leaves 2e-9 of all weight at
    each of 300 nodes."""
    line, mass = wire(6000.0), 100.0
    deep = sc.System(
        water=sc.Water(density=0.0),
        points={"ship": sc.PrescribedPoint(), "weight": sc.FreePoint(mass=mass)},
        lines={"cable": sc.Line("ship", "weight", line, segments=300)},
    )
    state = sc.steady_tow(deep.build(), position=(0, 0, 0))
    simulator = sc.Simulator(state.model, state)
    whole = (mass + 0.4 * 6000.0) * G
    left = 300 * 2e-9 * whole
    assert simulator.end_tensions("cable") == pytest.approx([whole, mass * G], abs=left)
    assert simulator.tensions("cable")[0] == pytest.approx(whole - 0.4 * 10.0 * G, abs=left)


def test_several_lines_pull_on_one_hook():
    """Two lines and no other load: each pulls with its weight, drawn from either end."""
    rig = sc.System(
        water=sc.Water(density=0.0),
        points={
            "hook": sc.PrescribedPoint(),
            "a": sc.FreePoint(mass=5.0),
            "b": sc.FreePoint(mass=7.0),
        },
        lines={
            "first": sc.Line("hook", "a", wire(3.0), segments=3),
            "second": sc.Line("b", "hook", wire(2.0), segments=2),
        },
    )
    state = sc.steady_tow(rig.build(), position=(0, 0, 0))
    simulator = sc.Simulator(state.model, state)
    pull = (5.0 + 7.0 + 0.4 * 5.0) * G
    assert simulator.hook_load("hook") == pytest.approx([0, 0, -pull], abs=1e-6)
    assert simulator.end_tensions("second") == pytest.approx([7.0 * G, 7.8 * G], rel=1e-7)
    with pytest.raises(sc.InvalidInput, match="point 'a' moves freely"):
        simulator.hook_load("a")


def test_hook_load_of_a_winch_is_that_of_the_line_outside():
    """What is on the drum weighs on the ship, not on the line: T = W + w (length out)."""
    winched = sc.System(
        water=sc.Water(density=0.0),
        points={"ship": sc.PrescribedPoint(), "weight": sc.FreePoint(mass=30.0)},
        lines={"cable": sc.Line("ship", "weight", wire(40.0), segments=40, paid_out=12.25)},
    )
    state = sc.steady_tow(winched.build(), position=(0, 0, 0))
    simulator = sc.Simulator(state.model, state)
    expected = (30.0 + 0.4 * 12.25) * G
    assert simulator.hook_load("ship") == pytest.approx([0, 0, -expected], abs=1e-5)
    assert simulator.end_tensions("cable")[0] == pytest.approx(expected, rel=1e-7)


# ---------------------------------------------------------------------------------- bending


def beam(EI, length, segments, mass):
    """A weightless strip, clamped level at its root, with a weight at its tip."""
    strip = sc.LineProperties(
        length=length,
        diameter=1e-3,
        mass_per_length=0.05,
        axial_stiffness=1e5,
        displaced_area=0.05 / 1000.0,
        normal_drag=0.0,
        tangential_drag=0.0,
        added_mass=0.0,
        bending_stiffness=EI,
        slack_tension=1e-4,
    )
    b = sc.ModelBuilder(sc.Water(density=1000.0))
    b.add_prescribed_point("root")
    b.add_free_point("tip", mass=mass)
    b.add_line("beam", "root", "tip", strip, segments=segments, start_direction=(1, 0, 0))
    state = sc.steady_tow(b.build(), position=(0, 0, -5.0))
    return sc.Simulator(state.model, state)


def test_moment_of_a_cantilever_is_load_times_arm_at_every_node():
    """M = P (L − x) and κ = M/EI under a small load P; the springs' moments are in equilibrium at
    the nodes, so only the deflection is left: at P L²/EI = 1e-3 the arm is short by 1e-7."""
    EI, length, segments = 20.0, 2.0, 8
    load = 1e-3 * EI / length**2
    simulator = beam(EI, length, segments, load / G)
    expected = load * length * (1.0 - np.arange(segments + 1) / segments)
    # The axial strain of the strip and Newton's tolerance (1e-9 of 1 N) come to 1e-6.
    moments = simulator.bending_moments("beam")
    assert moments == pytest.approx(expected, abs=1e-5 * load * length)
    assert simulator.curvatures("beam") == pytest.approx(moments / EI, rel=1e-12)
    assert simulator.hook_load("root") == pytest.approx([0, 0, -load], abs=1e-5 * load)
    assert moments[-1] == 0.0


def test_moment_at_the_clamp_of_an_elastica_converges_with_order_2():
    """Large deflection (Bisshopp & Drucker 1945): with φ₀ the slope of the tip,

    √(P L²/EI) = K(k) − F(θ₁, k), 2k² = 1 + sin φ₀, sin θ₁ = 1/(k√2); first integral of
    EI φ'' + P cos φ = 0: M₀ = √(2 P EI sin φ₀). No force acts along the beam at its clamp."""
    alpha, length, mass = 3.0, 1.0, 0.5
    EI = mass * G * length**2 / alpha

    def misfit(sine):
        m = 0.5 * (1.0 + sine)  # k²
        start = math.asin(1.0 / math.sqrt(2.0 * m))
        return ellipk(m) - ellipkinc(start, m) - math.sqrt(alpha)

    sine = brentq(misfit, 1e-6, 1.0 - 1e-9, xtol=1e-14)
    expected = math.sqrt(2.0 * mass * G * EI * sine)
    errors = []
    for segments in (10, 20):
        simulator = beam(EI, length, segments, mass)
        moment = simulator.bending_moments("beam")[0]
        errors.append(abs(moment / expected - 1.0))
        assert simulator.curvatures("beam")[0] == pytest.approx(moment / EI, rel=1e-12)
        assert simulator.end_tensions("beam")[0] == pytest.approx(0.0, abs=1e-6 * mass * G)
    assert errors[0] < 1.0 / 10**2
    # What is left at the finer one is the stretch of the strip, 1e-5.
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)


def test_tip_of_an_elastica_is_pulled_by_the_part_of_the_load_along_it():
    """At the free end, which carries no moment, the tension is P sin φ₀ (order 2 in ℓ)."""
    alpha, length, mass = 3.0, 1.0, 0.5
    EI = mass * G * length**2 / alpha
    errors = []
    for segments in (10, 20):
        simulator = beam(EI, length, segments, mass)
        root_moment = simulator.bending_moments("beam")[0]
        sine = root_moment**2 / (2.0 * mass * G * EI)
        errors.append(abs(simulator.end_tensions("beam")[1] / (mass * G * sine) - 1.0))
    assert errors[1] < 2e-3
    assert errors[1] < 0.35 * errors[0]


def test_limp_lines_carry_no_moment():
    rig = sc.System(
        points={"hook": sc.PrescribedPoint(), "a": sc.FreePoint(mass=5.0)},
        lines={
            "limp": sc.Line("hook", "a", wire(3.0), segments=3),
            "stiff": sc.Line("hook", "a", wire(3.2, bending_stiffness=0.5), segments=4),
        },
    )
    law = sc.SteadyTow(position=(0, 0, 0), velocity=(1, 0, 0))
    run = sc.run(rig.build(), law, t_end=0.02)
    assert run.lines["limp"].bending_moments is None
    assert run.lines["limp"].curvatures is None
    assert run.lines["stiff"].bending_moments.shape == (3, 5)
    assert run.lines["stiff"].bending_moments[:, 1:-1].min() > 0.0
