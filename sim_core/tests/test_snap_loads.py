# SPDX-License-Identifier: Apache-2.0
"""Peak tensions where a line snaps taut: resolved, bounded, or said not to be.

A weight m falls freely by h until its line comes taut, a spring k. With m g (h + x) = k x²/2 the
peak is m g (1 + √(1 + 2 h k/(m g))), and without loss the weight leaves the line with the √(2 g h)
that it came with. The line's own mass is 1e-3 of the weight's, half of which goes along: 5e-4 of
the energy.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import sim_core as sc

MASS, GRAVITY = 12.5, 9.81
HELD = sc.SteadyTow(position=(0, 0, 0))
DROPS = {  # unstretched length m, EA N, free fall m
    "steel wire": (1.5, 6.28e5, 0.2),  # 34 ms
    "polyamide": (1.5, 2e4, 0.2),  # 192 ms
    "long wire": (10.0, 6.28e5, 0.5),  # 89 ms
}
every_drop = pytest.mark.parametrize("name", DROPS)


def hung(length: float, stiffness: float, segments: int = 1, share: float = 1e-3) -> sc.Model:
    """A weight in air below a fixed point; its line has that share of its mass."""
    wire = sc.LineProperties(
        length=length, diameter=1e-3, mass_per_length=share * MASS / length,
        axial_stiffness=stiffness,
    )  # fmt: skip
    return sc.System(
        water=sc.Water(density=0.0),
        points={"top": sc.PrescribedPoint(), "weight": sc.FreePoint(mass=MASS)},
        lines={"line": sc.Line("top", "weight", wire, segments=segments)},
    ).build()


def drop(name: str, later: float = 0.0, **settings: object) -> sc.Result:
    """The fall, from ``later`` seconds after it began, until 0.25 s after the line comes taut."""
    length, stiffness, height = DROPS[name]
    model = hung(length, stiffness)
    state = sc.State(model)
    fallen = 0.5 * GRAVITY * later**2
    state.set_point("weight", (0, 0, -(length - height) - fallen), (0, 0, -GRAVITY * later))
    taut = math.sqrt(2 * height / GRAVITY) - later
    return sc.run(model, HELD, t_end=taut + 0.25, state=state, **settings)  # type: ignore[arg-type]


def exact_peak(name: str) -> float:
    length, stiffness, height = DROPS[name]
    weight = MASS * GRAVITY
    return weight * (1 + math.sqrt(1 + 2 * height * stiffness / length / weight))


def rebound(result: sc.Result, name: str) -> float:
    """The largest upward speed over that with which the weight came."""
    return result.points["weight"].velocity[:, 2].max() / math.sqrt(2 * GRAVITY * DROPS[name][2])


@every_drop
def test_error_tolerance_resolves_the_peak_and_the_rebound(name: str) -> None:
    """The stretch at the peak is v/ω, 11 mm for the shorter wire: 0.1 mm are 1 % of it, in each of
    a few steps."""
    result = drop(name, error_tolerance=1e-4, output_step=0.001)
    peak = result.lines["line"].peak_tensions[0]
    assert peak == pytest.approx(exact_peak(name), rel=0.02)
    assert rebound(result, name) == pytest.approx(1.0, abs=0.02)
    assert result.impacts == 0
    assert result.warnings == ()
    plain = drop(name)
    assert drop(name, error_tolerance=1e-4).steps < 1.5 * plain.steps  # only at the snap


@every_drop
def test_energy_tolerance_resolves_the_rebound(name: str) -> None:
    """1 % of the energy exchanged, thrice m g h till then (fall, stretch, rebound): 3 % of the
    energy, 1.5 % of the speed."""
    result = drop(name, energy_tolerance=0.01, output_step=0.001, balance=True)
    assert rebound(result, name) == pytest.approx(1.0, abs=0.02)
    assert result.energy["impact"][-1] == 0.0
    # as above, in √energy; and (ω h)²/8 between two steps, at 14 a period 2.5 %
    assert result.lines["line"].peak_tensions[0] == pytest.approx(exact_peak(name), rel=0.04)


@every_drop
@pytest.mark.parametrize("step", [0.005, 0.002, 0.001])
def test_peak_without_tolerance_is_within_its_bound(name: str, step: float) -> None:
    """10/n² for n steps in a period, whenever within a step the line comes taut."""
    length, stiffness, _ = DROPS[name]
    period = 2 * math.pi * math.sqrt(MASS * length / stiffness)
    bound = 10 / (period / step) ** 2
    for part in np.linspace(0, 1, 7):
        # no sample cuts a step short
        result = drop(name, later=part * step, max_step=step, output_step=10.0)
        error = result.lines["line"].peak_tensions[0] / exact_peak(name) - 1
        assert -bound - 1e-3 < error < 1e-3 + bound
        assert result.impacts == 0
        if result.least_resolved_snap is not None:
            snap = result.least_resolved_snap
            # t_end cuts all steps a little: they are equal
            assert snap.steps_per_period == pytest.approx(period / step, rel=0.02)
            assert snap.peak_error == pytest.approx(bound, rel=0.04)
            assert (result.warnings == ()) == (snap.peak_error <= 0.05)


def chain_peak(length: float, stiffness: float, segments: int, speed: float) -> float:
    """Largest tension of any segment of an unstretched chain at rest whose end weight comes down,
    in half a period of the slowest mode: by the normal modes, exact as long as all are taut."""
    half = 0.5e-3 * MASS / segments
    masses = np.full(segments, 2 * half)
    masses[-1] = MASS + half
    k = stiffness / length * segments
    stretch = np.eye(segments) - np.eye(segments, k=-1)  # of each segment, from the nodes' sinking
    scale = 1 / np.sqrt(masses)
    omega2, modes = np.linalg.eigh(scale[:, None] * (k * stretch.T @ stretch) * scale)
    omega = np.sqrt(omega2)
    rest = modes.T @ (np.sqrt(masses) * GRAVITY) / omega2
    start = modes.T @ (np.eye(segments)[-1] * np.sqrt(masses) * speed) / omega
    t = np.arange(0.0, math.pi / omega[0], 0.1 / omega[-1])[:, None]
    q = rest * (1 - np.cos(omega * t)) + start * np.sin(omega * t)
    tensions = k * (q @ modes.T * scale) @ stretch.T
    assert tensions.min() > -1e-3 * tensions.max()  # none goes slack
    return float(tensions.max())


@every_drop
def test_waves_and_weight_of_many_segments(name: str) -> None:
    """Ten segments, whose waves (speed √(EA/μ)) run along the wire while it stops the weight."""
    length, stiffness, height = DROPS[name]
    speed = math.sqrt(2 * GRAVITY * height)
    exact = chain_peak(length, stiffness, 10, speed)
    # the waves are there: with its reflections √(EA μ) v, 3 % of the weight's swing m v √(EA/(ℓ m))
    weight = MASS * GRAVITY
    swing = weight + math.sqrt(weight**2 + MASS * stiffness / length * speed**2)
    assert exact > 1.015 * swing
    model = hung(length, stiffness, segments=10)
    state = sc.State(model)
    for i in range(1, 10):
        state.set_line_node("line", i, (0, 0, -length * i / 10))
    state.set_point("weight", (0, 0, -length), (0, 0, -speed))
    for settings, error in (
        # of a wave of tension T the displacement is T/k of a segment, at 1e-5 m some per cent of T
        ({"error_tolerance": 1e-5}, 0.02),
        ({"error_tolerance": 1e-4}, 0.1),
    ):
        result = sc.run(model, HELD, t_end=0.1, state=state, output_step=0.1, **settings)
        assert result.lines["line"].peak_tensions.max() == pytest.approx(exact, rel=error)


def test_unresolved_snap_is_an_impact_and_is_said_to_be_one() -> None:
    """ω h = √(k Σ1/m) h = 7.2 for a weight of 0.2 kg at 5 ms: less than one step a period. What is
    lost is the m g h of the fall; where it counts against the balance, steps get smaller."""
    length, mass, stiffness = 1.5, 0.2, 6.28e5
    wire = sc.LineProperties(
        length=length, diameter=1e-3, mass_per_length=1e-9, axial_stiffness=stiffness
    )
    model = sc.System(
        water=sc.Water(density=0.0),
        points={"top": sc.PrescribedPoint(), "weight": sc.FreePoint(mass=mass)},
        lines={"wire": sc.Line("top", "weight", wire, segments=1)},
    ).build()
    state = sc.State(model)
    state.set_point("weight", (0, 0, -length + 0.2))
    result = sc.run(model, HELD, t_end=0.4, state=state, output_step=0.1)
    snap = result.least_resolved_snap
    assert snap is not None and snap.line == "wire"
    assert snap.time == pytest.approx(math.sqrt(2 * 0.2 / GRAVITY), abs=0.005)
    period = 2 * math.pi * math.sqrt(mass * length / stiffness)
    assert snap.steps_per_period == pytest.approx(period / 0.005, rel=1e-6)
    assert snap.impact and snap.peak_error == 1.0
    assert 0 < result.impacts <= result.snaps
    (warning,) = result.warnings
    assert "line 'wire'" in warning and "not resolved" in warning
    # taken as it is
    fall = mass * GRAVITY * 0.2
    kept = sc.run(model, HELD, t_end=0.4, state=state, energy_tolerance=0.01, inelastic_snaps=True)
    assert kept.energy["impact"][-1] == pytest.approx(-fall, rel=0.1)
    assert kept.impacts > 0
    # counted
    held = sc.run(model, HELD, t_end=0.4, state=state, energy_tolerance=0.01)
    lost = np.abs(held.energy["impact"] + held.energy["numerical"])
    rounding = 1e-9 * mass * GRAVITY * held.steps
    assert np.all(lost <= 0.01 * held.energy["exchanged"] + rounding)
    assert held.points["weight"].velocity[:, 2].max() > 0.9 * math.sqrt(2 * GRAVITY * 0.2)


def test_snap_at_the_end_of_a_heavy_cable_is_one_as_well() -> None:
    """Whether it is a snap is a matter of the segment and its ends: 600 m of cable above it, whose
    weight of 6.5 kN is more than the tension jumps by, change nothing."""
    cable = sc.LineProperties(
        length=600.0, diameter=0.02, mass_per_length=1.1, axial_stiffness=2e7, axial_damping=1e5
    )
    wire = sc.LineProperties(length=1.5, diameter=1e-3, mass_per_length=0.01, axial_stiffness=2e4)
    snaps = []
    for sections in (((cable, 20), (wire, 1)), ((wire, 1),)):
        model = sc.System(
            water=sc.Water(density=0.0),
            points={"top": sc.PrescribedPoint(), "weight": sc.FreePoint(mass=MASS)},
            lines={"line": sc.SectionedLine("top", "weight", sections=sections)},
        ).build()
        hanging = sc.steady_tow(model, position=(0, 0, 0))
        x, y, z = hanging.point_position("weight")
        hanging.set_point("weight", (x, y, z + 0.3))
        result = sc.run(model, HELD, t_end=0.5, state=hanging, max_step=0.05)
        assert result.lines["line"].peak_tensions[-1] < 600 * 1.1 * GRAVITY
        snaps.append(result.least_resolved_snap)
    assert snaps[0] is not None and snaps[1] is not None
    # the cable's end, 16.5 kg, gives way: the reduced mass is 7.1 kg of 12.5
    ratio = math.sqrt(7.1 / 12.5)
    assert snaps[0].steps_per_period == pytest.approx(snaps[1].steps_per_period * ratio, rel=0.02)
