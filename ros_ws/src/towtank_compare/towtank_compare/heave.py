# SPDX-License-Identifier: Apache-2.0
"""The heave ratio over one window of a trial.

`analyse_window` is used by the comparison node, by the comparison of bags and by the report, on
the same samples with the same result. Times in it count from the window's start.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from towtank_rig import Rig
from towtank_uncertainty.combination import CombinedUncertainty, combine
from towtank_uncertainty.depth_budget import SensorBudget
from towtank_uncertainty.intervals import Scaled

from towtank_compare.harmonic import MIN_PERIODS, AnalysisError, Harmonic, fit_first_harmonic
from towtank_compare.heave_uncertainty import HeaveBudget, heave_budget
from towtank_compare.peak_to_peak import PeakToPeak, read_peak_to_peak
from towtank_compare.series import Series

Source = Literal["measured", "twin", "plant"]

NS_PER_MS = 1_000_000

PERIOD_TOLERANCE = 0.02
"""A window that lacks this much of a crank period still counts it as whole: the regressors are
fitted together, so that a period short of 2 % does no harm."""

MIN_TURN_RAD = 0.1
"""Less turning than this over a window is a crank at rest."""

MAX_REVERSAL_RAD = 0.1
"""Turning back by more than this is no steady crank; less is play in the drive."""

MIN_AMPLITUDE_M = 1e-6
"""A body that heaves less is at rest, and a ratio means nothing."""


@dataclass(frozen=True)
class HeaveSamples:
    """What one analysis needs. crank: angle, rad; fish, depressor: heave, m, upwards.

    zero_depths: where the sensors of fish and depressor were zeroed, m below still water; heave is
    measured from there.
    """

    source: Source
    crank: Series
    fish: Series
    depressor: Series
    zero_depths: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Motion:
    """Heave of one body: first harmonic at the crank frequency.

    amplitude: m. phase: lead over cos θ, θ being the crank angle, rad. uncertainty: of the
    amplitude, m; None for a simulation. mean: of the used samples, m. largest_gap_s: between two
    used samples.
    """

    amplitude: float
    phase: float
    uncertainty: CombinedUncertainty | None
    mean: float
    samples: int
    effective_samples: float
    residual_rms: float
    largest_gap_s: float


@dataclass(frozen=True)
class HeaveResult:
    """Heave ratio of one source over one window.

    t0_ms, t1_ms: the window, ms since the epoch. periods: whole crank periods that were used, from
    `used_from_s` to `used_to_s` after t0. ratio: fish over depressor. phase: of the fish less that
    of the depressor, rad, in (−π, π]; positive when the fish leads. Uncertainties and `budget` are
    None for a simulation.
    """

    source: Source
    t0_ms: int
    t1_ms: int
    periods: int
    used_from_s: float
    used_to_s: float
    crank_frequency_hz: float
    ratio: float
    ratio_uncertainty: CombinedUncertainty | None
    phase: float
    phase_uncertainty: CombinedUncertainty | None
    fish: Motion
    depressor: Motion
    peak_to_peak: PeakToPeak
    budget: HeaveBudget | None

    @property
    def u95(self) -> float | None:
        """Expanded uncertainty (95 %) of the ratio."""
        return self.ratio_uncertainty.u95 if self.ratio_uncertainty else None

    @property
    def phase_deg(self) -> float:
        """`phase` in degrees."""
        return math.degrees(self.phase)


def analyse_window(samples: HeaveSamples, rig: Rig, t0_ms: int, t1_ms: int) -> HeaveResult:
    """Heave ratio over the samples with t0 ≤ stamp ≤ t1, in whole crank periods.

    t0_ms, t1_ms: integers, ms since the epoch. `rig` gives the sensors' uncertainty, which counts
    for a measured source only. Raises AnalysisError, with the reason, where there is no result.
    """
    turning = _crank_turning(samples.crank, t0_ms, t1_ms)
    fish = _fit(samples.fish, turning, "fish")
    depressor = _fit(samples.depressor, turning, "depressor")
    if min(fish.harmonic.amplitude, depressor.harmonic.amplitude) < MIN_AMPLITUDE_M:
        raise AnalysisError("fish or depressor does not heave: there is no ratio")
    ratio = fish.harmonic.amplitude / depressor.harmonic.amplitude
    budget = None
    ratio_uncertainty, phase_uncertainty = None, None
    if samples.source == "measured":
        budget = heave_budget(
            rig,
            (-fish.mean, -depressor.mean),
            (fish.harmonic.amplitude, depressor.harmonic.amplitude),
            samples.zero_depths,
        )
        relative, dof = _relative_scatter(fish.harmonic, depressor.harmonic)
        errors = [Scaled(ratio, error) for error in budget.ratio_errors]
        ratio_uncertainty = combine(ratio * relative, dof, errors)
        phase_uncertainty = combine(relative, dof, budget.phase_errors)
    return HeaveResult(
        source=samples.source,
        t0_ms=t0_ms,
        t1_ms=t1_ms,
        periods=turning.periods,
        used_from_s=float(fish.time_s[0]),
        used_to_s=float(fish.time_s[-1]),
        crank_frequency_hz=turning.frequency_hz,
        ratio=ratio,
        ratio_uncertainty=ratio_uncertainty,
        phase=cmath.phase(fish.harmonic.value / depressor.harmonic.value),
        phase_uncertainty=phase_uncertainty,
        fish=_motion(fish, budget.fish if budget else None),
        depressor=_motion(depressor, budget.depressor if budget else None),
        peak_to_peak=read_peak_to_peak(
            samples.fish.between(turning.t0_ns, turning.t1_ns),
            samples.depressor.between(turning.t0_ns, turning.t1_ns),
        ),
        budget=budget,
    )


@dataclass(frozen=True)
class _Turning:
    """The crank over a window: samples of the turned angle, growing, and its whole periods."""

    t0_ns: int
    t1_ns: int
    stamp_ns: np.ndarray
    time_s: np.ndarray
    angle: np.ndarray
    periods: int

    @property
    def frequency_hz(self) -> float:
        turns = (self.angle[-1] - self.angle[0]) / (2 * math.pi)
        return float(turns / (self.time_s[-1] - self.time_s[0]))


def _crank_turning(crank: Series, t0_ms: int, t1_ms: int) -> _Turning:
    t0_ns, t1_ns = t0_ms * NS_PER_MS, t1_ms * NS_PER_MS
    used = crank.between(t0_ns, t1_ns)
    if len(used) < 2:
        raise AnalysisError("no crank angles in the window")
    unknown = np.isnan(used.values)
    if unknown.any():
        at_s = used.seconds_since(t0_ns)[np.argmax(unknown)]
        raise AnalysisError(
            f"the crank's angle is not known at {at_s:.2f} s of the window, for the board was "
            "reset: choose a window before it, or after the crank was zeroed again"
        )
    turned = used.values[-1] - used.values[0]
    if abs(turned) < MIN_TURN_RAD:
        raise AnalysisError("the crank does not turn")
    angle = math.copysign(1.0, turned) * used.values
    if np.max(np.maximum.accumulate(angle) - angle) > MAX_REVERSAL_RAD:
        raise AnalysisError("the crank turns back within the window: choose a steady part")
    periods = math.floor(abs(turned) / (2 * math.pi) + PERIOD_TOLERANCE)
    if periods < MIN_PERIODS:
        raise AnalysisError(
            f"only {abs(turned) / (2 * math.pi):.2f} crank periods in the window, "
            f"{MIN_PERIODS} are needed: widen it"
        )
    return _Turning(t0_ns, t1_ns, used.stamp_ns, used.seconds_since(t0_ns), angle, periods)


@dataclass(frozen=True)
class _FittedHeave:
    """The samples of one body within the whole periods, and their first harmonic."""

    time_s: np.ndarray
    mean: float
    harmonic: Harmonic


def _fit(heave: Series, turning: _Turning, name: str) -> _FittedHeave:
    # No angle is known before the first and after the last sample of the crank.
    used = heave.between(int(turning.stamp_ns[0]), int(turning.stamp_ns[-1]))
    time_s = used.seconds_since(turning.t0_ns)
    angle = np.interp(time_s, turning.time_s, turning.angle)
    start = float(turning.angle[0])
    whole = angle - start <= 2 * math.pi * turning.periods
    time_s, angle, values = time_s[whole], angle[whole], used.values[whole]
    try:
        harmonic = fit_first_harmonic(values, angle, start, turning.periods)
    except AnalysisError as error:
        raise AnalysisError(f"heave of the {name}: {error}") from error
    return _FittedHeave(time_s, float(np.mean(values)), harmonic)


def _relative_scatter(fish: Harmonic, depressor: Harmonic) -> tuple[float, float]:
    """Relative standard uncertainty of the ratio, which is also that of the phase in rad, from the
    scatter, and its degrees of freedom. The segments of both bodies are taken together, so that
    motion that they share is not counted twice."""
    deviations = fish.segments / fish.value - depressor.segments / depressor.value
    variance = float(np.sum(np.abs(deviations) ** 2)) / 2
    return math.sqrt(variance), min(fish.dof, depressor.dof)


def _motion(fitted: _FittedHeave, budget: SensorBudget | None) -> Motion:
    harmonic = fitted.harmonic
    uncertainty = None
    if budget is not None:
        errors = [Scaled(harmonic.amplitude, e) for e in budget.errors(lambda c: c.gain)]
        uncertainty = combine(math.sqrt(harmonic.variance), harmonic.dof, errors)
    return Motion(
        amplitude=harmonic.amplitude,
        phase=harmonic.phase,
        uncertainty=uncertainty,
        mean=fitted.mean,
        samples=harmonic.samples,
        effective_samples=harmonic.effective_samples,
        residual_rms=harmonic.residual_rms,
        largest_gap_s=float(np.max(np.diff(fitted.time_s))),
    )
