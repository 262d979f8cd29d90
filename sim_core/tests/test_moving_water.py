# SPDX-License-Identifier: Apache-2.0
"""What the water does at a place and time: currents, and the kinematics of waves."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import PchipInterpolator

import sim_core as sc

HEIGHTS = [0.0, -1.0, -3.0, -4.0, -8.0]
VELOCITIES = [
    (0.9, 0.0, 0.0),
    (0.7, 0.2, 0.0),
    (0.3, 0.2, 0.0),
    (-0.1, -0.1, 0.05),
    (0.0, 0.0, 0.0),
]


def test_profile_goes_through_its_rows_without_overshoot():
    water = sc.Water(current=sc.Current(profile=list(zip(HEIGHTS, VELOCITIES, strict=True))))
    expected = PchipInterpolator(HEIGHTS[::-1], VELOCITIES[::-1])
    for z in np.linspace(-7.99, -0.01, 50):
        motion = water.motion((3.0, 2.0, z), 5.0)
        assert motion.velocity == pytest.approx(expected(z), abs=1e-14)
        gradient = np.zeros((3, 3))
        gradient[:, 2] = expected(z, 1)
        assert motion.velocity_gradient == pytest.approx(gradient, abs=1e-13)
        assert not motion.acceleration.any()
    for z, row in ((1.0, 0), (-9.0, -1)):
        assert water.motion((0, 0, z), 0.0).velocity == pytest.approx(VELOCITIES[row])
        assert not water.motion((0, 0, z), 0.0).velocity_gradient.any()


def test_parts_of_a_current_add_up():
    times = [0.0, 10.0, 25.0]
    series = [(0.0, 0.0, 0.0), (0.3, 0.1, 0.0), (0.2, 0.3, 0.0)]
    current = sc.Current(
        uniform=(0.1, 0.0, 0.0),
        profile=[(0.0, (0.5, 0.0, 0.0)), (-5.0, (0.0, 0.0, 0.0))],
        series=list(zip(times, series, strict=True)),
    )
    motion = sc.Water(current=current).motion((0, 0, -2.0), 14.0)
    in_time = PchipInterpolator(times, series)
    assert motion.velocity == pytest.approx(in_time(14.0) + np.array([0.4, 0.0, 0.0]), abs=1e-14)
    assert motion.acceleration == pytest.approx(in_time(14.0, 1), abs=1e-14)


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([(0.0, (1.0, 0.0, 0.0))], "at least two"),
        ([(0.0, (1.0, 0.0, 0.0)), (0.0, (2.0, 0.0, 0.0))], "same place"),
        ([(0.0, (1.0, 0.0, 0.0)), (1.0, (math.nan, 0.0, 0.0))], "must be finite"),
    ],
)
def test_impossible_tables_are_refused(rows, message):
    with pytest.raises(sc.InvalidInput, match=f"(?i)current:? profile.*{message}"):
        sc.Current(profile=rows)


def test_waves_of_another_gravity_are_refused():
    sea = sc.regular_waves(height=0.1, period=2.0, gravity=1.62)
    with pytest.raises(sc.InvalidInput, match="gravity"):
        sc.ModelBuilder(sc.Water(waves=sea))


def some_sea(depth, direction=0.4):
    return sc.Sea(
        amplitude=[0.02, 0.03, 0.01],
        frequency=[2.0, 3.5, 5.0],
        direction=[direction, direction + 1.0, direction - 2.0],
        phase=[0.3, 1.7, -2.0],
        depth=depth,
    )


def difference(function, h):
    return (function(h) - function(-h)) / (2.0 * h)


@settings(deadline=None)
@given(
    depth=st.sampled_from([0.8, 5.0, math.inf]),
    place=st.tuples(st.floats(-3, 3), st.floats(-3, 3), st.floats(-0.75, -0.1)),
    time=st.floats(0.1, 20.0),
    ramp_time=st.sampled_from([0.0, 10.0]),
)
def test_gradients_are_those_of_the_motion(depth, place, time, ramp_time):
    sea = some_sea(depth).replace(ramp_time=ramp_time)
    profile = [(0.0, (0.5, 0.1, 0.0)), (-5.0, (0.1, 0.0, 0.0))]
    water = sc.Water(current=sc.Current(profile=profile), waves=sea)
    here = water.motion(place, time)
    h = 1e-5  # truncation h² k³ aω ≈ 1e-10, rounding 1e-16/h
    for axis in range(3):
        step = np.eye(3)[axis]
        for of in ("velocity", "acceleration"):
            slope = difference(
                lambda s, of=of, step=step: getattr(water.motion(place + s * step, time), of), h
            )
            gradient = getattr(here, f"{of}_gradient")[:, axis]
            assert gradient == pytest.approx(slope, abs=1e-8)
        slope = difference(
            lambda s, step=step: water.motion(place + s * step, time).velocity_gradient, h
        )
        curvature = np.array(here.velocity_curvature)[:, :, axis]
        assert curvature == pytest.approx(slope, abs=1e-7)  # another factor k, about 3
        if axis < 2:
            slope = difference(
                lambda s, step=step: water.motion(place + s * step, time).elevation, h
            )
            assert here.elevation_slope[axis] == pytest.approx(slope, abs=1e-8)


@pytest.mark.parametrize("depth", [0.8, math.inf])
def test_waves_of_small_height_obey_the_linear_equations(depth):
    """Continuity, no vorticity, the surface conditions and the bottom condition."""
    scale = 1e-6  # what Wheeler's stretching adds is of second order, 1e-6 of the whole
    sea = some_sea(depth)
    small = sea.replace(amplitude=[scale * a for a in sea.amplitude])
    water = sc.Water(waves=small)
    for place, time in (((0.3, -0.2, -0.4), 1.3), ((-2.0, 1.0, -0.7), 8.1)):
        motion = water.motion(place, time)
        g = motion.velocity_gradient / scale
        assert abs(np.trace(g)) < 1e-6
        assert g == pytest.approx(g.T, abs=1e-6)
        # at still water: ζ_t = w, and Bernoulli's ∂u/∂t = −g ∂ζ/∂x
        x, y, _ = place
        top = water.motion((x, y, 0.0), time)
        rise = difference(
            lambda s, x=x, y=y, t=time: small.elevation(np.array([t + s]), x=x, y=y)[0], 1e-4
        )
        assert top.velocity[2] / scale == pytest.approx(rise / scale, abs=1e-6)
        assert top.acceleration[:2] / scale == pytest.approx(
            -9.81 * np.array(top.elevation_slope) / scale, abs=1e-5
        )
        bottom = water.motion((x, y, -min(depth, 1e4)), time)
        assert abs(bottom.velocity[2]) / scale < 1e-12


def test_acceleration_is_the_rate_of_the_velocity():
    """In one place below still water, but for stretching: (a k) of the whole, here 1e-7."""
    scale = 1e-8
    sea = some_sea(2.0).replace(amplitude=[scale, 2 * scale, 3 * scale], ramp_time=4.0)
    water = sc.Water(waves=sea)
    for time in (1.0, 3.0, 7.0):
        rate = difference(lambda s, t=time: water.motion((0.2, 0.1, -0.3), t + s).velocity, 1e-4)
        assert water.motion((0.2, 0.1, -0.3), time).acceleration == pytest.approx(
            rate, abs=1e-5 * scale
        )


def test_deep_water_decay_and_stretching():
    height, period = 0.4, 3.0
    sea = sc.regular_waves(height=height, period=period)
    k = sea.wave_numbers()[0]
    water = sc.Water(waves=sea)
    speed = math.pi * height / period
    for time in (0.0, 0.4, 1.5):
        zeta = sea.elevation(np.array([time]))[0]
        for below in (0.0, 0.5, 2.0):  # Wheeler: the decay counts from the surface
            u = water.motion((0.0, 0.0, zeta - below), time).velocity
            decay = speed * math.exp(-k * below)
            angle = 2.0 * math.pi * time / period
            assert u == pytest.approx(
                [decay * math.cos(angle), 0.0, -decay * math.sin(angle)], abs=1e-12
            )
        above = water.motion((0.0, 0.0, zeta + 3.0), time)
        assert above.velocity == pytest.approx(water.motion((0, 0, zeta), time).velocity)


def test_finite_depth_reaches_the_bottom_of_the_stretched_water():
    sea = sc.regular_waves(height=0.2, period=3.0, depth=1.0)
    k = sea.wave_numbers()[0]
    water = sc.Water(waves=sea)
    crest = water.motion((0.0, 0.0, 0.1), 0.0).velocity[0]
    bottom = water.motion((0.0, 0.0, -1.0), 0.0).velocity[0]
    assert crest / bottom == pytest.approx(math.cosh(k), rel=1e-12)


@given(
    place=st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-1, 1)),
    time=st.floats(0, 1e4),
)
def test_elevation_is_that_of_the_sea_far_and_late(place, time):
    sea = some_sea(math.inf)
    expected = sea.elevation(np.array([time]), x=place[0], y=place[1])[0]
    # Angles up to 5e4 rad are rounded to 7e-12
    assert sc.Water(waves=sea).motion(place, time).elevation == pytest.approx(expected, abs=1e-12)
