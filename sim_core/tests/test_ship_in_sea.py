# SPDX-License-Identifier: Apache-2.0
"""A tow point that moves as a ship in waves does."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sim_core as sc

FREQUENCY = [0.2, 0.6, 1.0, 2.0]
HEADING = [0.0, math.pi / 2, math.pi]  # the port side; the other one is its mirror


def operators(amplitude, phase=0.0):
    """The same operators at all frequencies and headings."""
    table = [[1.0] * len(FREQUENCY)] * len(HEADING)

    def rows(value):
        return (np.array(table) * value).tolist()

    return sc.ResponseOperators(
        frequency=FREQUENCY,
        heading=HEADING,
        amplitude={name: rows(value) for name, value in amplitude.items()},
        phase={name: rows(phase) for name in amplitude},
    )


def height(sea, time, x=0.0, y=0.0):
    return float(sea.elevation(np.array([time]), x=x, y=y)[0])


def train(direction, phase=0.4):
    return sc.Sea(amplitude=[1.5], frequency=0.8, direction=direction, phase=phase)


def irregular():
    return sc.jonswap_sea(
        significant_height=2.0, peak_period=8.0, direction=2.5, spreading=4, components=40, seed=3,
        frequency_range=(0.4, 1.6), ramp_time=20.0,
    )  # fmt: skip


def test_a_ship_that_follows_the_surface():
    """Heave operator 1: the tow point is as high as the water where the ship is."""
    sea, velocity = irregular(), (-3.0, 4.0, 0)
    motion = sc.ShipInSea(
        position=(5, 1, 2), velocity=velocity, sea=sea, operators=operators({"heave": 1.0})
    )
    for t in (0.0, 7.3, 25.0, 100.0):
        at = motion(t).position
        assert at[:2] == pytest.approx([5 - 3 * t, 1 + 4 * t])
        assert at[2] - 2 == pytest.approx(height(sea, t, at[0], at[1]), abs=1e-12)


@pytest.mark.parametrize("direction", [0.0, 1.0, math.pi])
def test_moves_at_the_frequency_of_encounter(direction):
    """ω − k V cos β: z̈ = −ω_e² z."""
    motion = sc.ShipInSea(
        position=(0, 0, 0), velocity=(5, 0, 0), sea=train(direction),
        operators=operators({"heave": 0.7}, phase=0.3),
    )  # fmt: skip
    encounter = 0.8 - 0.8**2 / 9.81 * 5 * math.cos(direction)
    sample = motion(3.3)
    assert sample.acceleration[2] == pytest.approx(-(encounter**2) * sample.position[2])


def test_phase_is_a_lead_in_time():
    sea = train(math.pi)
    motion = sc.ShipInSea(
        position=(0, 0, 0), sea=sea, operators=operators({"heave": 1.0}, phase=0.4)
    )
    assert motion(2.0).position[2] == pytest.approx(height(sea, 2.0 + 0.4 / 0.8))


def test_pitch_lifts_the_stern_when_the_bow_goes_down():
    """Tow point 10 m aft and 2 m above: (roll, pitch, yaw) × arm = pitch (2, 0, 10); on the course
    to port the ship's x is the tank's y. The reference point lies 10 m ahead of the tow point."""
    sea = train(-math.pi / 2)
    motion = sc.ShipInSea(
        position=(0, -10, 2), velocity=(0, 1e-9, 0), sea=sea, arm=(-10, 0, 2),
        operators=operators({"pitch": 0.02}),
    )  # fmt: skip
    pitch = 0.02 * height(sea, 1.7)
    assert motion(1.7).position - (0, -10, 2) == pytest.approx([0, 2 * pitch, 10 * pitch], abs=1e-7)


def test_waves_from_the_other_side_are_mirrored():
    table = sc.ResponseOperators(
        frequency=FREQUENCY,
        heading=HEADING,
        amplitude={
            name: np.random.default_rng(i).uniform(0, 1, (3, 4)).tolist()
            for i, name in enumerate(("sway", "heave", "roll", "pitch"))
        },
    )
    port, starboard = table.at(0.7, 1.0), table.at(0.7, -1.0)
    for name in ("heave", "pitch"):
        assert starboard[name] == port[name]
    for name in ("sway", "roll"):
        assert starboard[name] == -port[name]
    assert table.at(0.7, 1.0 + 2 * math.pi)["heave"] == pytest.approx(port["heave"])
    assert table.at(0.7, 2 * math.pi - 1.0)["sway"] == pytest.approx(-port["sway"])


def test_operators_are_interpolated_linearly():
    table = sc.ResponseOperators(
        frequency=[0.5, 1.0], heading=[0, 2], amplitude={"heave": [[1, 2], [3, 5]]},
        phase={"heave": [[0, 0], [0, math.pi]]},
    )  # fmt: skip
    assert table.at(0.5, 0)["heave"] == 1
    assert table.at(1.0, 2)["heave"] == pytest.approx(-5)
    assert table.at(0.75, 0)["heave"] == 1.5
    assert table.at(0.75, 1)["heave"] == pytest.approx((1.5 + (3 - 5) / 2) / 2)
    assert table.at(0.75, 1)["sway"] == 0


@given(t=st.floats(0.1, 60))
def test_derivatives_in_an_irregular_sea(t):
    """Central differences: h²/6 of the third derivative, below ω³ H of some m/s³; all six motions,
    run-up and ramp."""
    motion, h = THROUGH_THE_SEA, 1e-3
    before, now, after = motion(t - h), motion(t), motion(t + h)
    assert (after.position - before.position) / (2 * h) == pytest.approx(now.velocity, abs=1e-5)
    assert (after.velocity - before.velocity) / (2 * h) == pytest.approx(now.acceleration, abs=1e-5)


THROUGH_THE_SEA = sc.ShipInSea(
    position=(0, 0, 3), velocity=(2, 1, 0), sea=irregular(), arm=(-20, 1, 4), run_up_time=30.0,
    operators=operators(
        {"surge": 0.4, "sway": 0.3, "heave": 0.9, "roll": 0.03, "pitch": 0.02, "yaw": 0.005}, 0.7
    ),
)  # fmt: skip


def test_starts_at_rest():
    sample = THROUGH_THE_SEA(0.0)
    assert sample.position.tolist() == [0, 0, 3]
    assert sample.velocity.tolist() == [0, 0, 0]
    assert sample.acceleration.tolist() == [0, 0, 0]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: operators({"heaving": 1.0}), "no motion 'heaving'"),
        (lambda: operators({"heave": -1.0}), "amplitudes"),
        (
            lambda: sc.ResponseOperators(frequency=[1, 1], heading=[0], amplitude={}),
            "must increase",
        ),
        (
            lambda: sc.ResponseOperators(frequency=[1, 2], heading=[0], amplitude={"heave": [[1]]}),
            "one for each frequency",
        ),
        (lambda: operators({"heave": 1.0}).at(3.0, 0.0), "3.0.* outside of the table"),
        (
            lambda: sc.ShipInSea(
                position=(0, 0, 0), velocity=(1, 0, 1), sea=train(0), operators=operators({})
            ),
            "level",
        ),
    ],
)
def test_refuses_impossible_input(make, message):
    with pytest.raises(sc.InvalidInput, match=message):
        make()
