# SPDX-License-Identifier: Apache-2.0
"""Uncertainty of heave amplitudes and of their ratio, combined by the GUM (JCGM 100:2008).

Type A comes from the scatter around the fitted harmonic, with few degrees of freedom; type B from
the rig's sensor budget, whose figures count as exact. The expanded uncertainty has 95 % coverage:
the interval of the sum of a normal scatter and the budget's errors, each with its own distribution
(towtank_rig.coverage), is widened as Student's factor for the effective degrees of freedom of Welch
and Satterthwaite (GUM G.4) is wider than the normal one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from scipy.special import stdtrit
from towtank_rig import Rig
from towtank_rig.coverage import Distribution, Normal, half_width
from towtank_rig.quantity import NORMAL_95
from towtank_rig.uncertainty import (
    OperatingPoint,
    SensorBudget,
    depth_budget,
    ratio_errors,
    ratio_relative_uncertainty,
)

COVERAGE = 0.95


@dataclass(frozen=True)
class Uncertainty:
    """Standard uncertainties and the expanded one, all in the unit of the result.

    coverage_factor: u95 over the combined standard uncertainty.
    """

    type_a: float
    type_b: float
    u95: float
    coverage_factor: float


def combine(type_a: float, dof: float, errors: Sequence[Distribution]) -> Uncertainty:
    """Expanded uncertainty of a result.

    dof: degrees of freedom of `type_a`. errors: those of type B, in the unit of the result.
    """
    type_b = math.hypot(*(error.deviation for error in errors))
    combined = math.hypot(type_a, type_b)
    if combined == 0:
        return Uncertainty(0.0, 0.0, 0.0, math.nan)
    u95 = half_width((Normal(type_a), *errors), COVERAGE)
    if type_a > 0:
        effective_dof = dof * (combined / type_a) ** 4
        # Beyond a million Student's distribution is the normal one
        u95 *= float(stdtrit(min(effective_dof, 1e6), (1 + COVERAGE) / 2)) / NORMAL_95
    return Uncertainty(type_a, type_b, u95, u95 / combined)


@dataclass(frozen=True)
class HeaveBudget:
    """The rig's budgets of both pressure channels at the trial's operating point."""

    fish: SensorBudget
    depressor: SensorBudget

    @property
    def ratio_relative(self) -> float:
        """Relative standard uncertainty of the ratio; what both sensors share cancels."""
        return ratio_relative_uncertainty(self.fish, self.depressor)

    @property
    def ratio_errors(self) -> tuple[Distribution, ...]:
        """Relative errors of the ratio."""
        return ratio_errors(self.fish, self.depressor)

    @property
    def phase_errors(self) -> tuple[Distribution, ...]:
        """Errors of the phase between fish and depressor, rad.

        Errors of gain do not turn the phase. The flow's pressure under surge does: it oscillates by
        itself, with a phase to heave that nobody knows, so its whole effect counts here too.
        """
        sensors = (self.fish, self.depressor)
        return tuple(
            error
            for sensor in sensors
            for error in sensor.errors(lambda c: c.gain if c.effect == "surge" else 0.0)
        )


def heave_budget(
    rig: Rig,
    depths: tuple[float, float],
    amplitudes: tuple[float, float],
    zero_depths: tuple[float, float] = (0.0, 0.0),
) -> HeaveBudget:
    """Budgets for heave at the rig's towing speed; each pair is of fish and depressor, m.

    depths: means below the place of zeroing, which lies at zero_depths below still water. A tow
    that seems to rise above the water is taken to be there: no budget holds above it.
    """
    speed = rig.run.carriage_speed.value
    fish, depressor = (
        OperatingPoint(max(depth + zeroed_at, 0.0), amplitude, speed, zeroed_at)
        for depth, amplitude, zeroed_at in zip(depths, amplitudes, zero_depths, strict=True)
    )
    return HeaveBudget(
        depth_budget(rig, "fish_pressure", fish),
        depth_budget(rig, "depressor_pressure", depressor),
    )
