# SPDX-License-Identifier: Apache-2.0
"""Uncertainty of heave amplitudes and of their ratio, combined by the GUM (JCGM 100:2008).

Type A comes from the scatter around the fitted harmonic, with few degrees of freedom; type B from
the rig's sensor budget, whose figures count as exact. The expanded uncertainty has 95 % coverage,
with Student's factor for the effective degrees of freedom of Welch and Satterthwaite (GUM G.4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from scipy.special import stdtrit
from towtank_rig import Rig
from towtank_rig.uncertainty import (
    OperatingPoint,
    SensorBudget,
    depth_budget,
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


def combine(type_a: float, dof: float, type_b: float) -> Uncertainty:
    """Expanded uncertainty of a result. dof: degrees of freedom of `type_a`; type B has none."""
    combined = math.hypot(type_a, type_b)
    if type_a > 0:
        effective_dof = dof * (combined / type_a) ** 4
        # Beyond a million Student's distribution is the normal one
        coverage_factor = float(stdtrit(min(effective_dof, 1e6), (1 + COVERAGE) / 2))
    else:
        coverage_factor = float(stdtrit(1e6, (1 + COVERAGE) / 2))
    return Uncertainty(type_a, type_b, coverage_factor * combined, coverage_factor)


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
    def phase(self) -> float:
        """Standard uncertainty of the phase between fish and depressor, rad.

        Errors of gain do not turn the phase. The flow's pressure under surge does: it oscillates by
        itself, with a phase to heave that nobody knows, so its whole effect counts here too.
        """
        sensors = (self.fish, self.depressor)
        return math.hypot(*(c.gain for s in sensors for c in s.components if c.name == "surge"))


def heave_budget(
    rig: Rig,
    fish_depth: float,
    fish_amplitude: float,
    depressor_depth: float,
    depressor_amplitude: float,
) -> HeaveBudget:
    """Budgets for mean depths and heave amplitudes in m, at the rig's towing speed.

    A depth is that of the measurement: once zeroed, below the place where the sensor was zeroed.
    A tow that rises from that place is taken to be there: no budget holds above the water.
    """
    speed = rig.run.carriage_speed.value
    return HeaveBudget(
        depth_budget(
            rig, "fish_pressure", OperatingPoint(max(fish_depth, 0.0), fish_amplitude, speed)
        ),
        depth_budget(
            rig,
            "depressor_pressure",
            OperatingPoint(max(depressor_depth, 0.0), depressor_amplitude, speed),
        ),
    )
