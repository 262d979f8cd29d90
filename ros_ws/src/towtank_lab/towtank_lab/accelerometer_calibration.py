# SPDX-License-Identifier: Apache-2.0
"""Calibration of the accelerometer by gravity in known attitudes: six positions or a tilt table.

At rest the specific force in fish axes is f = g (−sin θ, cos θ sin φ, cos θ cos φ) at pitch θ and
roll φ (REP-103). The volts of the three axes are v = b + A f; least squares over all positions
gives the zeros b and the matrix A, an offset and three slopes for each axis. With M the rig's
mounting (sensor to fish axes), A M = diag(s) (I + E), E with a zero diagonal: s_k is the axis's
sensitivity along where it should point, E what it feels of the other two. The antisymmetric part of
E is a small rotation of the whole sensor, the symmetric part couples its axes.

A table that leans by δ moves zeros and E together, and least squares says by how much. Over the six
positions the x axis lies across gravity, and along the table's x, in four: its zero moves by
4/6 s g δ. The two upright ones move by the same, so that nothing goes into what x feels of z, and a
level fish then reads its pitch wrong by 2/3 δ. The y axis lies along the table's y in z up, x up
and x down, against it in z down: its zero moves by 2/6 s g δ, what it feels of z by δ, and roll is
wrong by 4/3 δ. Zero and E being moved by the same lean, they would be counted as independent of
each other in a budget. So what a lean makes of each axis's volts when the fish is level counts as
that axis's error of zero, and not again as an error of its direction: away from level by θ, what
that leaves out goes with θ δ.

An axis that bends (n at 1 g, by the square) shows n in the two positions along gravity: its zero
moves by s n/3, and the slopes do not feel it. Lean and bend leave residuals as well. These are no
scatter, and do not count as such: they are taken out before the scatter, which all three axes
share, is taken for type A.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from towtank_rig import Rig
from towtank_rig.conversion import accelerometer_conversion, mounting_rotation, rotation
from towtank_rig.quantity import NORMAL_95, Tolerance
from towtank_uncertainty.combination import Estimate
from towtank_uncertainty.sensor_errors import STANDARD_GRAVITY

from towtank_lab.errors import ProcedureError
from towtank_lab.least_squares import Fit, combined, fit
from towtank_lab.propagation import relative_limit, worst

SIX_POSITIONS: dict[str, tuple[float, float]] = {
    "z up (upright)": (0.0, 0.0),
    "z down (keel up)": (180.0, 0.0),
    "x up (bow up)": (0.0, -90.0),
    "x down (bow down)": (0.0, 90.0),
    "y up (port side up)": (90.0, 0.0),
    "y down (port side down)": (-90.0, 0.0),
}
"""Roll and pitch in degrees of the positions that need no tilt table."""


@dataclass(frozen=True)
class Position:
    """Attitude of the fish, rad (REP-103), and the mean volts of x, y and z in it."""

    roll: float
    pitch: float
    volts: tuple[float, float, float]


@dataclass(frozen=True)
class AccelerometerResult:
    """What the positions tell.

    Attributes:
        zero_g: V of each axis, type A and B.
        level_error: Half the 95 % interval of each axis's zero, V, with the table's lean by what it
            makes of the volts when the fish is level.
        sensitivity: V/(m/s²) of each axis, type A and B.
        misalignment: E, shape (3, 3), rad; the diagonal is zero.
        alignment_error: Half the 95 % interval of each entry of E, rad, the greatest; without the
            table's lean.
        fits: Least squares of each axis: offset and three slopes in fish axes; the scatter is that
            of all axes.
    """

    zero_g: tuple[Estimate, ...]
    level_error: tuple[float, ...]
    sensitivity: tuple[Estimate, ...]
    misalignment: np.ndarray
    alignment_error: float
    fits: tuple[Fit, ...]

    @property
    def rotation(self) -> np.ndarray:
        """Return the small rotation vector of the sensor against the rig's mounting, rad, (3,)."""
        return rotation_vector(self.misalignment)

    @property
    def coupling(self) -> np.ndarray:
        """Return how much each axis sees of the others, shape (3, 3), symmetric."""
        return (self.misalignment + self.misalignment.T) / 2.0

    @property
    def sensitivity_error(self) -> float:
        """Return half the 95 % interval of the sensitivities, relative, the greatest."""
        return max(estimate.u95 / estimate.value for estimate in self.sensitivity)

    @property
    def zero_g_error(self) -> float:
        """Return half the 95 % interval of the axes' volts at zero, V, the greatest."""
        return max(self.level_error)

    @property
    def rotation_error(self) -> float:
        """Return half the 95 % interval of the rotation, rad.

        A lean of the table turns the axes by as much as it shifts a level fish's volts, at most.
        """
        slope = min(estimate.value for estimate in self.sensitivity)
        return math.hypot(self.alignment_error, self.zero_g_error / slope / STANDARD_GRAVITY)


def rotation_vector(misalignment: np.ndarray) -> np.ndarray:
    """Return the small rotation, rad, shape (3,), in what each axis feels of the others, (3, 3)."""
    e = (misalignment - misalignment.T) / 2.0
    return np.array([e[1, 2], e[2, 0], e[0, 1]])


def calibrate_accelerometer(
    rig: Rig, positions: Sequence[Position], *, level_limit: float
) -> AccelerometerResult:
    """Return zeros, sensitivities and misalignment.

    Args:
        rig: For gravity and the sensor's mounting.
        positions: At least six that point all ways.
        level_limit: Limit of the table's inclination, rad, common to all positions.

    Raises:
        ProcedureError: positions that do not tell the axes apart.
    """
    if len(positions) < 6:
        raise ProcedureError(f"{len(positions)} positions: take all six, or more on a tilt table")
    gravity = rig.water.gravity.value
    force = np.array([specific_force(p.roll, p.pitch, gravity) for p in positions])
    volts = np.array([position.volts for position in positions])
    design = np.column_stack((np.ones(len(positions)), force))
    fits = tuple(fit(design, volts[:, axis]) for axis in range(3))
    mounting = mounting_rotation(rig.sensors.accelerometer.mounting)
    slopes = np.array([axis.coefficients[1:] for axis in fits]) @ mounting
    along = np.diag(slopes)
    for name, row, own in zip("xyz", slopes, along, strict=True):
        if own < np.linalg.norm(row) * math.cos(math.radians(30.0)):
            raise ProcedureError(
                f"axis {name} does not point where the rig's mounting says: check the channels' "
                "order, the mounting, and the order of the positions"
            )
    leans = level_limit * _by_lean(positions, fits, gravity)
    nonlinearity = rig.sensors.accelerometer.errors.nonlinearity.value
    bends = nonlinearity * along[:, None] * np.square(force @ mounting / STANDARD_GRAVITY).T
    fits = _scattering(fits, design, np.array([leans[:, 0], leans[:, 1], *_each_alone(bends)]))
    to_coefficients = np.linalg.pinv(design).T
    zeros, level_errors, sensitivities = [], [], []
    for axis, lean, bend, direction, slope in zip(
        fits, leans @ to_coefficients, bends @ to_coefficients, mounting.T, along, strict=True
    ):
        zeros.append(combined(axis.estimate(0), bend[0], *lean[:, 0]))
        level = lean @ (1.0, 0.0, 0.0, gravity)
        level_errors.append(combined(axis.estimate(0), bend[0], *level).u95)
        variance = float(direction @ axis.covariance[1:, 1:] @ direction)
        estimate = Estimate(float(slope), math.sqrt(variance), float(axis.freedom))
        others = (slope * relative_limit(rig.water.gravity), direction @ bend[1:])
        sensitivities.append(combined(estimate, *others))
    return AccelerometerResult(
        tuple(zeros),
        tuple(level_errors),
        tuple(sensitivities),
        slopes / along[:, None] - np.eye(3),
        _alignment_error(fits, along),
        fits,
    )


def specific_force(roll: float, pitch: float, gravity: float) -> np.ndarray:
    """Return what an accelerometer at rest feels in fish axes, m/s², shape (3,); angles in rad."""
    return rotation(roll, pitch, 0.0).T @ np.array([0.0, 0.0, gravity])


def section(result: AccelerometerResult, count: int) -> dict[str, object]:
    """Return the rig's section for this calibration, but for what every calibration says."""
    source = f"least squares through {count} positions"

    def measured(value: float, unit: str) -> dict[str, object]:
        return {"value": f"{value!r} {unit}", "basis": "measured", "source": source}

    def interval(value: float, unit: str) -> dict[str, object]:
        written = value if unit == "1" else f"{value!r} {unit}"
        return {
            "value": written,
            "basis": "measured",
            "distribution": "normal",
            "source": f"{source}; level of the table, bend, gravity",
        }

    axes: dict[str, object] = {
        name: {
            "zero_g": measured(zero.value, "V"),
            "sensitivity": measured(sensitivity.value, "V/(m/s^2)"),
            "zero_g_error": interval(error, "V"),
        }
        for name, zero, error, sensitivity in zip(
            "xyz", result.zero_g, result.level_error, result.sensitivity, strict=True
        )
    }
    misalignment = {
        f"{'xyz'[i]}{'xyz'[j]}": measured(float(result.misalignment[i, j]), "rad")
        for i in range(3)
        for j in range(3)
        if i != j
    }
    return {
        **axes,
        "misalignment": misalignment,
        "sensitivity_error": interval(result.sensitivity_error, "1"),
        "zero_g_error": interval(result.zero_g_error, "V"),
        "alignment_error": interval(result.alignment_error, "rad"),
    }


def drift(rig: Rig, result: AccelerometerResult) -> dict[str, object] | None:
    """Return what changed against the calibration in force; None if there is none.

    ``normalised`` is the greatest difference of a sensitivity, a zero or the rotation about an axis
    over the root of the sum of both 95 % intervals' squares (E_n), ``of`` which it is: up to 1 the
    two agree.
    """
    before = rig.calibrations.accelerometer
    if before is None:
        return None
    old = accelerometer_conversion(rig)
    slopes = np.array([e.value for e in result.sensitivity]) / old.sensitivity - 1.0
    zeros = np.array([e.value for e in result.zero_g]) - old.zero_g
    misaligned = before.misalignment.matrix if before.misalignment else np.zeros((3, 3))
    turned = result.rotation - rotation_vector(misaligned)
    # Each has its own table, whose lean the zeros' interval holds (see rotation_error)
    table = NORMAL_95 * before.zero_g_error.standard_uncertainty
    turned_u95 = math.hypot(
        NORMAL_95 * before.alignment_error.standard_uncertainty,
        table / old.sensitivity.min() / STANDARD_GRAVITY,
        result.rotation_error,
    )

    def interval(stated: Tolerance, found: float) -> float:
        return math.hypot(NORMAL_95 * stated.standard_uncertainty, found)

    normalised = {
        "sensitivity": np.abs(slopes).max()
        / interval(before.sensitivity_error, result.sensitivity_error),
        "zero": np.abs(zeros).max() / interval(before.zero_g_error, result.zero_g_error),
        "alignment": np.abs(turned).max() / turned_u95,
    }
    return {
        "against": before.id,
        "sensitivity_relative": slopes.tolist(),
        "zero_g_V": zeros.tolist(),
        "rotation_rad": turned.tolist(),
        **worst({name: float(difference) for name, difference in normalised.items()}),
    }


def _by_lean(positions: Sequence[Position], fits: Sequence[Fit], gravity: float) -> np.ndarray:
    """Return what a table's lean makes of the volts, V/rad, shape (axes, 2, positions).

    The lean is along the table's x and y, which are those of a fish that lies on it upright.
    """
    attitudes = np.array([rotation(p.roll, p.pitch, 0.0) for p in positions])
    leaning = gravity * attitudes[:, :2, :]  # force in fish axes, (positions, 2, 3)
    slopes = np.array([axis.coefficients[1:] for axis in fits])
    return np.einsum("pdf,af->adp", leaning, slopes)


def _each_alone(volts: np.ndarray) -> np.ndarray:
    """Return volts of the axes, (3, positions), as three cases in which one axis has them."""
    return np.einsum("ab,bp->abp", np.eye(3), volts)


def _scattering(fits: Sequence[Fit], design: np.ndarray, patterns: np.ndarray) -> tuple[Fit, ...]:
    """Return the fits with the scatter of all axes that is left of the residuals' patterns.

    patterns: Volts of all axes, shape (patterns, axes, positions).
    """
    off_the_fit = np.eye(len(design)) - design @ np.linalg.pinv(design)
    residuals = np.concatenate([axis.residuals for axis in fits])
    known = (patterns @ off_the_fit).reshape(len(patterns), -1).T
    # Lean and bend of one axis may look alike: what then tells them apart is no pattern of its own
    found, _, rank, _ = np.linalg.lstsq(known, residuals, rcond=1e-2)
    left = residuals - known @ found
    freedom = sum(axis.freedom for axis in fits) - int(rank)
    scatter = math.sqrt(left @ left / freedom)
    inverse = np.linalg.inv(design.T @ design)
    return tuple(
        replace(axis, covariance=scatter**2 * inverse, scatter=scatter, freedom=freedom)
        for axis in fits
    )


def _alignment_error(fits: Sequence[Fit], slopes: np.ndarray) -> float:
    """Half the 95 % interval of the directions' components by their scatter, the greatest, rad."""
    return max(
        Estimate(0.0, math.sqrt(axis.covariance[i, i]) / slope, float(axis.freedom)).u95
        for axis, slope in zip(fits, slopes.tolist(), strict=True)
        for i in (1, 2, 3)
    )
