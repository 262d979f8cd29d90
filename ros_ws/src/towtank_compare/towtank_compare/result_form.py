# SPDX-License-Identifier: Apache-2.0
"""Heave results as plain dictionaries for JSON. What is missing is null."""

from __future__ import annotations

import math
from typing import Any

from towtank_compare.heave import HeaveResult


def ratio_entry(result: HeaveResult | None) -> dict[str, Any]:
    """value, u95 (of a measurement), phase_deg: fish less depressor."""
    if result is None:
        return {"value": None, "phase_deg": None}
    entry: dict[str, Any] = {"value": result.ratio}
    if result.ratio_uncertainty is not None:
        entry["u95"] = result.ratio_uncertainty.u95
        entry["standard_uncertainty"] = {
            "type_a": result.ratio_uncertainty.type_a,
            "type_b": result.ratio_uncertainty.type_b,
        }
    entry["phase_deg"] = result.phase_deg
    if result.phase_uncertainty is not None:
        entry["phase_u95_deg"] = math.degrees(result.phase_uncertainty.u95)
    entry["peak_to_peak"] = result.peak_to_peak.ratio
    return entry


def amplitude_entry(results: dict[str, HeaveResult | None], body: str) -> dict[str, Any]:
    """measured, u95, twin (and plant) amplitudes of one body, m."""
    measured = results.get("measured")
    entry: dict[str, Any] = {"measured": None, "u95": None, "twin": None}
    if measured is not None:
        motion = getattr(measured, body)
        entry["measured"] = motion.amplitude
        entry["u95"] = motion.uncertainty.u95
        entry["peak_to_peak_measured"] = getattr(measured.peak_to_peak, body)
    for source in ("twin", "plant"):
        result = results.get(source)
        if result is not None:
            entry[source] = getattr(result, body).amplitude
    return entry


def window_entry(t0_ms: int, t1_ms: int) -> list[float]:
    """A window in s since the epoch; `round(1000 * t)` gives the milliseconds back."""
    return [t0_ms / 1000, t1_ms / 1000]


def analysis_entry(result: HeaveResult) -> dict[str, Any]:
    """How the result came about: what was used, and how well the model fits."""
    return {
        "crank_periods": result.periods,
        "crank_frequency_hz": result.crank_frequency_hz,
        "used_s": [result.used_from_s, result.used_to_s],
        **{
            body: {
                "samples": motion.samples,
                "effective_samples": motion.effective_samples,
                "residual_rms_m": motion.residual_rms,
                "largest_gap_s": motion.largest_gap_s,
                "phase_to_crank_deg": math.degrees(motion.phase),
            }
            for body, motion in (("fish", result.fish), ("depressor", result.depressor))
        },
    }
