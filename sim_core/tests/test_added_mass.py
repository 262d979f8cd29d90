# SPDX-License-Identifier: Apache-2.0
"""Added mass: Lamb's coefficients, strip theory, and Kirchhoff's equations with a full matrix."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

import sim_core as sc
from sim_core import _core

FAR = (0.0, 0.0, -900.0)
STILL = sc.SteadyTow(position=(0, 0, 0))


@pytest.mark.parametrize(
    ("fineness", "axial", "lateral", "rotational"),
    [
        (1.0, 0.5, 0.5, 0.0),
        (1.5, 0.305, 0.621, 0.094),
        (2.0, 0.209, 0.702, 0.240),
        (2.99, 0.122, 0.803, 0.465),
        (3.99, 0.082, 0.860, 0.608),
        (4.99, 0.059, 0.895, 0.701),
        (6.01, 0.045, 0.918, 0.764),
        (8.01, 0.029, 0.945, 0.840),
        (9.97, 0.021, 0.960, 0.883),
        (math.inf, 0.0, 1.0, 1.0),
    ],
)
def test_lambs_table(fineness, axial, lateral, rotational):
    """Lamb (1918), Rep. Memo. 623. His ratios are rounded to 0.005, which moves the coefficients
    by up to 1.3e-3, and he worked with three-place tables. Exact to 1e-8 below."""
    k = sc.lamb_coefficients(fineness)
    assert k.axial == pytest.approx(axial, abs=2.5e-3)
    assert k.lateral == pytest.approx(lateral, abs=2.5e-3)
    assert k.rotational == pytest.approx(rotational, abs=2.5e-3)


@given(fineness=st.floats(1.0, 50.0))
def test_lambs_coefficients_solve_his_integrals(fineness):
    """α0 = a b² ∫ du / ((a² + u)^{3/2} (b² + u)), β0 likewise; k1 = α0/(2 − α0), k2 = β0/(2 − β0).

    With b = 1 and u = b² (1/s² − 1) the integrals are finite; the quadrature is good to 1e-10."""
    a2 = fineness**2

    def integral(power_a, power_b):
        def integrand(s):
            u = 1 / s**2 - 1
            return 2 / s**3 / ((a2 + u) ** power_a * (1 + u) ** power_b)

        return fineness * quad(integrand, 0, 1, epsabs=1e-13, epsrel=1e-12)[0]

    alpha, beta = integral(1.5, 1), integral(0.5, 2)
    k = sc.lamb_coefficients(fineness)
    assert k.axial == pytest.approx(alpha / (2 - alpha), abs=1e-9)
    assert k.lateral == pytest.approx(beta / (2 - beta), abs=1e-9)
    shape = (a2 - 1) / (a2 + 1)
    rotational = shape**2 * (beta - alpha) / (2 * shape - (beta - alpha)) if a2 > 1 else 0.0
    assert k.rotational == pytest.approx(rotational, abs=1e-8)


def test_no_coefficients_below_a_sphere():
    with pytest.raises(ValueError, match="no prolate spheroid"):
        sc.lamb_coefficients(0.9)


def test_hull_takes_the_coefficients_times_what_it_displaces():
    k = sc.lamb_coefficients(10.0)
    matrix = sc.hull_added_mass(1.0, 0.1)
    mass = 1000 * math.pi / 6 * 0.1**2
    inertia = mass * (1.0 + 0.1**2) / 20
    expected = [k.axial * mass, *[k.lateral * mass] * 2, 0, *[k.rotational * inertia] * 2]
    assert matrix == pytest.approx(np.diag(expected), rel=1e-12)
    assert sc.hull_added_mass(1.0, 0.1, density=1025.0) == pytest.approx(1.025 * matrix, rel=1e-12)


@pytest.mark.parametrize("fineness", [1.0, 2.5, 11.8])
def test_surface_of_a_spheroid_has_lambs_added_mass(fineness):
    """The panel method knows nothing of Lamb's closed form. Rings inscribed in the spheroid enclose
    1.6/n² less of it (n = 60: 0.05 %), a part of what 60 rings are off: 0.1 %."""
    angle = np.linspace(math.pi, 0.0, 61)
    radius = 0.05 * np.sin(angle)
    radius[[0, -1]] = 0.0
    profile = np.column_stack([0.05 * fineness * np.cos(angle), radius])
    matrix = sc.revolution_added_mass(profile, rings=60)
    exact = sc.hull_added_mass(0.1 * fineness, 0.1)
    mass = 1000 * math.pi / 6 * 0.1**3 * fineness
    assert np.diag(matrix)[:3] == pytest.approx(np.diag(exact)[:3], rel=1e-3, abs=1e-3 * mass)
    inertia = mass * 0.1**2 * (fineness**2 + 1) / 20
    assert np.diag(matrix)[3:] == pytest.approx(np.diag(exact)[3:], rel=2e-3, abs=1e-3 * inertia)
    assert matrix - np.diag(np.diag(matrix)) == pytest.approx(np.zeros((6, 6)), abs=1e-6 * mass)


def cylinder(fineness, middle=0.0):
    """Of a diameter of 1 m, without added mass of its own per length: (matrix, displaced mass)."""
    ends = [(middle - fineness / 2, 0.5), (middle + fineness / 2, 0.5)]
    return sc.revolution_added_mass(ends), 1000 * math.pi / 4 * fineness


@pytest.mark.parametrize(
    ("fineness", "coefficient"), [(1.2, 0.62), (2.5, 0.78), (5.0, 0.90), (9.0, 0.96)]
)
def test_cylinder_across_its_axis(fineness, coefficient):
    """DNV-RP-C205, table D-2, right circular cylinder across its axis, whose values are rounded
    and, at the slender end, about 3 % higher than potential flow (the same from 160 rings)."""
    matrix, mass = cylinder(fineness)
    assert matrix[1, 1] / mass == pytest.approx(coefficient, rel=0.035)
    assert matrix[2, 2] == matrix[1, 1]


def test_slender_cylinder_in_pitch_is_strips_less_what_escapes_at_the_ends():
    """Far from its ends each strip moves its own displaced mass: m L²/12 in pitch. Round an end,
    within about a diameter, water escapes; a loss at x = ±L/2 acts like a shorter cylinder, to
    second order: with 1 − c/L of it across, (1 − c/L)³ in pitch. Fineness 12, the NIT fish."""
    matrix, mass = cylinder(11.8)
    across = matrix[1, 1] / mass
    assert across == pytest.approx(0.9455, abs=1e-3)
    pitch = matrix[4, 4] / (mass * 11.8**2 / 12)
    assert pitch == pytest.approx(across**3, rel=0.01)
    # 2.3 times that of the spheroid which it encloses
    assert matrix[4, 4] / sc.hull_added_mass(11.8, 1.0)[4, 4] == pytest.approx(2.3, abs=0.05)


def test_profile_about_another_origin():
    """The panel method finds what parallel axes say; also the signs of the coupling."""
    centred, shifted = cylinder(4.0)[0], cylinder(4.0, middle=0.7)[0]
    expected = sc.about_origin(centred, (0.7, 0, 0))
    assert shifted == pytest.approx(expected, abs=1e-9 * expected.max())
    assert expected[4, 2] < 0 < expected[5, 1]


@pytest.mark.parametrize(
    ("profile", "message"),
    [
        ([(0.0, 0.1)], "two or more"),
        ([(0.0, 0.1), (0.5, math.nan)], "finite"),
        ([(0.0, 0.1), (0.5, -0.1)], "radii"),
        ([(0.0, 0.1), (0.2, 0.0), (0.5, 0.1)], "radii"),
        ([(0.5, 0.1), (0.0, 0.1)], "must not fall"),
    ],
)
def test_refuses_a_profile_of_no_body(profile, message):
    with pytest.raises(ValueError, match=message):
        sc.revolution_added_mass(profile)


def test_fin_is_a_row_of_flat_plates():
    """Against the sum over 2000 strips, each ρπ(c/2)² along the normal and ρπ(c/2)⁴/8 about the
    span: the velocity of a strip's middle along the normal is n·(v + ω × r). Midpoint sum: off by
    1/n²."""
    fin = sc.Fin(position=(-0.5, 0.12, 0.03), normal=(0.1, 0.6, 0.8), area=0.02, lift_slope=3.0)
    span, chord = 0.2, 0.1
    n = np.array([0.1, 0.6, 0.8]) / np.linalg.norm([0.1, 0.6, 0.8])
    t = np.array([1.0, 0, 0]) - n[0] * n
    t /= np.linalg.norm(t)
    s = np.cross(n, t)
    strips = 2000
    ds = span / strips
    expected = np.zeros((6, 6))
    for i in range(strips):
        r = np.array([-0.5, 0.12, 0.03]) - chord / 4 * t + ((i + 0.5) * ds - span / 2) * s
        along = np.concatenate([n, np.cross(r, n)])
        about = np.concatenate([np.zeros(3), s])
        expected += 1000 * math.pi * (chord / 2) ** 2 * ds * np.outer(along, along)
        expected += 1000 * math.pi * (chord / 2) ** 4 / 8 * ds * np.outer(about, about)
    matrix = sc.fin_added_mass(fin, span)
    assert matrix == pytest.approx(expected, abs=1e-6 * matrix.max())
    assert matrix == pytest.approx(matrix.T, abs=1e-15)


def asymmetric_matrix():
    """Hull about a place off the origin and a single fin: little is zero by symmetry."""
    fin = sc.Fin(position=(-0.5, 0.1, 0.15), normal=(0.0, 0.5, 0.8), area=0.03, lift_slope=3.0)
    return sc.about_origin(sc.hull_added_mass(1.3, 0.2), (0.1, 0.02, -0.04)) + sc.fin_added_mass(
        fin, 0.25
    )


def ideal(**changes):
    """A neutral body without drag."""
    settings = {
        "mass": 20.0, "inertia": [[0.4, 0.05, -0.1], [0.05, 2.5, 0.02], [-0.1, 0.02, 2.4]],
        "volume": 0.02, "diameter": 0.2, "length": 1.3, "added_mass": asymmetric_matrix(),
        "axial_drag": 0.0, "cross_flow_drag": 0.0,
    }  # fmt: skip
    return sc.Body(**(settings | changes))


def turned(q, v):
    """v by the quaternion q = (w, x, y, z)."""
    w, u = q[0], np.array(q[1:])
    return v + 2 * np.cross(u, np.cross(u, v) + w * v)


def start_state(model, velocity=(1.0, 0.3, -0.5), spin=(0.8, 0.9, -0.6), place=FAR):
    state = sc.State(model)
    q = np.array([0.9, 0.3, -0.2, 0.1]) / math.sqrt(0.95)
    state.set_body("fish", place, q, velocity, spin)
    return state


def free_motion(model, state, duration, step):
    simulator = sc.Simulator(
        model,
        state,
        integrator=sc.GeneralizedAlpha(rho_inf=1.0),
        max_step=step,
        newton_tolerance=1e-13,
    )
    simulator.step(duration, STILL)
    return simulator.state


def test_full_matrix_keeps_energy_and_both_impulses(free_body):
    """Kirchhoff: energy ½ (v, ω)·M(v, ω), linear impulse R(M v + Dᵀω) and angular impulse about the
    tank's origin are constant. Second order: the drift falls to a quarter with half the step."""
    body = ideal()
    model = free_body(body)
    rigid = np.zeros((6, 6))
    rigid[:3, :3] = 20.0 * np.eye(3)
    rigid[3:, 3:] = body.inertia
    M = rigid + body.added_mass

    def invariants(state):
        q = state.body_quaternion("fish")
        inverse = (q[0], *-q[1:])
        motion = np.concatenate(
            [turned(inverse, state.body_velocity("fish")), state.body_angular_velocity("fish")]
        )
        impulse = M @ motion
        linear = turned(q, impulse[:3])
        arm = state.body_position("fish") - np.array(FAR)
        angular = turned(q, impulse[3:]) + np.cross(arm, linear)
        return np.concatenate([[0.5 * motion @ impulse], linear, angular])

    begin = start_state(model)
    first = invariants(begin)
    assert sc.energy(begin).kinetic == pytest.approx(first[0], rel=1e-12)

    def drift(step):
        end = invariants(free_motion(model, begin, 2.0, step))
        return np.abs(end - first).max() / np.abs(first).max()

    coarse, fine = drift(0.01), drift(0.005)
    assert fine < 2e-4
    assert 3.5 < coarse / fine < 4.5


def test_munk_moment_comes_from_the_matrix(free_body):
    """(m33 − m11) U² sin 2α / 2 in pitch, (m22 − m11) U² sin 2β / 2 in yaw; here m22 = m33."""
    matrix = sc.hull_added_mass(1.3, 0.11)
    model = free_body(ideal(added_mass=matrix, inertia=(0.02, 1.8, 1.8)))
    for angle in (-0.3, 0.1, 0.7):
        state = sc.State(model)
        v = 1.75 * np.array([math.cos(angle), 0.0, -math.sin(angle)])
        state.set_body("fish", FAR, velocity=v)
        pitch = _core._residual(state)[3:]
        v = 1.75 * np.array([math.cos(angle), math.sin(angle), 0.0])
        state.set_body("fish", FAR, velocity=v)
        yaw = _core._residual(state)[3:]
        munk = (matrix[1, 1] - matrix[0, 0]) * 1.75**2 * math.sin(2 * angle) / 2
        assert pitch == pytest.approx([0, -munk, 0], abs=1e-9)  # nose up at α > 0: about −y
        assert yaw == pytest.approx([0, 0, -munk], abs=1e-9)  # drift to port: nose to starboard


def test_motion_does_not_depend_on_the_origin(free_body):
    """The same body described about another origin moves in the same way: masses by parallel axes,
    places shifted. Weight and buoyancy couple in, since their centres lie apart."""
    shift = np.array([0.15, -0.1, 0.2])  # of the second origin, in the axes of the first
    added, cg, cb = asymmetric_matrix(), np.array([0.02, 0.01, -0.03]), np.array([0.0, 0.0, 0.02])
    about_cg = np.array([[0.4, 0.05, -0.1], [0.05, 2.5, 0.02], [-0.1, 0.02, 2.4]])
    fin = {"normal": (0, 0, 1), "area": 0.02, "lift_slope": 3.0, "cross_flow_drag": 0.0}

    def body(origin):
        part = sc.Part(20.0, 0.02, cg - origin, about_cg)
        return ideal(
            inertia=sc.mass_properties([part]).inertia,
            centre_of_gravity=cg - origin,
            centre_of_buoyancy=cb - origin,
            added_mass=sc.about_origin(added, -origin),
            fins=[sc.Fin(position=np.array([-0.5, 0.1, 0.0]) - origin, **fin)],
        )

    first, second = free_body(body(np.zeros(3))), free_body(body(shift))
    begin = start_state(first)
    q, spin = begin.body_quaternion("fish"), begin.body_angular_velocity("fish")
    there = sc.State(second)
    there.set_body(
        "fish",
        begin.body_position("fish") + turned(q, shift),
        q,
        begin.body_velocity("fish") + turned(q, np.cross(spin, shift)),
        spin,
    )

    def gap(step):
        one = free_motion(first, begin, 1.0, step)
        other = free_motion(second, there, 1.0, step)
        places = other.body_position("fish") - turned(one.body_quaternion("fish"), shift)
        return np.concatenate(
            [
                places - one.body_position("fish"),
                other.body_quaternion("fish") - one.body_quaternion("fish"),
            ]
        )

    # Equal up to the error of the integrator, which integrates another point: second order.
    coarse, fine = np.abs(gap(0.01)).max(), np.abs(gap(0.005)).max()
    assert fine < 1e-4
    assert coarse / fine == pytest.approx(4.0, rel=0.2)


def test_forces_do_not_depend_on_the_origin(free_body):
    """The same at one instant: exact. Force alike, moment shifted by its arm."""
    shift = np.array([0.15, -0.1, 0.2])
    added = asymmetric_matrix()
    one = free_body(ideal(added_mass=added))
    part = sc.Part(20.0, 0.02, -shift, one_inertia := ideal().inertia)
    moved = ideal(
        inertia=sc.mass_properties([part]).inertia,
        centre_of_gravity=-shift,
        centre_of_buoyancy=-shift,
        added_mass=sc.about_origin(added, -shift),
    )
    assert one_inertia.shape == (3, 3)
    other = free_body(moved)
    begin = start_state(one)
    q, spin = begin.body_quaternion("fish"), begin.body_angular_velocity("fish")
    a, alpha = np.array([0.3, -2.0, 1.0]), np.array([1.0, 2.0, -0.5])
    there = start_state(other, begin.body_velocity("fish") + turned(q, np.cross(spin, shift)))
    there_a = a + turned(q, np.cross(alpha, shift) + np.cross(spin, np.cross(spin, shift)))
    r1 = _core._residual(_core._displaced(begin, np.concatenate([a, alpha]), (0, 0, 1)))
    r2 = _core._residual(_core._displaced(there, np.concatenate([there_a, alpha]), (0, 0, 1)))
    assert r2[:3] == pytest.approx(r1[:3], abs=1e-9)
    force = turned((q[0], *-q[1:]), r1[:3])
    assert r2[3:] == pytest.approx(r1[3:] - np.cross(shift, force), abs=1e-9)


def test_refuses_an_added_mass_that_is_none():
    matrix = sc.hull_added_mass(1.3, 0.11)
    matrix[0, 4] = 1.0
    with pytest.raises(sc.InvalidInput, match="added_mass must be symmetric"):
        sc.ModelBuilder().add_body("fish", ideal(added_mass=matrix))
