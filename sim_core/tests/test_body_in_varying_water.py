# SPDX-License-Identifier: Apache-2.0
"""Added mass of a body that moves where the water's velocity varies: waves at forward speed."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sim_core as sc
from sim_core import _core

LENGTH, DIAMETER = 1.3, 0.22


def spheroid(strips=200, **changes):
    """Neutral, without drag."""
    mass = 1000 * math.pi / 6 * LENGTH * DIAMETER**2
    settings = {
        "mass": mass, "inertia": (0.1, 2.0, 2.0), "volume": mass / 1000, "diameter": DIAMETER,
        "length": LENGTH, "added_mass": sc.hull_added_mass(LENGTH, DIAMETER), "axial_drag": 0.0,
        "cross_flow_drag": 0.0, "strips": strips,
    }  # fmt: skip
    return sc.Body(**(settings | changes))


def wrench(free_body, body, water, place, velocity, spin=(0, 0, 0), turn=None, rates=None):
    """Force (tank axes) and moment (body axes), inertia included, at accelerations `rates`."""
    state = sc.State(free_body(body, water))
    x, y, z, w = (turn or Rotation.identity()).as_quat()
    state.set_body("fish", place, (w, x, y, z), velocity, spin)
    if rates is not None:
        state = _core._displaced(state, rates, (0, 0, 1))
    return _core._residual(state)


def convective(free_body, body, *motion):
    """What munk_moment = 1 adds to the wrench."""
    with_, without = (wrench(free_body, body.replace(munk_moment=k), *motion) for k in (1.0, 0.0))
    return with_ - without


def test_spheroid_through_a_straining_flow(free_body):
    """At U = 2 m/s along x through u = A (z, 0, x), A = 0.3 1/s: no mean flow, no ∂u/∂t, and yet
    the lateral impulse of the added mass grows as the body moves to where u_z is larger. A panel
    method without any added-mass formula (sources on 864 and 1944 quadrilaterals, pressure from
    Bernoulli's equation; an error of first order in their size) gives 18.97 and 18.39 N,
    extrapolated 17.24 N, good to about 1 %; (m33 − m11) U A = 17.18 N.

    Here as a crest of a wave 6 km long, with a current against the water's velocity there: its
    gradient is A (z, 0, x) with A = aωk, and the next term is (kL)² = 2e-6 of that."""
    k = 1e-3
    omega = math.sqrt(9.81 * k)
    amplitude = 1e-3 / (omega * k)  # A = 1e-3
    place = (0.0, 0.0, amplitude - 5.0)
    speed = amplitude * omega * math.exp(-5.0 * k)
    sea = sc.regular_waves(height=2 * amplitude, period=2 * math.pi / omega)
    water = sc.Water(waves=sea, current=(-speed, 0.0, 0.0))
    strain = 1e-3 * math.exp(-5.0 * k)
    assert np.array(water.motion(place, 0.0).velocity_gradient) == pytest.approx(
        strain * np.array([[0, 0, 1], [0, 0, 0], [1, 0, 0]]), abs=1e-9
    )
    force = convective(free_body, spheroid(), water, place, (2.0, 0.0, 0.0))[:3] * 0.3 / strain
    added = sc.hull_added_mass(LENGTH, DIAMETER)
    assert force[2] == pytest.approx((added[2, 2] - added[0, 0]) * 2.0 * 0.3, rel=1e-4)
    assert force[2] == pytest.approx(17.24, rel=0.01)
    assert force[:2] == pytest.approx([0, 0], abs=1e-3)


@pytest.mark.parametrize("heading", [math.pi, 0.0], ids=["head", "following"])
@pytest.mark.parametrize("period", [1.2, 1.5, 2.0, 3.0])
def test_lateral_wave_force_at_forward_speed(free_body, period, heading):
    """Slender-body theory, force per length −D/Dt (m w) − ρA ∂u/∂t …, integrated over a closed hull
    that is held level at speed V: amplitude aω e^kz s |(ρV_d + m33) ω − (m33 − m11) V k cos β|,
    s = sin(kL/2)/(kL/2) for properties spread evenly (Newman 1977, § 7.3, with V ∂/∂x).
    Without the term in V the force is 17 to 34 % too small in head and 26 to 105 % too large in
    following seas here."""
    speed, depth, amplitude = 2.0, 0.8, 1e-5
    body = spheroid(diameter=0.11, added_mass=sc.hull_added_mass(LENGTH, 0.11))
    mass = 1000 * math.pi / 6 * LENGTH * 0.11**2
    body = body.replace(mass=mass, volume=mass / 1000)
    forces = []
    phases = np.arange(4) * math.pi / 2
    for phase in phases:
        sea = sc.regular_waves(height=2 * amplitude, period=period, direction=heading, phase=phase)
        force = wrench(free_body, body, sc.Water(waves=sea), (0, 0, -depth), (speed, 0, 0))
        forces.append(force[2])
    measured = abs(np.sum(forces * np.exp(-1j * phases))) / 2
    omega = 2 * math.pi / period
    k = omega**2 / 9.81
    added = sc.hull_added_mass(LENGTH, 0.11)
    half = 0.5 * k * LENGTH
    expected = (mass + added[2, 2]) * omega
    expected -= (added[2, 2] - added[0, 0]) * speed * k * math.cos(heading)
    expected *= amplitude * omega * math.exp(-k * depth) * math.sin(half) / half
    # 200 strips: (k dx)²/24 = 1e-5; Wheeler's stretching k a = 3e-5
    assert measured == pytest.approx(abs(expected), rel=1e-4)


def test_lift_of_a_sphere_in_a_shear_flow(free_body):
    """Auton, Hunt & Prud'homme (1988, J. Fluid Mech. 197, 241–257): a sphere in a weak shear
    takes ρV C_L (u − v) × (∇ × u) with C_L = ½, besides ρV C_M Du/Dt, which vanishes here:
    u = (S z, 0, 0)."""
    shear = 0.2
    water = sc.Water(current=sc.Current(profile=[(10.0, (2.0, 0, 0)), (-10.0, (-2.0, 0, 0))]))
    volume = math.pi / 6 * 0.3**3
    sphere = spheroid(
        diameter=0.3, length=0.3, volume=volume, mass=1000 * volume,
        added_mass=sc.hull_added_mass(0.3, 0.3),
    )  # fmt: skip
    v = np.array([0.7, -0.4, 0.0])
    turn = Rotation.from_rotvec([0.3, -0.5, 0.2])
    force = convective(free_body, sphere, water, (0, 0, -5.0), v, (0, 0, 0), turn)[:3]
    u = np.array([-5.0 * shear, 0, 0])
    assert force == pytest.approx(0.5 * 1000 * volume * np.cross(u - v, [0, shear, 0]), abs=1e-9)


def full_matrix():
    """Hull, off the origin, and a fin: little is zero by symmetry."""
    fin = sc.Fin(position=(-0.5, 0.1, 0.15), normal=(0.0, 0.5, 0.8), area=0.03, lift_slope=3.0)
    hull = sc.about_origin(sc.hull_added_mass(LENGTH, DIAMETER), (0.1, 0.02, -0.04))
    return hull + sc.fin_added_mass(fin, 0.25)


def steep_water():
    sea = sc.Sea(
        amplitude=[0.1, 0.05, 0.03], frequency=[2.5, 4.0, 5.5], direction=[0.3, 2.0, -1.1],
        phase=[0.2, 1.7, -2.0], depth=4.0,
    )  # fmt: skip
    profile = [(5.0, (0.6, 0.1, 0)), (-5.0, (-0.2, 0.0, 0))]
    return sc.Water(waves=sea, current=sc.Current(profile=profile))


def test_wrench_follows_from_lagranges_equations(free_body):
    """With the kinetic energy L = ½ (v, ω)·M (v, ω) of motion relative to the water (its mean
    velocity over the strips, and the rotation that fits best along the axis):

        F = −d/dt ∂L/∂v + ∂L/∂x,   T = −d/dt ∂L/∂ω − ω × ∂L/∂ω + ∂L/∂φ

    (force and v in tank axes, moment and ω in body axes, φ a turn in body axes at a fixed v), all
    derivatives by differences of what the water does at the strips. The local acceleration of the
    water, of which Wheeler's stretching has its own, is taken as it is."""
    strips, water, matrix = 6, steep_water(), full_matrix()
    x = np.array([0.3, -0.2, -1.1])
    turn = Rotation.from_rotvec([0.4, -0.5, 0.3])
    v, w = np.array([1.5, 0.4, -0.6]), np.array([0.5, 0.8, -0.7])
    a, alpha = np.array([0.3, -2.0, 1.0]), np.array([1.0, 2.0, -0.5])
    arms = ((np.arange(strips) + 0.5) / strips - 0.5) * LENGTH
    axis = np.array([1.0, 0, 0])

    def along(x, turn, of):
        """Mean of a vector of the water, and the rotation that fits; body axes."""
        places = [x + turn.apply(arm * axis) for arm in arms]
        seen = turn.inv().apply([getattr(water.motion(p, 0.0), of) for p in places])
        return seen.mean(0), np.cross(axis, arms @ seen) / np.sum(arms**2)

    def impulse(x, turn, v, w):
        """∂L/∂v in tank axes and ∂L/∂ω in body axes; L."""
        mean, spin = along(x, turn, "velocity")
        motion = np.concatenate([turn.inv().apply(v) - mean, w - spin])
        p = matrix @ motion
        return turn.apply(p[:3]), p[3:], 0.5 * motion @ p

    def shifted(s, d):
        return x + s * d[:3], turn * Rotation.from_rotvec(s * d[3:])

    h = 1e-4  # truncation h² of the third derivatives, about 10; rounding 1e-16/h
    rate = [
        (up - down) / (2 * h)
        for up, down in zip(
            *(
                impulse(
                    x + s * v,
                    turn * Rotation.from_rotvec(s * w),
                    v + s * a,
                    w + s * alpha,
                )[:2]
                for s in (h, -h)
            ),
            strict=True,
        )
    ]
    slope = np.array(
        [
            (impulse(*shifted(h, d), v, w)[2] - impulse(*shifted(-h, d), v, w)[2]) / (2 * h)
            for d in np.eye(6)
        ]
    )
    local = matrix @ np.concatenate(along(x, turn, "acceleration"))
    angular = impulse(x, turn, v, w)[1]
    force = -rate[0] + slope[:3] + turn.apply(local[:3])
    moment = -rate[1] - np.cross(w, angular) + slope[3:] + local[3:]

    motion = (water, x, v, w, turn, np.concatenate([a, alpha]))
    body = spheroid(strips)
    found = wrench(free_body, body.replace(added_mass=matrix), *motion)
    found = found - wrench(free_body, body.replace(added_mass=np.zeros((6, 6))), *motion)
    assert found == pytest.approx(np.concatenate([force, moment]), abs=2e-5)


def test_without_munk_moment_the_water_may_vary_as_it_likes(free_body):
    """munk_moment 0 is Morison's form: −M (a − ∂u/∂t) and no more."""
    body = spheroid(munk_moment=0.0)
    motion = (steep_water(), (0.3, -0.2, -1.5), (1.5, 0.4, -0.6))
    bare = wrench(free_body, body.replace(added_mass=np.zeros((6, 6))), *motion)
    found = wrench(free_body, body, *motion) - bare
    places = ((np.arange(200) + 0.5) / 200 - 0.5) * LENGTH
    rate = [motion[0].motion((0.3 + p, -0.2, -1.5), 0.0).acceleration for p in places]
    mass = np.diag(sc.hull_added_mass(LENGTH, DIAMETER))[:3]
    assert found[:3] == pytest.approx(mass * np.mean(rate, 0), abs=1e-9)


@pytest.mark.parametrize("strips", [1, 5])
def test_jacobian_in_varying_water(free_body, strips):
    """Central differences at random motions, with a full matrix."""
    body = spheroid(strips, added_mass=full_matrix(), munk_moment=0.7)
    model = free_body(body, steep_water())
    rng = np.random.default_rng(3)
    h = 1e-6  # truncation h², rounding 1e-16/h of 1e3 N
    for _ in range(10):
        state = sc.State(model)
        place = np.array([0, 0, -1.5]) + 0.3 * rng.normal(size=3)
        state.set_body("fish", place, rng.normal(size=4), rng.normal(size=3), rng.normal(size=3))
        for rates in ((1, 0, 0), (0, 1, 0)):
            analytic = _core._jacobian(state, rates)
            for column in range(6):
                step = np.zeros(6)
                step[column] = h
                up = _core._residual(_core._displaced(state, step, rates))
                down = _core._residual(_core._displaced(state, -step, rates))
                assert (up - down) / (2 * h) == pytest.approx(analytic[:, column], abs=2e-6)
