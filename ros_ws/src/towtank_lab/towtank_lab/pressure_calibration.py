# SPDX-License-Identifier: Apache-2.0
"""Calibration of a pressure sensor by immersion at known depths, down and up again.

A straight line volts = offset + span · p/full scale, at the reference excitation, through
p = ρ g h by least squares. The scatter about it holds reading the depth, noise, hysteresis and
bend; type B come on top: the tape's scale, density and gravity (on the span), and where the port
lies against the tape's zero (on the offset).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from towtank_rig import Rig
from towtank_rig.conversion import PressureConversion, pressure_conversion, pressure_from_depth
from towtank_rig.instruments import PressureSensorName
from towtank_rig.quantity import NORMAL_95
from towtank_uncertainty.combination import Estimate

from towtank_lab.errors import ProcedureError
from towtank_lab.least_squares import Fit, combined, fit
from towtank_lab.propagation import relative_limit, worst

# Depths nearer than this to one another are the same step of the stairs, m.
_SAME_DEPTH = 0.005


@dataclass(frozen=True)
class Immersion:
    """One step: depth of the port below still water, m, and volts at the bridge's terminals, as at
    the board's nominal excitation (mean)."""

    depth: float
    volts: float


@dataclass(frozen=True)
class PressureResult:
    """The line, and how far the sensor is from one.

    Attributes:
        span: V at full scale and reference excitation, type A and B.
        offset: V, type A and B.
        fit: The least squares, over fractions of full scale.
        pressures: Of the immersions, Pa, shape (n,).
        hysteresis: Greatest difference between up and down at one depth, fraction of full scale;
            None if no depth was read both ways.
        bend: Greatest deviation of a parabola from its chord over the fitted range, fraction of
            full scale.
        bend_is_real: Whether the parabola's curvature stands out of its 95 % interval.
    """

    span: Estimate
    offset: Estimate
    fit: Fit
    pressures: np.ndarray
    hysteresis: float | None
    bend: float
    bend_is_real: bool

    @property
    def span_error(self) -> float:
        """Return half the 95 % interval of the slope, relative."""
        return self.span.u95 / self.span.value


def calibrate_pressure(
    rig: Rig,
    sensor: PressureSensorName,
    immersions: Sequence[Immersion],
    *,
    tape_limit: float,
    zero_limit: float,
) -> PressureResult:
    """Return the straight line through the immersions, in the order in which they were taken.

    Args:
        rig: For water, full scale and excitation.
        sensor: Which sensor.
        immersions: At least five, at three depths or more.
        tape_limit: Limit of the tape's relative error.
        zero_limit: Limit of the port's place against the tape's zero, m.

    Raises:
        ProcedureError: readings that do not carry a line.
    """
    depths = np.array([immersion.depth for immersion in immersions])
    if len(depths) < 5 or len(np.unique(np.round(depths / _SAME_DEPTH))) < 3:
        raise ProcedureError(
            f"{len(depths)} immersions at "
            f"{len(np.unique(np.round(depths / _SAME_DEPTH)))} depths: take five or more at three "
            "depths or more, going down and coming up"
        )
    if depths.min() < 0.0:
        raise ProcedureError(f"depth {depths.min():g} m lies above the water: give it downwards")
    given = getattr(rig.sensors, sensor)
    full_scale = given.full_scale.value
    pressures = pressure_from_depth(depths, rig.water)
    part = pressures / full_scale
    volts = np.array([immersion.volts for immersion in immersions])
    at_reference = volts * given.reference_excitation.value / rig.board.excitation.value
    line = fit(np.column_stack((np.ones_like(part), part)), at_reference)
    offset, span = line.estimate(0), line.estimate(1)
    if span.value <= 0.0:
        raise ProcedureError(
            "the volts fall with depth: exchange the bridge's outputs, or check the depths' order"
        )
    weight_limits = (relative_limit(rig.water.density), relative_limit(rig.water.gravity))
    bend, bend_is_real = _bend(part, at_reference, span.value)
    weight = rig.water.density.value * rig.water.gravity.value
    return PressureResult(
        combined(span, *(span.value * limit for limit in (tape_limit, *weight_limits))),
        combined(offset, span.value * weight * zero_limit / full_scale),
        line,
        pressures,
        _hysteresis(depths, line.residuals, span.value),
        bend,
        bend_is_real,
    )


def section(result: PressureResult, count: int) -> dict[str, object]:
    """Return the rig's section for this calibration, but for what every calibration says."""
    source = f"least squares through {count} immersions"
    return {
        "span": {"value": f"{result.span.value!r} V", "basis": "measured", "source": source},
        "offset": {"value": f"{result.offset.value!r} V", "basis": "measured", "source": source},
        "fitted_range": {
            "value": f"{float(result.pressures.max())!r} Pa",
            "basis": "measured",
            "source": "deepest immersion",
        },
        "span_error": {
            "value": result.span_error,
            "basis": "measured",
            "distribution": "normal",
            "source": f"{source}; tape, density and gravity",
        },
    }


def drift(rig: Rig, sensor: PressureSensorName, result: PressureResult) -> dict[str, object] | None:
    """Return what changed against the calibration in force; None if there is none.

    ``normalised`` is the difference of the spans over the root of the sum of both 95 % intervals'
    squares (E_n): up to 1 the two agree.
    """
    before = getattr(rig.calibrations, sensor)
    if before is None:
        return None
    conversion: PressureConversion = pressure_conversion(rig, sensor)
    change = result.span.value / conversion.span - 1.0
    # The record before gives its 95 % interval, or a limit of which 95 % is 1.96 sigma
    interval = NORMAL_95 * before.span_error.standard_uncertainty
    offset = (result.offset.value - conversion.offset) * conversion.full_scale / conversion.span
    return {
        "against": before.id,
        "span_relative": change,
        "offset_Pa": offset,
        **worst({"span": abs(change) / math.hypot(interval, result.span_error)}),
    }


def _hysteresis(depths: np.ndarray, residuals: np.ndarray, span: float) -> float | None:
    """Residuals are compared, so that depths that differ by millimetres may be paired."""
    deepest = int(np.argmax(depths))
    differences = [
        abs(float(np.mean(residuals[down]) - np.mean(residuals[up])))
        for depth in np.unique(np.round(depths / _SAME_DEPTH))
        for down, up in [_both_ways(depths, depth, deepest)]
        if down.any() and up.any()
    ]
    return max(differences) / span if differences else None


def _both_ways(depths: np.ndarray, depth: float, deepest: int) -> tuple[np.ndarray, np.ndarray]:
    """Masks of the readings of one depth before and after the deepest."""
    here = np.round(depths / _SAME_DEPTH) == depth
    order = np.arange(len(depths))
    return here & (order < deepest), here & (order > deepest)


def _bend(part: np.ndarray, volts: np.ndarray, span: float) -> tuple[float, bool]:
    parabola = fit(np.column_stack((np.ones_like(part), part, part**2)), volts)
    curvature = parabola.estimate(2)
    # A parabola c x² leaves its chord over [0, x] by at most c x²/4.
    deviation = abs(curvature.value) * float(part.max()) ** 2 / 4.0 / span
    return deviation, abs(curvature.value) > curvature.u95
