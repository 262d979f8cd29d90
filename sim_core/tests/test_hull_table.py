# SPDX-License-Identifier: Apache-2.0
"""Hull forces from a table over angle of attack and sideslip."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sim_core as sc
from sim_core import _core

FAR = (0.0, 0.0, -900.0)
AREA, LENGTH, RANGE = 0.0095, 1.3, math.radians(40)


def angles(count=9):
    return np.linspace(-RANGE, RANGE, count)


def smooth(a, b):
    """Six functions of attack and sideslip without any symmetry."""
    return [
        0.3 + a**2 + 0.5 * b**2 + 0.1 * a * b,
        -1.2 * b + 0.2 * a * b + 0.3 * b**2,
        1.5 * a - 0.4 * a**2 + 0.1 * b,
        0.02 * a * b - 0.01 * b,
        -0.6 * a + 0.1 * a**2 + 0.05 * b**2,
        0.5 * b + 0.07 * a * b,
    ]


@pytest.fixture(scope="module")
def table():
    rows = [[smooth(a, b) for b in angles()] for a in angles()]
    return sc.HullTable(
        attack=angles(), sideslip=angles(), coefficients=rows, area=AREA, length=LENGTH
    )


@pytest.fixture(scope="module")
def round_hull():
    return sc.polynomial_hull(
        (0.3, 0, 1.0),
        (0, 1.5, -0.3),
        (0, 0.6, -0.2),
        area=AREA,
        length=LENGTH,
        largest_angle=RANGE,
    )


def body(table, **changes):
    settings = {
        "mass": 12.5, "inertia": (0.02, 1.8, 1.8), "volume": 0.0125, "diameter": 0.11,
        "length": LENGTH, "axial_drag": 0.0, "cross_flow_drag": 0.0, "munk_moment": 0.0,
        "hull_table": table,
    }  # fmt: skip
    return sc.Body(**(settings | changes))


def wrench(model, velocity, spin=(0, 0, 0)):
    """Force and moment on a body that points along the tank's axes."""
    state = sc.State(model)
    state.set_body("fish", FAR, velocity=velocity, angular_velocity=spin)
    residual = _core._residual(state)
    return residual[:3], residual[3:]


def velocity_at(attack, sideslip, speed=1.0):
    return speed * np.array(
        [
            math.cos(attack) * math.cos(sideslip),
            math.sin(sideslip),
            -math.sin(attack) * math.cos(sideslip),
        ]
    )


@given(attack=st.floats(-RANGE, RANGE), sideslip=st.floats(-RANGE, RANGE))
def test_second_degree_is_reproduced(table, attack, sideslip):
    assert table.at(attack, sideslip) == pytest.approx(smooth(attack, sideslip), abs=1e-12)


def test_interpolation_error_is_of_third_order():
    """Of sin 3α. The slopes of the parabolas are off by h² f'''/6: h³ in the values."""
    errors = []
    for count in (9, 17, 33):
        rows = [[[math.sin(3 * a)] * 6 for _ in range(3)] for a in angles(count)]
        t = sc.HullTable(
            attack=angles(count), sideslip=angles(3), coefficients=rows, area=1, length=1
        )
        errors.append(max(abs(t.at(a)[2] - math.sin(3 * a)) for a in np.linspace(-0.1, 0.1, 101)))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx([3, 3], abs=0.1)


def test_slope_is_continuous_at_the_nodes():
    """Across a node of a table of noise the one-sided difference quotients agree."""
    t = sc.HullTable(
        attack=[-0.5, -0.1, 0.0, 0.3, 0.6],
        sideslip=[-0.4, 0.1, 0.5, 0.6],
        coefficients=np.random.default_rng(3).normal(size=(5, 4, 6)),
        area=1,
        length=1,
    )
    h = 1e-6  # times second derivatives of some 100
    for a in (-0.1, 0.0, 0.3):
        for b in (-0.3, 0.1, 0.55):
            left, right = t.at(a, b) - t.at(a - h, b), t.at(a + h, b) - t.at(a, b)
            assert left / h == pytest.approx(right / h, abs=1e-2)
    for b in (0.1, 0.5):
        below, above = t.at(0.17, b) - t.at(0.17, b - h), t.at(0.17, b + h) - t.at(0.17, b)
        assert below / h == pytest.approx(above / h, abs=1e-2)


def test_force_and_moment_in_their_axes(free_body, table):
    """Drag against the velocity, lift normal to it in the turned plane of symmetry, side force to
    port; moments about the body's axes."""
    attack, sideslip, speed = 0.3, 0.2, 1.7
    v = velocity_at(attack, sideslip, speed)
    force, moment = wrench(free_body(body(table)), v)
    c = smooth(attack, sideslip)
    q = 0.5 * 1000 * speed**2 * AREA
    up = np.array([math.sin(attack), 0, math.cos(attack)])
    side = np.cross(up, v / speed)
    assert side[1] > 0.9
    assert force @ (v / speed) == pytest.approx(-q * c[0], rel=1e-9)
    assert force @ side == pytest.approx(q * c[1], rel=1e-9)
    assert force @ up == pytest.approx(q * c[2], rel=1e-9)
    assert moment == pytest.approx(q * LENGTH * np.array(c[3:]), rel=1e-9)


@given(
    velocity=st.tuples(*[st.floats(-2, 2)] * 3).filter(lambda v: sum(x * x for x in v) > 0.01),
    spin=st.tuples(*[st.floats(-1, 1)] * 3),
    height=st.sampled_from([-900.0, 0.03]),  # immersed; half out of the water
)
def test_jacobian_matches_differences_at_any_flow(free_body, table, velocity, spin, height):
    """Central differences. Left out: where the flow crosses the edge of the range or lies along y,
    slopes jump and the difference quotient lies between both sides."""
    model = free_body(body(table, cross_flow_drag=1.1, strips=5))
    state = sc.State(model)
    q = np.array([0.9, 0.2, -0.3, 0.1]) / math.sqrt(0.95)
    w, u, v = q[0], q[1:], np.array(velocity)  # v in body axes
    place = (0.0, 0.0, height)
    state.set_body("fish", place, q, v + 2 * np.cross(u, np.cross(u, v) + w * v), spin)
    level = math.hypot(v[0], v[2])
    attack, sideslip = math.atan2(-v[2], v[0]), math.atan2(v[1], level)
    kinks = [abs(abs(attack) - RANGE), abs(abs(sideslip) - RANGE), math.pi - abs(attack)]
    if min([*kinks, level]) < 0.01:
        return
    h = 1e-6
    for rates in ((1, 0, 0), (0, 1, 0)):
        analytic = _core._jacobian(state, rates)
        for i in range(6):
            step = np.zeros(6)
            step[i] = h
            up = _core._residual(_core._displaced(state, step, rates))
            down = _core._residual(_core._displaced(state, -step, rates))
            # slopes of |u|u and of the immersed fraction jump as well: h × 1e3 there
            assert (up - down) / (2 * h) == pytest.approx(analytic[:, i], abs=2e-3)


@given(attack=st.floats(-math.pi, math.pi), sideslip=st.floats(-math.pi / 2, math.pi / 2))
def test_force_never_drives_the_hull(free_body, table, attack, sideslip):
    """Also beyond the range of the table, where drag stays and the rest fades."""
    v = velocity_at(attack, sideslip)
    force, _ = wrench(free_body(body(table)), v)
    assert force @ v < 0.0


def test_beyond_the_range_lift_and_moment_fade(free_body, round_hull):
    """Symmetric hull: only drag in flow from behind and from the side; no jump on the way."""
    at_edge = round_hull.at(RANGE)
    for angle in (math.pi, -math.pi):
        assert round_hull.at(angle)[1:] == pytest.approx(np.zeros(5), abs=1e-15)
        assert round_hull.at(angle)[0] == pytest.approx(at_edge[0])
    assert round_hull.at(0.3, math.pi / 2)[1:] == pytest.approx(np.zeros(5), abs=1e-15)
    half_way = (RANGE + math.pi) / 2
    assert round_hull.at(half_way) == pytest.approx([at_edge[0], *at_edge[1:] / 2], abs=1e-12)
    model = free_body(body(round_hull))
    for edge in (RANGE, math.pi):
        inside, _ = wrench(model, velocity_at(edge - 1e-9, 0))
        outside, _ = wrench(model, velocity_at(edge + 1e-9, 0))
        assert inside == pytest.approx(outside, abs=1e-6)


def test_hull_of_revolution_follows_its_polynomials(free_body, round_hull):
    """In the plane of attack and, turned by 90°, in that of sideslip; exactly at the nodes."""
    model = free_body(body(round_hull))
    angle = math.radians(15)
    q = 0.5 * 1000 * AREA
    force, moment = wrench(model, velocity_at(angle, 0))
    assert force @ velocity_at(angle, 0) == pytest.approx(-q * (0.3 + angle**2), rel=1e-9)
    lift = q * (1.5 * angle - 0.3 * angle**2)
    assert force @ [math.sin(angle), 0, math.cos(angle)] == pytest.approx(lift, rel=1e-9)
    # nose further up, which is a negative moment about y
    turning = q * LENGTH * (0.6 * angle - 0.2 * angle**2)
    assert moment == pytest.approx([0, -turning, 0], abs=1e-9)
    # velocity to port instead of down: force to starboard instead of up, nose further to starboard
    to_port, turn = wrench(model, velocity_at(0, angle))
    assert to_port == pytest.approx([force[0], -force[2], 0], abs=1e-9)
    assert turn == pytest.approx([0, 0, -turning], abs=1e-9)


def test_hull_of_revolution_is_round_between_the_nodes(free_body, round_hull):
    """At 15° in an oblique plane as in the plane of attack. Third order at 2.5° spacing: (0.044)³
    of third derivatives of about 1 leaves 1e-4."""
    model = free_body(body(round_hull))
    angle = math.radians(15)
    force, _ = wrench(model, velocity_at(angle, 0))
    across = math.sin(angle) * np.array([math.cos(0.7), math.sin(0.7)])
    oblique, _ = wrench(model, (math.cos(angle), across[0], -across[1]))
    q = 0.5 * 1000 * AREA
    assert oblique[0] == pytest.approx(force[0], abs=2e-4 * q)
    assert math.hypot(oblique[1], oblique[2]) == pytest.approx(abs(force[2]), abs=2e-4 * q)


def test_rotation_is_damped_by_the_strips_alone(free_body, table):
    """Without rotation the strips add nothing to the table; with it they damp as without a table:
    ρ Cd d L⁴ q² / 64 in pitch at rest."""
    v = velocity_at(0.2, 0.1, 1.3)
    plain, plain_moment = wrench(free_body(body(table)), v)
    force, moment = wrench(free_body(body(table, cross_flow_drag=1.1)), v)
    assert force == pytest.approx(plain, abs=1e-9)
    assert moment == pytest.approx(plain_moment, abs=1e-9)
    q = 0.7
    damped = free_body(body(table, cross_flow_drag=1.1, strips=200))
    _, damping = wrench(damped, (0, 0, 0), (0, q, 0))
    assert damping[1] == pytest.approx(-1000 * 1.1 * 0.11 * LENGTH**4 * q * q / 64, rel=1e-4)


def test_tow_of_a_hull_with_a_table_settles_at_its_trim(round_hull):
    """Statics and a run: the pitch is that without a moment about the tow point, and stays."""
    nose = (0.65, 0.0, 0.0)
    tail = [
        sc.Fin(position=(-0.55, 0, 0), normal=n, area=0.02, lift_slope=3.0)
        for n in ((0, 0, 1), (0, 1, 0))
    ]
    fish = body(
        round_hull,
        fins=tail,
        centre_of_gravity=(0.01, 0, -0.01),
        added_mass=sc.hull_added_mass(LENGTH, 0.11),
        cross_flow_drag=1.1,
    )
    b = sc.ModelBuilder(sc.Water())
    b.add_prescribed_point("top")
    b.add_body("fish", fish)
    line = sc.LineProperties(length=5.0, diameter=0.001, mass_per_length=0.001, axial_stiffness=1e5)
    b.add_line("line", "top", "fish", line, segments=4, attachment=nose)
    model = b.build()
    state = sc.steady_tow(model, position=(0, 0, -20), velocity=(1.5, 0, 0))
    trimmed = sc.trimmed_pitch(fish, nose, 1.5)
    assert 0.005 < trimmed < 0.1
    law = sc.SteadyTow(position=(0, 0, -20), velocity=(1.5, 0, 0))
    result = sc.run(model, law, state=state, t_end=1.0, output_step=0.1)
    angles = result.bodies["fish"].yaw_pitch_roll
    assert angles == pytest.approx(np.tile([0, trimmed, 0], (11, 1)), abs=1e-5)


def test_refuses_impossible_tables(free_body, table):
    good = {
        "attack": angles(3), "sideslip": angles(3), "coefficients": np.zeros((3, 3, 6)),
        "area": 1.0, "length": 1.0,
    }  # fmt: skip
    for change, message in (
        ({"attack": [0.0, 0.1]}, "attack must ascend"),
        ({"attack": [0.0, 0.2, 0.1]}, "attack must ascend"),
        ({"sideslip": [-1.6, 0.0, 1.6]}, "sideslip must ascend"),
        ({"coefficients": np.zeros((3, 2, 6))}, "6 coefficients"),
        ({"coefficients": np.full((3, 3, 6), np.nan)}, "finite"),
        ({"area": 0.0}, "area"),
    ):
        with pytest.raises(sc.InvalidInput, match=message):
            sc.HullTable(**(good | change))
    with pytest.raises(sc.InvalidInput, match="give axial_drag=0 and munk_moment=0"):
        free_body(body(table, munk_moment=1.0))
    with pytest.raises(ValueError, match="0 at angle 0"):
        sc.polynomial_hull((0.3,), (0.1,), (0.0,), area=1, length=1, largest_angle=0.5)
