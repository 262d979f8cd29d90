# SPDX-License-Identifier: Apache-2.0
"""Forces on the tow-fish, each against its closed form, and the body's free motion."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sim_core as sc
from sim_core import _core

RHO = 1000.0
FAR = (0.0, 0.0, -900.0)  # within the slack thread's reach of the far point at the origin


def wrench(model, quaternion=(1, 0, 0, 0), velocity=(0, 0, 0), angular_velocity=(0, 0, 0)):
    """Force (tank axes) and moment (body axes) at zero acceleration."""
    state = sc.State(model)
    state.set_body("fish", FAR, quaternion, velocity, angular_velocity)
    residual = _core._residual(state)
    return residual[:3], residual[3:]


def about_y(angle):
    return (math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0)


def bare(fish_body, **changes):
    """The fish with chosen properties and no others."""
    settings = {
        "mass": 12.5, "inertia": (0.02, 1.8, 1.8), "volume": 0.0125,
        "diameter": 0.11, "length": 1.3, "axial_drag": 0.0, "cross_flow_drag": 0.0,
    }  # fmt: skip
    return sc.Body(**(settings | changes))


def test_neutral_fish_feels_no_force_at_rest(free_body, fish_body):
    force, moment = wrench(free_body(bare(fish_body)))
    assert np.abs(force).max() < 1e-9
    assert np.abs(moment).max() < 1e-9


def test_low_centre_of_gravity_rights_the_fish(free_body, fish_body):
    model = free_body(bare(fish_body, centre_of_gravity=(0, 0, -0.01)))
    _, moment = wrench(model, about_y(0.2))
    # positive pitch is nose down: the moment must be negative
    assert moment[1] == pytest.approx(-12.5 * 9.81 * 0.01 * math.sin(0.2), rel=1e-12)


def test_munk_moment(free_body, fish_body):
    """(Z − X) U² sin α cos α, turning the nose away from the flow, times the factor."""
    incidence, speed, X, Z = 0.1, 1.75, 1.0, 12.5
    for share in (0.0, 0.4, 1.0):
        body = bare(fish_body, added_mass=(X, Z, Z, 0, 1, 1), munk_moment=share)
        _, moment = wrench(free_body(body), about_y(incidence), velocity=(speed, 0, 0))
        expected = share * (Z - X) * speed**2 * math.sin(incidence) * math.cos(incidence)
        assert moment[1] == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_axial_drag(free_body, fish_body):
    force, moment = wrench(free_body(bare(fish_body, axial_drag=0.4)), velocity=(1.75, 0, 0))
    expected = -0.5 * RHO * 0.4 * math.pi / 4 * 0.11**2 * 1.75**2
    assert force == pytest.approx([expected, 0, 0], abs=1e-9)
    assert np.abs(moment).max() < 1e-9


def test_cross_flow_drag_damps_pitch(free_body, fish_body):
    """½ρ Cd d q|q| ∫|x|³dx = ρ Cd d L⁴ q² / 64; strips by the midpoint rule: 2/n² less."""
    q = 0.7
    expected = -RHO * 1.1 * 0.11 * 1.3**4 * q * q / 64
    for strips in (20, 200):
        body = bare(fish_body, cross_flow_drag=1.1, strips=strips)
        force, moment = wrench(free_body(body), angular_velocity=(0, q, 0))
        assert moment[1] == pytest.approx(expected, rel=2.2 / strips**2)
        assert np.abs(force).max() < 1e-9


def test_cross_flow_drag_in_heave(free_body, fish_body):
    force, _ = wrench(free_body(bare(fish_body, cross_flow_drag=1.1)), velocity=(0, 0, 0.5))
    assert force[2] == pytest.approx(-0.5 * RHO * 1.1 * 0.11 * 1.3 * 0.25, rel=1e-12)


@pytest.fixture(scope="module")
def tail():
    return sc.Fin(
        position=(-0.55, 0, 0),
        normal=(0, 0, 1),
        area=0.02,
        lift_slope=3.0,
        drag=0.0,
        stall_angle=0.3,
        cross_flow_drag=0.0,
        aspect_ratio=math.inf,  # lift alone
    )


def test_fin_lift_at_small_incidence(free_body, fish_body, tail):
    """Nose up by α: lift ½ρS a α U² upwards at the tail, turning the nose down (positive)."""
    alpha, speed = 0.02, 1.5
    model = free_body(bare(fish_body, fins=[tail]))
    force, moment = wrench(model, about_y(-alpha), velocity=(speed, 0, 0))
    lift = 0.5 * RHO * 0.02 * 3.0 * math.sin(alpha) * math.cos(alpha) * speed**2
    assert force == pytest.approx([0, 0, lift], abs=1e-9)  # across the flow
    assert moment[1] == pytest.approx(0.55 * lift * math.cos(alpha), rel=1e-9)


def test_fin_lift_stays_level_beyond_stall(free_body, fish_body, tail):
    model = free_body(bare(fish_body, fins=[tail]))
    limit = 0.5 * RHO * 0.02 * 3.0 * math.sin(0.3)
    for alpha in np.linspace(0.0, math.pi, 60):
        force, _ = wrench(model, about_y(-alpha), velocity=(1, 0, 0))
        assert abs(force[2]) <= limit * (1 + 1e-9)


def test_fin_sees_the_rotation(free_body, fish_body, tail):
    """A pitch rate q moves the tail at q x: incidence −q x / U."""
    speed, q = 1.5, 0.01
    model = free_body(bare(fish_body, fins=[tail]))
    _, moment = wrench(model, velocity=(speed, 0, 0), angular_velocity=(0, q, 0))
    expected = -0.5 * RHO * 0.02 * 3.0 * q * 0.55**2 * speed
    assert moment[1] == pytest.approx(expected, rel=1e-4)  # 1 − cos of an incidence of 0.004


def fin_coefficients(free_body, fish_body, fin, alpha):
    """C_L and C_D of a lone fin on a body that moves along x with its nose up by alpha."""
    force, _ = wrench(free_body(bare(fish_body, fins=[fin])), about_y(-alpha), velocity=(1, 0, 0))
    return force[2] / (0.5 * RHO * fin.area), -force[0] / (0.5 * RHO * fin.area)


def test_induced_drag(free_body, fish_body, tail):
    """Lifting line, elliptic load: C_L²/(πA) (Prandtl; Anderson, Fundamentals of Aerodynamics,
    § 5.3). At C_L = 0.6, A = 2 that is 0.0573, nearly three times a profile drag of 0.02."""
    fin = tail.replace(aspect_ratio=2.0, stall_angle=math.pi / 2, drag=0.02)
    alpha = 0.5 * math.asin(2 * 0.6 / 3.0)  # C_L = a sin α cos α
    lift, drag = fin_coefficients(free_body, fish_body, fin, alpha)
    assert lift == pytest.approx(0.6, rel=1e-5)  # levels off from (sin α)⁸/8 of it on
    assert drag == pytest.approx(0.02 + 0.0573, abs=5e-5)
    assert drag - 0.02 == pytest.approx(lift**2 / (2 * math.pi), rel=1e-6)


@pytest.mark.parametrize("aspect_ratio", [0.3, 2.0, 8.0])
def test_aspect_ratio_is_that_of_the_lift_slope(free_body, fish_body, tail, aspect_ratio):
    """A fin for which only Helmbold's lift slope is given has the drag of its aspect ratio."""
    given = tail.replace(aspect_ratio=aspect_ratio, lift_slope=sc.lift_slope(aspect_ratio))
    found = fin_coefficients(free_body, fish_body, given.replace(aspect_ratio=None), 0.1)
    expected = fin_coefficients(free_body, fish_body, given, 0.1)
    assert found == pytest.approx(expected, rel=1e-9)
    assert expected[1] > 1e-3


def test_a_fin_with_the_slope_of_an_aerofoil_has_no_induced_drag(free_body, fish_body, tail):
    fin = tail.replace(aspect_ratio=None, lift_slope=2 * math.pi)
    assert fin_coefficients(free_body, fish_body, fin, 0.1)[1] == pytest.approx(0.0, abs=1e-12)


def test_sharp_plate_without_suction_has_a_normal_force(free_body, fish_body, tail):
    """Polhamus (1966): without suction at the leading edge the force a sin α cos α is normal to the
    plate, its drag C_L tan α. An aspect ratio a/π stands for that, to (1 − cos² α) of it."""
    fin = tail.replace(aspect_ratio=3.0 / math.pi)
    for alpha in (0.02, 0.1, 0.17):
        lift, drag = fin_coefficients(free_body, fish_body, fin, alpha)
        assert drag == pytest.approx(lift * math.tan(alpha), rel=1.1 * alpha**2)


def test_induced_drag_stays_level_beyond_stall(free_body, fish_body, tail):
    """It goes with the lift: never above that at the stall, none broadside, the same in flow from
    behind as far as the lift is."""
    fin = tail.replace(aspect_ratio=2.0)
    most = (3.0 * math.sin(0.3)) ** 2 / (2 * math.pi)
    for alpha in np.linspace(0.0, math.pi, 61):
        lift, drag = fin_coefficients(free_body, fish_body, fin, alpha)
        assert -1e-12 <= drag <= most * (1 + 1e-9)
        assert drag == pytest.approx(lift**2 / (2 * math.pi), abs=1e-12)
    assert fin_coefficients(free_body, fish_body, fin, math.pi / 2)[1] < 1e-12


def test_refuses_an_aspect_ratio_that_is_none(free_body, fish_body, tail):
    for wrong in (0.0, -1.0, math.nan):
        with pytest.raises(sc.InvalidInput, match="aspect_ratio"):
            free_body(bare(fish_body, fins=[tail.replace(aspect_ratio=wrong)]))


@given(
    flow=st.tuples(*[st.floats(-3, 3)] * 3),
    spin=st.tuples(*[st.floats(-2, 2)] * 3),
    attitude=st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: sum(x * x for x in q) > 0.01),
)
def test_drag_takes_energy_out(free_body, fish_body, tail, flow, spin, attitude):
    """Hull drag and fins (lift is across the flow, or with a drag) never drive the body in still
    water."""
    fin = sc.Fin(position=(-0.5, 0.1, 0), normal=(0, 0.6, 0.8), area=0.02, lift_slope=3.0)
    model = free_body(bare(fish_body, axial_drag=0.4, cross_flow_drag=1.1, fins=[tail, fin]))
    force, moment = wrench(model, attitude, flow, spin)
    power = np.dot(force, flow) + np.dot(moment, spin)
    assert power <= 1e-9


def test_free_motion_in_ideal_fluid_keeps_energy_and_momentum(free_body, fish_body):
    """Kirchhoff's equations in full: kinetic energy of body and fluid and the impulse in tank axes
    are constant. Second order: the drift falls to a quarter when the step is halved."""
    added = (2.0, 12.5, 9.0, 0.05, 1.5, 1.2)
    body = bare(fish_body, added_mass=added, inertia=(0.05, 1.8, 1.7))
    model = free_body(body)
    start = sc.State(model)
    start.set_body("fish", FAR, (0.9, 0.3, -0.2, 0.1), (1.0, 0.3, -0.5), (0.8, 0.9, -0.6))

    def impulse(state):
        w, *u = state.body_quaternion("fish")
        q, u = state.body_velocity("fish"), np.array(u)

        def turned(v, u):  # v by the quaternion (w, u)
            return v + 2 * np.cross(u, np.cross(u, v) + w * v)

        return turned((12.5 + np.array(added[:3])) * turned(q, -u), u)

    def drift(step):
        simulator = sc.Simulator(
            model,
            start,
            integrator=sc.GeneralizedAlpha(rho_inf=1.0),
            max_step=step,
            newton_tolerance=1e-13,
        )
        simulator.step(4.0, sc.SteadyTow(position=(0, 0, 0)))
        end = simulator.state
        energy = abs(sc.energy(end).kinetic / sc.energy(start).kinetic - 1)
        momentum = np.abs(impulse(end) - impulse(start)).max() / np.abs(impulse(start)).max()
        return np.array([energy, momentum])

    coarse, fine = drift(0.01), drift(0.005)
    assert fine.max() < 1e-4
    assert (coarse / fine).min() > 3.5


def test_without_munk_moment_the_added_mass_resists_acceleration_only(free_body, fish_body):
    """At munk_moment 0 no added-mass force is left in steady translation and rotation, but for the
    gyroscopic moment that the added inertia shares with the body's own."""
    body = bare(fish_body, added_mass=(2.0, 12.5, 9.0, 0, 1.5, 1.5), munk_moment=0.0)
    plain = bare(fish_body, inertia=(0.02, 1.8 + 1.5, 1.8 + 1.5))
    motion = {"velocity": (1, 0.4, -0.2), "angular_velocity": (0.1, 0.5, -0.3)}
    for one, other in zip(
        wrench(free_body(body), **motion), wrench(free_body(plain), **motion), strict=True
    ):
        assert one == pytest.approx(other, abs=1e-12)


def test_fish_without_tail_is_unstable_with_munk_moment_and_stable_with_fins(nit_model):
    """Heading disturbed by a small yaw rate: it dies out only with the tail."""

    def yaw_after(with_fins):
        model = nit_model(segments=(4, 1, 3), with_fins=with_fins)
        state = sc.steady_tow(model, position=(0, 0, 0.2), velocity=(1, 0, 0))
        state.set_body(
            "fish",
            state.body_position("fish"),
            state.body_quaternion("fish"),
            state.body_velocity("fish"),
            (0, 0, 0.02),
        )
        simulator = sc.Simulator(model, state)
        simulator.step(20.0, sc.SteadyTow(position=(0, 0, 0.2), velocity=(1, 0, 0)))
        w, _, _, z = simulator.body_quaternion("fish")
        return abs(2 * math.atan2(z, w))

    assert yaw_after(True) < 2e-3
    assert yaw_after(False) > 0.05


def test_floating_body_carries_its_weight(free_body, fish_body):
    """Half the density: it floats with its axis at the surface."""
    body = bare(fish_body, mass=6.25, inertia=(0.02, 0.9, 0.9), centre_of_gravity=(0, 0, -0.01))
    state = sc.steady_tow(free_body(body), position=(0, 0, 0))
    assert state.body_position("fish")[2] == pytest.approx(0.0, abs=1e-6)
