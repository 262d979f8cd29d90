# SPDX-License-Identifier: Apache-2.0
"""The rig's budgets at the operating point of a heave trial, for amplitude, ratio and phase."""

from __future__ import annotations

from dataclasses import dataclass

from towtank_rig import Rig
from towtank_uncertainty.depth_budget import OperatingPoint, SensorBudget, depth_budget
from towtank_uncertainty.intervals import Distribution
from towtank_uncertainty.ratio_budget import ratio_errors


@dataclass(frozen=True)
class HeaveBudget:
    """The rig's budgets of both pressure channels at the trial's operating point."""

    fish: SensorBudget
    depressor: SensorBudget

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
