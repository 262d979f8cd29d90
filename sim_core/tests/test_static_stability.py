# SPDX-License-Identifier: Apache-2.0
"""Static stability, static margin and trim of a towed body against closed forms."""

import math

import pytest

import sim_core as sc

SPEED, RHO = 1.5, 1000.0
LATERAL, AXIAL = 12.0, 0.5


def fin(normal, lift_slope=3.0, x=-0.55):
    return sc.Fin(
        position=(x, 0, 0), normal=normal, area=0.02, lift_slope=lift_slope, drag=0.0,
        cross_flow_drag=0.0,
    )  # fmt: skip


def body(fins=(), **changes):
    settings = {
        "mass": 12.5, "inertia": (0.02, 1.8, 1.8), "volume": 0.0125, "diameter": 0.11,
        "length": 1.3, "added_mass": (AXIAL, LATERAL, LATERAL, 0, 1, 1), "axial_drag": 0.4,
        "cross_flow_drag": 1.1, "fins": list(fins),
    }  # fmt: skip
    return sc.Body(**(settings | changes))


BOTH = (fin((0, 0, 1)), fin((0, 1, 0), lift_slope=2.0))
NOSE = (0.65, 0.0, 0.0)


@pytest.mark.parametrize("tow_x", [0.65, 0.0])
def test_derivatives_of_fins_and_munk_moment(tow_x):
    """Per rad of incidence: Munk (m22 − m11) U²; tail −½ρ S a U² (x_tow − x_tail). The hull's axial
    drag −½ρ Cd A U² acts along the axis, so that it has no part in it."""
    s = sc.static_stability(body(BOTH), (tow_x, 0, 0), SPEED)
    munk = (LATERAL - AXIAL) * SPEED**2
    arm = tow_x + 0.55
    for value, slope in ((s.pitch, 3.0), (s.yaw, 2.0)):
        expected = munk - 0.5 * RHO * 0.02 * slope * SPEED**2 * arm
        assert value == pytest.approx(expected, rel=1e-9)
    assert s.moment == pytest.approx([0, 0, 0], abs=1e-9)
    assert s.righting == pytest.approx(0.0, abs=1e-9)


def test_static_margin():
    """The neutral point is the tail's place, moved forward by Munk moment over lift slope."""
    s = sc.static_stability(body(BOTH), NOSE, SPEED)
    for margin, slope in ((s.pitch_margin, 3.0), (s.yaw_margin, 2.0)):
        neutral = -0.55 + (LATERAL - AXIAL) / (0.5 * RHO * 0.02 * slope)
        assert margin == pytest.approx((0.65 - neutral) / 1.3, rel=1e-9)


def test_without_fins_there_is_no_margin_and_the_munk_moment_upsets():
    s = sc.static_stability(body(), NOSE, SPEED)
    assert s.pitch_margin is None
    assert s.pitch == pytest.approx((LATERAL - AXIAL) * SPEED**2, rel=1e-9)
    assert "no lift" in str(s)
    assert "unstable" in str(s)
    assert "unstable" not in str(sc.static_stability(body(BOTH), NOSE, SPEED))


def test_low_centre_of_gravity_rights_in_pitch():
    """About a tow point at height 0 a body with its weight 1 cm low: −m g h per rad."""
    s = sc.static_stability(body(centre_of_gravity=(0, 0, -0.01)), (0, 0, 0), SPEED)
    assert s.righting == pytest.approx(-12.5 * 9.81 * 0.01, rel=1e-9)


def test_trim_between_weight_and_tail():
    """A neutral body with its centre of gravity a bit forward pitches nose down until the tail and
    the Munk moment hold it: small angle θ = m g x/(tail − Munk)."""
    x = 1e-4
    tail = 0.5 * RHO * 0.02 * 3.0 * SPEED**2 * (0.65 + 0.55)
    stiffness = tail - (LATERAL - AXIAL) * SPEED**2
    trimmed = sc.trimmed_pitch(body(BOTH, centre_of_gravity=(x, 0, 0)), NOSE, SPEED)
    # cross-flow drag is of second order in the angle of 3e-4 rad
    assert trimmed == pytest.approx(12.5 * 9.81 * x / stiffness, rel=0.01)
    again = sc.static_stability(body(BOTH, centre_of_gravity=(x, 0, 0)), NOSE, SPEED, pitch=trimmed)
    assert again.moment[1] == pytest.approx(0.0, abs=1e-9)


def test_trim_agrees_with_the_steady_tow():
    """Towed on a long, thin line, the body takes the trimmed pitch."""
    fish = body(BOTH, centre_of_gravity=(0.01, 0, -0.01))
    b = sc.ModelBuilder(sc.Water())
    b.add_prescribed_point("top")
    b.add_body("fish", fish)
    line = sc.LineProperties(length=5.0, diameter=0.001, mass_per_length=0.001, axial_stiffness=1e5)
    b.add_line("line", "top", "fish", line, segments=4, attachment=NOSE)
    state = sc.steady_tow(b.build(), position=(0, 0, -20), velocity=(SPEED, 0, 0))
    w, x, y, z = state.body_quaternion("fish")
    assert (x, z) == pytest.approx((0, 0), abs=1e-6)
    trimmed = sc.trimmed_pitch(fish, NOSE, SPEED)
    assert trimmed > math.radians(1)
    # the line's lumped weight and drag pull at the tow point itself: no moment about it
    assert 2 * math.atan2(y, w) == pytest.approx(trimmed, abs=1e-6)


def test_no_trim_is_an_error():
    """Weight far forward, no tail: it hangs nose down, beyond what the towing moment can hold."""
    with pytest.raises(sc.ConvergenceError, match="no trimmed pitch"):
        sc.trimmed_pitch(
            body(munk_moment=0.0, cross_flow_drag=0.0, centre_of_gravity=(0.1, 0, 0)),
            (0, 0, 0), SPEED, water=sc.Water(),
        )  # fmt: skip
