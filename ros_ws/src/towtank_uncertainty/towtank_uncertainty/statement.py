# SPDX-License-Identifier: Apache-2.0
"""What a rig's sensors can tell: depth, pitch and heave ratio with their uncertainty.

Each is stated by a budget of first order (GUM) with the interval of its errors' distributions, and
beside it by Monte Carlo propagation (GUM Supplement 1), which is not confined to first order.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, replace
from functools import cached_property

from towtank_rig.conversion import depth_from_pressure
from towtank_rig.instruments import PressureSensorName
from towtank_rig.loading import replaced
from towtank_rig.schema import Rig

from towtank_uncertainty.depth_budget import (
    Component,
    OperatingPoint,
    amplitude_noise,
    depth_budget,
)
from towtank_uncertainty.inclination_budget import inclination_budget
from towtank_uncertainty.intervals import Distribution, Normal, half_width
from towtank_uncertainty.monte_carlo import Array, Propagated, RandomSensors
from towtank_uncertainty.ratio_budget import ratio_components, ratio_errors


@dataclass(frozen=True)
class Conditions:
    """Where the statements hold; lengths in m, angles in rad.

    Attributes:
        depth: Of a depth, below still water.
        zeroed_at: Where the sensors were zeroed, below still water.
        pitch: Of the fish, REP-103.
        depressor_amplitude: Heave of the depressor.
        ratio: Heave of the fish over it.
        samples: So many that an amplitude is fitted to.
    """

    depth: float
    zeroed_at: float
    pitch: float
    depressor_amplitude: float
    ratio: float
    samples: int


@dataclass(frozen=True)
class BoardNoise:
    """White noise of front end and ADC in one conversion, V at the terminals."""

    fish_pressure: float = 0.0
    depressor_pressure: float = 0.0
    accelerometer: float = 0.0


@dataclass(frozen=True)
class Line:
    """One line of a budget; figures are standard uncertainties.

    Attributes:
        name: The error's name.
        value: In the error's own unit.
        unit: Of value.
        effect: What it makes of the result, in the result's unit.
        source: Where the figure comes from.
    """

    name: str
    value: float
    unit: str
    effect: float
    source: str


@dataclass(frozen=True)
class Budget:
    """One quantity under one practice, to first order.

    Attributes:
        quantity: What is measured.
        practice: How: what is calibrated and zeroed, and what moves.
        unit: Of all figures.
        lines: The errors that have an effect, the largest first.
        u95: Half the 95 % interval, of the errors' own distributions.
    """

    quantity: str
    practice: str
    unit: str
    lines: tuple[Line, ...]
    u95: float

    @property
    def standard_uncertainty(self) -> float:
        """Return the combined standard uncertainty, k = 1."""
        return math.hypot(*(line.effect for line in self.lines))

    @property
    def expanded(self) -> float:
        """Return twice the standard uncertainty, as many papers state it (k = 2)."""
        return 2.0 * self.standard_uncertainty


@dataclass(frozen=True)
class Statement:
    """A budget, and the same by Monte Carlo."""

    budget: Budget
    monte_carlo: Propagated


def deepest_reading(rig: Rig) -> float:
    """Return the depth, m, at which the first of the two pressure sensors ends its scale."""
    sensors = (rig.sensors.fish_pressure, rig.sensors.depressor_pressure)
    full_scale = min(sensor.full_scale.value for sensor in sensors)
    return float(depth_from_pressure(full_scale, rig.water))


def default_conditions(rig: Rig) -> Conditions:
    """Return conditions of a rig's own.

    The deepest water that its sensors may see, a level fish, a depressor that heaves as the crank
    does and a fish with 0.22 of it, 40 s of samples.
    """
    return Conditions(
        depth=min(rig.tank.depth.value, deepest_reading(rig)),
        zeroed_at=0.0,
        pitch=0.0,
        depressor_amplitude=rig.tow_point.motion.crank_radius.value,
        ratio=0.22,
        samples=round(40.0 * rig.board.sample_rate.value),
    )


def statements(
    rig: Rig, at: Conditions, board: BoardNoise, *, draws: int = 100_000, seed: int = 1
) -> list[Statement]:
    """Return the statements on depth, pitch and heave ratio, by the practices that the rig allows.

    By the data sheets alone first; with its calibrations, where it has any, last. ``draws`` random
    sensors, drawn by ``seed``, for Monte Carlo.
    """
    bare = replaced(rig, {"calibrations": {}})
    practices = [_Practice("data sheet", bare, at, board, draws, seed)]
    given = rig.calibrations
    if given.fish_pressure or given.depressor_pressure or given.accelerometer:
        practices.append(_Practice("as calibrated", rig, at, board, draws, seed))
    sheet, best = practices[0], practices[-1]
    depth, pitch, _ = best.in_a_trial()
    asked = (
        sheet.depth(),
        *(practice.zeroed_depth(speed=0.0) for practice in practices),
        depth,
        *(practice.pitch(crank_rate=0.0) for practice in practices),
        pitch,
        *(practice.ratio() for practice in practices),
    )
    return [Statement(one.budget, Propagated.of(one.errors())) for one in asked]


def trial_budgets(rig: Rig, at: Conditions, board: BoardNoise) -> list[Budget]:
    """Return the budgets of depth, pitch and heave ratio in a trial with the rig as it is."""
    return [one.budget for one in _Practice("as calibrated", rig, at, board).in_a_trial()]


def as_json(statement: Statement) -> dict[str, object]:
    """Return a statement as plain data; figures in the statement's unit."""
    budget = statement.budget
    return {
        **asdict(budget),
        "standard_uncertainty": budget.standard_uncertainty,
        "expanded_k2": budget.expanded,
        "monte_carlo": asdict(statement.monte_carlo),
    }


@dataclass(frozen=True)
class _Asked:
    """One quantity: its budget, and what draws errors of it."""

    budget: Budget
    errors: Callable[[], Array]


@dataclass(frozen=True)
class _Practice:
    """A rig as somebody uses it; ``draws`` random ones of its sensors, drawn when first needed."""

    name: str
    rig: Rig
    conditions: Conditions
    board: BoardNoise
    draws: int = 0
    seed: int = 0

    @cached_property
    def sensors(self) -> RandomSensors:
        return RandomSensors(self.rig, self.draws, self.seed)

    def in_a_trial(self) -> tuple[_Asked, _Asked, _Asked]:
        """Depth, pitch and heave ratio, towed and with the crank turning."""
        run = self.rig.run
        return (
            self.zeroed_depth(run.carriage_speed.value),
            self.pitch(run.crank_rate.value),
            self.ratio(),
        )

    def depth(self) -> _Asked:
        at = OperatingPoint(self.conditions.depth, amplitude=1.0, speed=0.0)
        return self._depth(at, self.name, lambda c: c.absolute_depth, RandomSensors.depth)

    def zeroed_depth(self, speed: float) -> _Asked:
        at = OperatingPoint(self.conditions.depth, 1.0, speed, self.conditions.zeroed_at)
        practice = f"{self.name}, zeroed" + (f", towed at {speed:g} m/s" if speed else "")
        return self._depth(at, practice, lambda c: c.depth, RandomSensors.zeroed_depth)

    def _depth(
        self,
        at: OperatingPoint,
        practice: str,
        effect: Callable[[Component], float],
        read: Callable[[RandomSensors, PressureSensorName, OperatingPoint, float], Array],
    ) -> _Asked:
        budget = depth_budget(self.rig, "fish_pressure", at, self.board.fish_pressure)
        lines = [
            *(Line(c.name, c.value, c.unit, effect(c), c.source) for c in budget.components),
            _noise_line("one sample", budget.noise, "m", budget.noise),
        ]
        errors = (*budget.errors(effect), Normal(budget.noise))
        quantity = f"depth of the fish at {at.mean_depth:.3g} m"
        return _Asked(
            _budget(quantity, practice, "m", lines, errors),
            lambda: read(self.sensors, "fish_pressure", at, budget.noise),
        )

    def pitch(self, crank_rate: float) -> _Asked:
        angle = self.conditions.pitch
        budget = inclination_budget(self.rig, angle, crank_rate=crank_rate)
        given = self.rig.sensors.accelerometer
        volts = math.hypot(given.errors.noise.value, self.board.accelerometer)
        force = volts / given.sensitivity.value
        noise = force / self.rig.water.gravity.value
        lines = [
            *(Line(c.name, c.value, c.unit, c.pitch, c.source) for c in budget.components),
            _noise_line("one sample", force, "m/s^2", noise),
        ]
        errors = (*budget.pitch_errors, Normal(noise))
        quantity = f"pitch at {math.degrees(angle):.3g} deg"
        practice = f"{self.name}, {'crank turning' if crank_rate else 'at rest'}"
        return _Asked(
            _budget(quantity, practice, "rad", lines, errors),
            lambda: self.sensors.pitch(angle, crank_rate, force),
        )

    def ratio(self) -> _Asked:
        at, speed = self.conditions, self.rig.run.carriage_speed.value
        fish = OperatingPoint(at.depth, at.ratio * at.depressor_amplitude, speed, at.zeroed_at)
        depressor = replace(fish, amplitude=at.depressor_amplitude)
        budgets = (
            depth_budget(self.rig, "fish_pressure", fish, self.board.fish_pressure),
            depth_budget(self.rig, "depressor_pressure", depressor, self.board.depressor_pressure),
        )
        noises = [amplitude_noise(budget.noise, at.samples) for budget in budgets]
        relative = [n / b.at.amplitude for n, b in zip(noises, budgets, strict=True)]
        lines = [
            *(Line(c.name, c.value, c.unit, c.gain, c.source) for c in ratio_components(*budgets)),
            *(
                _noise_line(f"{at.samples} samples, {budget.sensor}", noise, "m", effect)
                for budget, noise, effect in zip(budgets, noises, relative, strict=True)
            ),
        ]
        errors = (*ratio_errors(*budgets), *map(Normal, relative))
        return _Asked(
            _budget("heave ratio, relative", f"{self.name}, towed", "1", lines, errors),
            lambda: self.sensors.ratio(fish, depressor, (noises[0], noises[1])),
        )


def _noise_line(of: str, value: float, unit: str, effect: float) -> Line:
    return Line(f"noise of {of}", value, unit, effect, "sensor, front end and ADC")


def _budget(
    quantity: str, practice: str, unit: str, lines: Iterable[Line], errors: Iterable[Distribution]
) -> Budget:
    effective = (line for line in lines if line.effect > 0.0)
    ordered = sorted(effective, key=lambda line: line.effect, reverse=True)
    return Budget(quantity, practice, unit, tuple(ordered), half_width(errors))
