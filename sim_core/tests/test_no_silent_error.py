# SPDX-License-Identifier: Apache-2.0
"""Two hundred random systems: each run keeps its balance of energy, or says where it fails."""

import math
import re

import numpy as np
import pytest

import sim_core as sc

SHARE = 0.01  # of the energy that has passed from one form to another
PLACE_AND_TIME = re.compile(r"(line|point|body) '.*'.* t = |t = .*(line|point|body) '")


def random_cable(rng, length):
    diameter = 10 ** rng.uniform(-2.7, -1.5)
    displaced = 1000 * math.pi / 4 * diameter**2
    return sc.LineProperties(
        length=length,
        diameter=diameter,
        mass_per_length=displaced * rng.uniform(0.9, 4.0),  # from floating to steel
        axial_stiffness=10 ** rng.uniform(2.5, 8.0),  # from rubber to steel bar
        axial_damping=10 ** rng.uniform(-1, 3) if rng.random() < 0.3 else 0.0,
        normal_drag=rng.uniform(0.8, 2.0),
        tangential_drag=rng.uniform(0.0, 0.05),
        added_mass=rng.uniform(0, 1.2),
    )


def add_random_sphere(builder, rng, name, relative_density):
    radius = 10 ** rng.uniform(-1.7, -0.8)
    volume = 4 / 3 * math.pi * radius**3
    builder.add_free_point(
        name,
        mass=1000 * volume * rng.uniform(*relative_density),
        volume=volume,
        drag_area=rng.uniform(0.1, 1.2) * math.pi * radius**2,
        added_mass=rng.uniform(0, 1) * 1000 * volume,
    )


def random_fish(rng):
    length = rng.uniform(0.3, 2.0)
    diameter = rng.uniform(0.05, 0.2) * length
    volume = math.pi / 4 * diameter**2 * length
    mass = 1000 * volume * rng.uniform(0.95, 1.05)
    across = mass * (length**2 / 12 + diameter**2 / 16)
    fins = [
        sc.Fin(
            position=(-0.45 * length, 0, 0), normal=normal, area=0.3 * length * diameter,
            lift_slope=3.0, drag=0.02, stall_angle=0.3,
        )
        for normal in ((0, 0, 1), (0, 1, 0))
    ]  # fmt: skip
    return sc.Body(
        mass=mass,
        inertia=(mass * diameter**2 / 8, across, across),
        centre_of_gravity=(0, 0, -0.1 * diameter),
        volume=volume,
        diameter=diameter,
        length=length,
        added_mass=(0.05 * mass, mass, mass, 0, mass * length**2 / 12, mass * length**2 / 12),
        axial_drag=rng.uniform(0.1, 1.5),
        cross_flow_drag=1.1,
        munk_moment=float(rng.choice([0.0, 1.0])),
        fins=fins if rng.random() < 0.6 else [],
    )


def random_tow(seed):
    """A single or a two-part tow with a heaving tow point: slack lines, up to 10 Hz and 3 g, at
    rest in a quarter of the cases."""
    rng = np.random.default_rng([0, seed])
    b = sc.ModelBuilder(sc.Water(density=float(rng.choice([1000.0, 1025.0]))))
    b.add_prescribed_point("tow_point")
    length = 10 ** rng.uniform(-0.3, 2.0)

    def segments():
        return int(rng.integers(1, 9))

    if rng.random() < 0.6:
        b.add_free_point("junction")
        add_random_sphere(b, rng, "depressor", (1.3, 9))
        fish = random_fish(rng)
        b.add_body("fish", fish)
        short, second = rng.uniform(0.03, 0.3) * length, rng.uniform(0.2, 1) * length
        nose = (fish.length / 2, 0, 0)
        b.add_line(
            "primary", "tow_point", "junction", random_cable(rng, length), segments=segments()
        )
        b.add_line("short", "junction", "depressor", random_cable(rng, short), segments=segments())
        b.add_line(
            "secondary", "junction", "fish", random_cable(rng, second), segments=segments(),
            attachment=nose,
        )  # fmt: skip
    else:
        floats = rng.random() < 0.3
        add_random_sphere(b, rng, "depressor", (0.7, 1.2) if floats else (1.3, 9))
        b.add_line(
            "primary", "tow_point", "depressor", random_cable(rng, length), segments=segments()
        )
    period = 10 ** rng.uniform(-1, 1)
    largest = 3 * 9.81 * (period / (2 * math.pi)) ** 2
    motion = sc.Sinusoid(
        mean=(0, 0, 0.2 if rng.random() < 0.3 else -1.0),
        velocity=(0.0 if rng.random() < 0.25 else rng.uniform(0.1, 5.0), 0, 0),
        amplitude=min(10 ** rng.uniform(-3, 0), 0.5 * length, largest),
        period=period,
        ramp_time=min(period, 0.5),
    )
    return b.build(), motion


@pytest.fixture(scope="module")
def outcomes():
    """Per system the record of its energy, or what it said."""
    found = []
    for seed in range(200):
        model, motion = random_tow(seed)
        try:
            result = sc.run(model, motion, t_end=2.0, output_step=0.1, energy_tolerance=SHARE)
            found.append(result)
        except sc.ConvergenceError as error:
            found.append(str(error))
    return found


def test_keeps_its_balance_or_says_where_and_when_it_fails(outcomes):
    for seed, outcome in enumerate(outcomes):
        if isinstance(outcome, str):
            # a steady tow that is not found has a place and no time
            assert PLACE_AND_TIME.search(outcome) or "no steady tow" in outcome, seed
        else:
            e = outcome.energy
            assert np.isfinite(e["numerical"]).all(), seed
            rounding = 1e-9 * outcome.steps * 1e4  # J, for weights up to 10 kN
            lost = np.abs(e["numerical"] + e["impact"])  # what snaps lose counts as well
            assert np.all(lost <= SHARE * e["exchanged"] + rounding), seed
            assert np.abs(e["other"]).max() <= 1e-6 * (1 + e["exchanged"][-1]), seed


def test_nearly_all_finish(outcomes):
    assert sum(isinstance(outcome, str) for outcome in outcomes) <= 4


def test_impacts_only_lose_energy(outcomes):
    """What no step resolves where a line snaps makes no energy."""
    results = [outcome for outcome in outcomes if not isinstance(outcome, str)]
    assert sum(result.snaps > 0 for result in results) > 20
    for result in results:
        e = result.energy
        assert e["impact"][-1] <= 1e-3 * e["exchanged"][-1]


def test_stops_where_no_step_keeps_the_balance():
    """Asked for more than the arithmetic can give, it stops and keeps the last good state."""
    model, motion = random_tow(36)
    at = motion(0.0)
    state = sc.steady_tow(model, position=at.position.tolist(), velocity=(at.velocity[0], 0, 0))
    simulator = sc.Simulator(model, state, max_step=2.0, energy_tolerance=1e-13)
    with pytest.raises(sc.ConvergenceError, match=r"energy balance .* t = .* worst at "):
        simulator.step(2.0, motion)
    assert np.isfinite(simulator.point_position("depressor")).all()


def test_refuses_a_tolerance_of_nought():
    model, motion = random_tow(1)
    with pytest.raises(sc.InvalidInput, match="energy_tolerance"):
        sc.run(model, motion, t_end=0.1, energy_tolerance=0.0)
