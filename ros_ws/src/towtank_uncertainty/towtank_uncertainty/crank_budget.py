# SPDX-License-Identifier: Apache-2.0
"""Uncertainty of the crank's angle and of the tow point's heave that follows from it (GUM).

A count stands for a whole step of the encoder: a sample lies anywhere within it (type A), and so
did the crank when it was zeroed (type B), by a motion law whose angle there is known to the
calibration's, or the rig's, ``zero_angle_error``. Heave feels the angle by the law's slope, and the
crank's radius, which lies within its range in the rig.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from towtank_rig.conversion import crank_encoder
from towtank_rig.motion import tow_point_motion
from towtank_rig.schema import Rig
from towtank_rig.tow import TowPoint

from towtank_uncertainty.error_terms import distribution_of
from towtank_uncertainty.intervals import Distribution, Rectangular, Scaled, half_width
from towtank_uncertainty.sample import UNKNOWN, SampleUncertainty
from towtank_uncertainty.statement import Budget, Line

# The ratio of the 95 % interval to the standard uncertainty takes a millisecond and changes slowly
_ANGLE_STEPS = 64  # of a turn


@dataclass(frozen=True)
class _Error:
    name: str
    unit: str
    distribution: Distribution
    source: str


class CrankBudget:
    """Errors of a rig's crank; the first is type A, the others are type B."""

    def __init__(self, rig: Rig) -> None:
        encoder = rig.calibrations.crank or rig.sensors.crank_encoder
        within_step = Rectangular(abs(crank_encoder(rig).per_count) / 2.0)
        counts = f"{encoder.counts_per_revolution} counts per revolution"
        zero = encoder.zero_angle_error
        radius = rig.tow_point.motion.crank_radius
        low, high = radius.range or (radius.value, radius.value)
        self._errors = (
            _Error("count of one sample", "rad", within_step, counts),
            _Error("count at the zero", "rad", within_step, counts),
            _Error("zero angle", "rad", distribution_of(zero), zero.source),
            _Error("crank radius", "m", Rectangular((high - low) / 2.0), radius.source),
        )
        u = self._errors[-1].distribution.deviation
        self._motion = tow_point_motion(rig.tow_point)
        self._longer, self._shorter = (
            tow_point_motion(_with_radius(rig.tow_point, radius.value + shift)) for shift in (u, -u)
        )
        self._interval = lru_cache(maxsize=None)(self._relative_interval)
        effects = self._of_angle()
        self._angle = SampleUncertainty(effects[0], math.hypot(*effects[1:]), self._half(effects))

    def at(self, angle: float) -> tuple[SampleUncertainty, SampleUncertainty]:
        """Return those of angle, rad, and heave, m, at a crank angle, rad; NaN at NaN."""
        if math.isnan(angle):
            return UNKNOWN, UNKNOWN
        effects = self._of_heave(angle)
        relative = self._interval(round(angle / (2.0 * math.pi) * _ANGLE_STEPS) % _ANGLE_STEPS)
        u95 = relative * math.hypot(*effects)
        return self._angle, SampleUncertainty(effects[0], math.hypot(*effects[1:]), u95)

    def budgets(self) -> tuple[Budget, Budget]:
        """Return the budgets of one sample: of the angle, and of heave where it is known worst."""
        angles = np.linspace(0.0, 2.0 * math.pi, 8 * _ANGLE_STEPS, endpoint=False).tolist()
        worst = max(angles, key=lambda angle: math.hypot(*self._of_heave(angle)))
        where = f"crank at {math.degrees(worst):.0f}°"
        return (
            self._budget("crank angle", "zeroed", "rad", self._of_angle()),
            self._budget("heave of the tow point", where, "m", self._of_heave(worst)),
        )

    def _of_angle(self) -> tuple[float, ...]:
        """Effects of one standard uncertainty of each error on the angle, rad."""
        return tuple(e.distribution.deviation * (e.unit == "rad") for e in self._errors)

    def _of_heave(self, angle: float) -> tuple[float, ...]:
        """Effects of one standard uncertainty of each error on heave, m."""
        at = np.asarray(angle)
        slope = abs(float(self._motion.slope(at)))
        longer = abs(float(self._longer.heave(at) - self._shorter.heave(at))) / 2.0
        return (*(slope * effect for effect in self._of_angle()[:-1]), longer)

    def _half(self, effects: tuple[float, ...]) -> float:
        return half_width(
            Scaled(effect / error.distribution.deviation, error.distribution)
            for effect, error in zip(effects, self._errors, strict=True)
            if effect > 0.0
        )

    def _relative_interval(self, step: int) -> float:
        effects = self._of_heave(step * 2.0 * math.pi / _ANGLE_STEPS)
        combined = math.hypot(*effects)
        return self._half(effects) / combined if combined > 0.0 else 0.0

    def _budget(
        self, quantity: str, practice: str, unit: str, effects: tuple[float, ...]
    ) -> Budget:
        lines = [
            Line(error.name, error.distribution.deviation, error.unit, effect, error.source)
            for error, effect in zip(self._errors, effects, strict=True)
            if effect > 0.0
        ]
        lines.sort(key=lambda line: line.effect, reverse=True)
        return Budget(quantity, practice, unit, tuple(lines), self._half(effects))


def _with_radius(tow_point: TowPoint, value: float) -> TowPoint:
    motion = tow_point.motion
    radius = motion.crank_radius.model_copy(update={"value": value})
    changed = motion.model_copy(update={"crank_radius": radius})
    return tow_point.model_copy(update={"motion": changed})
