# SPDX-License-Identifier: Apache-2.0
"""From the rows of a procedure, guided or read from a file, to what its record says."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from towtank_rig import Rig
from towtank_rig.calibration_files import SensorName
from towtank_rig.instruments import PressureSensorName
from towtank_uncertainty.combination import Estimate

from towtank_lab import accelerometer_calibration, crank_calibration, pressure_calibration
from towtank_lab.accelerometer_calibration import Position, calibrate_accelerometer
from towtank_lab.crank_calibration import Mark, calibrate_crank
from towtank_lab.pressure_calibration import Immersion, calibrate_pressure

Row = dict[str, float]

PRESSURE_COLUMNS = ("depth_m", "volts")
ACCELEROMETER_COLUMNS = ("roll_deg", "pitch_deg", "volts_x", "volts_y", "volts_z")
CRANK_COLUMNS = ("angle_deg", "counts")
"""Columns that a readings file must have; `height_m` of the crank and others may come on top."""


@dataclass(frozen=True)
class Residuals:
    """What a residual plot shows: x with its label, and by name the residuals with their unit."""

    x: np.ndarray
    x_label: str
    curves: dict[str, np.ndarray]
    unit: str


@dataclass(frozen=True)
class Finding:
    """A line of the result: what, its value and half its 95 % interval, the unit."""

    name: str
    value: float
    u95: float | None
    unit: str


@dataclass(frozen=True)
class Evaluation:
    """A calibration, evaluated.

    section: of the rig's calibrations. fit and drift: for the record. findings, residuals and
    notes: for whoever looks.
    """

    sensor: SensorName
    section: dict[str, object]
    fit: dict[str, Any]
    drift: dict[str, object] | None
    findings: tuple[Finding, ...]
    residuals: Residuals
    notes: tuple[str, ...]


def evaluate_pressure(
    rig: Rig,
    sensor: PressureSensorName,
    rows: Sequence[Row],
    *,
    tape_limit: float,
    zero_limit: float,
) -> Evaluation:
    """Evaluate immersions; see towtank_lab.pressure_calibration."""
    immersions = [Immersion(row["depth_m"], row["volts"]) for row in rows]
    result = calibrate_pressure(
        rig, sensor, immersions, tape_limit=tape_limit, zero_limit=zero_limit
    )
    errors = getattr(rig.sensors, sensor).errors
    drift = pressure_calibration.drift(rig, sensor, result)
    full_scale = getattr(rig.sensors, sensor).full_scale.value
    in_pascal = full_scale / result.span.value
    notes = _drift_notes(drift)
    if result.hysteresis is None:
        notes.append("no depth was read both going down and coming up: hysteresis is not known")
    elif result.hysteresis > errors.hysteresis.value:
        notes.append(
            f"hysteresis of {100 * result.hysteresis:.2g} % of full scale is more than the "
            f"sensor's limit of {100 * errors.hysteresis.value:.2g} %: look for "
            "air in the port, check the depths"
        )
    if result.bend_is_real and result.bend > errors.linearity.value:
        notes.append(
            f"the line bends by {100 * result.bend:.2g} % of full scale, the sensor's limit is "
            f"{100 * errors.linearity.value:.2g} %: check the depths"
        )
    findings = [
        _finding("span", result.span, "V"),
        Finding("span, relative error", result.span_error, None, "1"),
        _finding("offset", result.offset, "V"),
        Finding("scatter about the line", result.fit.scatter * in_pascal, None, "Pa"),
        Finding("bend", result.bend, None, "of full scale"),
    ]
    if result.hysteresis is not None:
        findings.append(Finding("hysteresis", result.hysteresis, None, "of full scale"))
    return Evaluation(
        sensor,
        pressure_calibration.section(result, len(rows)),
        {
            "model": "volts at reference excitation = c0 + c1 pressure/full_scale",
            **result.fit.as_json(),
            "hysteresis": result.hysteresis,
            "bend": result.bend,
            "bend_is_real": result.bend_is_real,
            "tape_limit": tape_limit,
            "zero_limit_m": zero_limit,
        },
        drift,
        tuple(findings),
        Residuals(
            np.array([row["depth_m"] for row in rows]),
            "depth, m",
            _both_ways(rows, result.fit.residuals * in_pascal),
            "Pa",
        ),
        tuple(notes),
    )


def _both_ways(rows: Sequence[Row], residuals: np.ndarray) -> dict[str, np.ndarray]:
    """The residuals going down and coming up, joined at the deepest; NaN elsewhere."""
    deepest = int(np.argmax([row["depth_m"] for row in rows]))
    order = np.arange(len(rows))
    return {
        "going down": np.where(order <= deepest, residuals, np.nan),
        "coming up": np.where(order >= deepest, residuals, np.nan),
    }


def evaluate_accelerometer(rig: Rig, rows: Sequence[Row], *, level_limit: float) -> Evaluation:
    """Evaluate positions; level_limit in rad; see towtank_lab.accelerometer_calibration."""
    positions = [
        Position(
            math.radians(row["roll_deg"]),
            math.radians(row["pitch_deg"]),
            (row["volts_x"], row["volts_y"], row["volts_z"]),
        )
        for row in rows
    ]
    result = calibrate_accelerometer(rig, positions, level_limit=level_limit)
    drift = accelerometer_calibration.drift(rig, result)
    findings = []
    for axis, zero, slope in zip("xyz", result.zero_g, result.sensitivity, strict=True):
        findings.append(_finding(f"{axis}: zero", zero, "V"))
        findings.append(_finding(f"{axis}: sensitivity", slope, "V/(m/s²)"))
    for axis, angle in zip("xyz", result.rotation, strict=True):
        findings.append(
            Finding(f"rotated about {axis}", float(angle), result.rotation_error, "rad")
        )
    findings.append(
        Finding("greatest coupling of two axes", float(np.abs(result.coupling).max()), None, "1")
    )
    return Evaluation(
        "accelerometer",
        accelerometer_calibration.section(result, len(rows)),
        {
            "model": "volts of each axis = c0 + c1 fx + c2 fy + c3 fz, forces in fish axes",
            **{axis: fit.as_json() for axis, fit in zip("xyz", result.fits, strict=True)},
            "misalignment": result.misalignment.tolist(),
            "level_limit_rad": level_limit,
        },
        drift,
        tuple(findings),
        Residuals(
            np.arange(1.0, len(rows) + 1.0),
            "position",
            {
                axis: 1e3 * fit.residuals / slope.value
                for axis, fit, slope in zip("xyz", result.fits, result.sensitivity, strict=True)
            },
            "mm/s²",
        ),
        tuple(_drift_notes(drift)),
    )


def evaluate_crank(rig: Rig, rows: Sequence[Row], *, mark_limit: float) -> Evaluation:
    """Evaluate marks; mark_limit in rad; see towtank_lab.crank_calibration."""
    marks = [
        Mark(math.radians(row["angle_deg"]), round(row["counts"]), row.get("height_m"))
        for row in rows
    ]
    result = calibrate_crank(rig, marks, mark_limit=mark_limit)
    drift = crank_calibration.drift(rig, result)
    findings = [
        _finding("counts per turn", result.counts_per_turn, "1"),
        Finding("taken as", float(result.counts_per_revolution), None, "1"),
        Finding("direction", float(result.direction), None, "1"),
    ]
    if result.zero_angle is not None and result.radius is not None:
        findings.append(_finding("angle at mark 0", result.zero_angle, "rad"))
        findings.append(_finding("crank radius", result.radius, "m"))
    notes = _drift_notes(drift)
    if drift["direction_changed"]:
        notes.append(f"the encoder counts the other way than {drift['against']} says")
    off = abs(abs(result.counts_per_turn.value) - result.counts_per_revolution)
    if off > result.counts_per_turn.u95:
        notes.append(
            f"{result.counts_per_turn.value:.2f} counts per turn are no whole number within their "
            "interval: the encoder loses counts, or its belt slips"
        )
    per_turn = abs(result.counts_per_turn.value)
    return Evaluation(
        "crank",
        crank_calibration.section(result, mark_limit),
        {
            "model": "counts = c0 + c1 turns",
            **result.fit.as_json(),
            "mark_limit_rad": mark_limit,
        },
        drift,
        tuple(findings),
        Residuals(
            np.array([row["angle_deg"] for row in rows]),
            "angle of the disc, degrees",
            {"crank": 360.0 * result.fit.residuals / per_turn},
            "degrees",
        ),
        tuple(notes),
    )


def _finding(name: str, estimate: Estimate, unit: str) -> Finding:
    return Finding(name, estimate.value, estimate.u95, unit)


def _drift_notes(drift: dict[str, Any] | None) -> list[str]:
    if drift is None or drift["normalised"] <= 1.0:
        return []
    return [
        f"against {drift['against']}: {drift['of']} differs by {drift['normalised']:.1f} times "
        "what both intervals allow: find out why before a trial rests on it"
    ]
