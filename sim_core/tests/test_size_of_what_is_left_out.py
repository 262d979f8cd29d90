# SPDX-License-Identifier: Apache-2.0
"""How large the terms are that docs/theory.md leaves out, on the two-part tows of the rigs.

Not a check of the simulation, which does not have them: of what the theory page says about them.
`pytest -s` prints the numbers.
"""

import math

import numpy as np
import pytest

import sim_core as sc


def added_mass_of_lines_on_their_way(model, motion, period, added_mass):
    """Largest U²y″ and 2U∂y′/∂t times the added mass per length (N/m), over a period of heave.

    A line that slides along itself at U through water at rest moves the water across by
    (∂/∂t + U ∂/∂s)² y, of which only ∂²y/∂t² is kept; y″ is its curvature, y′ its direction.
    """
    result = sc.run(model, motion, t_end=10.0 + period, output_step=period / 40)
    keep = result.time >= 10.0
    largest = {}
    for name, mass in added_mass.items():
        line = result.lines[name]
        along = np.diff(line.node_positions[keep], axis=1)
        length = np.linalg.norm(along, axis=2, keepdims=True)
        t = along / length
        middle = t[:, 1:] + t[:, :-1]
        middle /= np.linalg.norm(middle, axis=2, keepdims=True)
        curvature = np.diff(t, axis=1) / (0.5 * (length[:, 1:] + length[:, :-1]))
        velocity = line.node_velocities[keep][:, 1:-1]
        speed = np.sum(velocity * middle, axis=2, keepdims=True)
        turning = np.gradient(middle, result.time[keep], axis=0)
        largest[name] = [
            mass * np.linalg.norm(f, axis=2).max()
            for f in (speed**2 * curvature, 2.0 * speed * turning)
        ]
    print(largest)
    return largest


def per_length(mass_in_air, mass_in_water):
    """Added mass of a line, kg/m: that of what it displaces (Ca 1)."""
    return mass_in_air - mass_in_water


@pytest.mark.parametrize("rig", ["nit", "wu_chwang"])
def test_added_mass_of_sliding_lines(rig, nit_model, wu_chwang_model):
    if rig == "nit":
        model, speed, amplitude, period, height = nit_model(), 1.0, 0.06, 2.0, 0.2
        added = {"primary": per_length(0.241, 0.154), "secondary": per_length(0.144, 0.075)}
        weight = {"primary": 0.154 * 9.81, "secondary": 0.075 * 9.81}  # N/m in water
    else:
        model, speed, amplitude, period, height = wu_chwang_model(), 1.75, 0.1, 1.6, -2.0
        added = {"primary": per_length(0.181, 0.104), "secondary": per_length(0.124, 0.065)}
        weight = {"primary": 0.104 * 9.81, "secondary": 0.065 * 9.81}
    motion = sc.Sinusoid(
        mean=(0, 0, height), velocity=(speed, 0, 0), amplitude=amplitude, period=period, ramp_time=3
    )
    found = added_mass_of_lines_on_their_way(model, motion, period, added)
    share = {name: max(f) / weight[name] for name, f in found.items()}
    # What theory.md says, shares of the line's weight in water
    expected = {
        "nit": {"primary": 0.001, "secondary": 0.07},
        "wu_chwang": {"primary": 0.07, "secondary": 0.08},
    }[rig]
    assert share == pytest.approx(expected, rel=0.15)


@pytest.mark.parametrize(
    ("period", "excess"), [(1.2, 0.323), (1.5, 0.104), (2.0, 0.030), (3.0, 0.006)]
)
def test_even_mean_of_the_water_along_a_spheroid(period, excess):
    """The added mass takes the mean of the water's motion over the length; the strips of a
    spheroid, with m ∝ 1 − ξ², feel more: 3 (sin h − h cos h)/h³ beside sin h/h, h = kL/2. A length
    of 1.3 m in waves along it."""
    water = sc.Water(waves=sc.regular_waves(height=1e-6, period=period))
    share = (np.arange(2000) + 0.5) / 1000 - 1
    rate = np.array([water.motion((0.65 * x, 0, -1), 0.0).acceleration[2] for x in share])
    strips = np.average(rate, weights=1 - share**2)
    assert strips / rate.mean() - 1 == pytest.approx(excess, abs=6e-4)


@pytest.mark.parametrize(("step", "loss"), [(30.0, 0.034), (60.0, 0.134), (90.0, 0.293)])
def test_response_operators_between_their_rows(step, loss):
    """Straight between two rows of one amplitude whose phases differ by `step` (deg), the complex
    operator is 1 − cos(step/2) short in the middle."""
    phase = [[0.0, math.radians(step)]] * 3
    motion = sc.ShipInSea(
        position=(0, 0, 0),
        sea=sc.Sea(amplitude=[1.0], frequency=0.5),
        operators=sc.ResponseOperators(
            frequency=[0.4, 0.6],
            heading=[0.0, math.pi / 2, math.pi],
            amplitude={"heave": [[1.0, 1.0]] * 3},
            phase={"heave": phase},
        ),
    )
    heave = [motion(t).position[2] for t in np.linspace(0, 4 * math.pi, 721)]
    assert 1 - max(heave) == pytest.approx(loss, abs=1e-3)
