# SPDX-License-Identifier: Apache-2.0
"""Calibration of the crank's encoder: counts per turn, direction, and where its zero lies.

The crank is turned by hand to marks at known angles of its disc, through two turns or more, always
in the sense in which it runs. Counts over angles are a straight line; its slope is the counts per
turn with their sign. Mark 0 is where the crank is zeroed before a trial. If the tow point's height
was read at the marks too, the motion law fitted to the heights (mean height, crank radius and the
law's angle at mark 0) tells which crank angle that mark is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from towtank_rig import Rig
from towtank_rig.instruments import CrankCalibration, CrankEncoder
from towtank_rig.motion import tow_point_motion
from towtank_rig.quantity import NORMAL_95
from towtank_uncertainty.combination import Estimate

from towtank_lab.errors import ProcedureError
from towtank_lab.least_squares import Fit, combined, fit
from towtank_lab.propagation import within_range, worst


@dataclass(frozen=True)
class Mark:
    """Angle of the disc against mark 0, rad, over all turns; the encoder's count there; the tow
    point's height above any fixed level, m, or None."""

    angle: float
    counts: int
    height: float | None = None


@dataclass(frozen=True)
class CrankResult:
    """What the marks tell.

    Attributes:
        counts_per_turn: With the sign of the direction.
        counts_per_revolution: What the rig states if the marks allow it, for an encoder's counts
            are a whole number that its maker knows; else the nearest whole number.
        zero_angle: Angle by the motion law at mark 0, rad; None without heights.
        radius: Crank radius from the heights, m; None without heights.
        fit: Least squares of the counts over turns: count at mark 0, counts per turn.
    """

    counts_per_turn: Estimate
    counts_per_revolution: int
    zero_angle: Estimate | None
    radius: Estimate | None
    fit: Fit

    @property
    def direction(self) -> int:
        """Return 1 if the count rises with the crank's angle, else −1."""
        return 1 if self.counts_per_turn.value > 0.0 else -1


def calibrate_crank(rig: Rig, marks: Sequence[Mark], *, mark_limit: float) -> CrankResult:
    """Return counts per turn, direction and zero.

    Args:
        rig: For the motion law.
        marks: At least five, over one turn or more.
        mark_limit: Limit of the error of mark 0's place, rad.

    Raises:
        ProcedureError: marks that do not carry it, or an encoder that lost counts between them.
    """
    angles = np.array([mark.angle for mark in marks])
    if len(marks) < 5 or np.ptp(angles) < 2.0 * math.pi * (1.0 - 1e-9):
        raise ProcedureError(
            f"{len(marks)} marks over {np.ptp(angles) / (2.0 * math.pi):.2g} turns: take five or "
            "more over at least one turn"
        )
    turns = angles / (2.0 * math.pi)
    counts = np.array([mark.counts for mark in marks], dtype=float)
    line = fit(np.column_stack((np.ones_like(turns), turns)), counts)
    # A count stands for the whole step: half of it on either side, over the turns between the ends
    slope = combined(line.estimate(1), 0.5 / float(np.ptp(turns)))
    if abs(slope.value) < 4.0:
        raise ProcedureError("the counts do not move: check the encoder's cable and its supply")
    zero, radius = _from_heights(rig, marks, mark_limit)
    found = abs(slope.value)
    stated = _stated(rig).counts_per_revolution
    counts_per_revolution = stated if abs(found - stated) <= slope.u95 else round(found)
    return CrankResult(slope, counts_per_revolution, zero, radius, line)


def section(result: CrankResult, mark_limit: float) -> dict[str, object]:
    """Return the rig's section for this calibration, but for what every calibration says."""
    zero = result.zero_angle
    source = "motion law through the heights" if zero else "mark 0 is taken for angle 0"
    return {
        "counts_per_revolution": result.counts_per_revolution,
        "direction": result.direction,
        "zero_angle": {
            "value": f"{zero.value if zero else 0.0!r} rad",
            "basis": "measured",
            "source": source,
        },
        "zero_angle_error": {
            "value": f"{zero.u95 if zero else mark_limit!r} rad",
            "basis": "measured",
            "distribution": "normal" if zero else "rectangular",
            "source": source,
        },
    }


def drift(rig: Rig, result: CrankResult) -> dict[str, object]:
    """Return what differs from the encoder, the zero and the crank that the rig states.

    ``normalised`` is the greatest difference of counts per turn (without their sign), zero angle
    and radius over the root of the sum of both 95 % intervals' squares (E_n), ``of`` which it is.
    The zero compares with the last calibration's: without one the rig states none. Zero and radius
    need heights.
    """
    stated = _stated(rig)
    change = abs(result.counts_per_turn.value) - stated.counts_per_revolution
    found: dict[str, object] = {
        "against": getattr(stated, "id", "the rig's sensors.crank_encoder"),
        "counts_per_turn": change,
        "direction_changed": result.direction != stated.direction,
    }
    normalised = {"counts per turn": abs(change) / result.counts_per_turn.u95}
    before = rig.calibrations.crank
    if before is not None and result.zero_angle is not None:
        turned = math.remainder(result.zero_angle.value - before.zero_angle.value, 2.0 * math.pi)
        interval = NORMAL_95 * before.zero_angle_error.standard_uncertainty
        found["zero_angle_rad"] = turned
        normalised["zero angle"] = abs(turned) / math.hypot(interval, result.zero_angle.u95)
    if result.radius is not None:
        nominal = within_range(rig.tow_point.motion.crank_radius)
        longer = result.radius.value - nominal.value
        found["radius_m"] = longer
        both = math.hypot(nominal.u95, result.radius.u95)
        normalised["the rig's crank radius"] = abs(longer) / both
    return {**found, **worst(normalised)}


def _stated(rig: Rig) -> CrankCalibration | CrankEncoder:
    return rig.calibrations.crank or rig.sensors.crank_encoder


def _from_heights(
    rig: Rig, marks: Sequence[Mark], mark_limit: float
) -> tuple[Estimate | None, Estimate | None]:
    """Fit mean height, radius and the law's angle at mark 0; the radius scales the rig's law."""
    read = [(mark.angle, mark.height) for mark in marks if mark.height is not None]
    if not read:
        return None, None
    if len(read) < 6:
        raise ProcedureError(f"{len(read)} heights for three unknowns: read six or more, or none")
    angles, heights = (np.array(column) for column in zip(*read, strict=True))
    motion = tow_point_motion(rig.tow_point)
    nominal = rig.tow_point.motion.crank_radius.value
    if nominal == 0.0:
        raise ProcedureError("the rig's crank has no radius: its heights tell no angle")

    def residuals(unknown: np.ndarray) -> np.ndarray:
        mean, radius, zero = unknown
        return mean + radius / nominal * motion.heave(angles + zero) - heights

    # The law's angle is periodic: of several starts the best is taken
    starts = np.arange(0.0, 2.0 * math.pi, math.pi / 3.0)
    found = min(
        (least_squares(residuals, (heights.mean(), nominal, start)) for start in starts),
        key=lambda solution: solution.cost if solution.x[1] > 0.0 else math.inf,
    )
    freedom = len(read) - 3
    variance = 2.0 * found.cost / freedom
    covariance = variance * np.linalg.inv(found.jac.T @ found.jac)
    zero = math.remainder(float(found.x[2]), 2.0 * math.pi)
    return (
        combined(Estimate(zero, math.sqrt(covariance[2, 2]), float(freedom)), mark_limit),
        Estimate(float(found.x[1]), math.sqrt(covariance[1, 1]), float(freedom)),
    )
