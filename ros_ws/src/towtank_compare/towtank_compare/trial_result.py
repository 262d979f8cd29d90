# SPDX-License-Identifier: Apache-2.0
"""What a trial has shown, as the dictionary that becomes result.json."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from towtank_rig import Rig

from towtank_compare.compare import open_comparison
from towtank_compare.scans import encoder_count, reference_lost_s
from towtank_compare.trial_log import cpu_cores, latency_ms, live_result, overruns


def trial_result(path: str | Path) -> dict[str, Any]:
    """Result of the trial in a bag, over its logged part.

    A heave ratio that cannot be given is null, and `reasons` says why. Raises BagError for a bag
    that cannot be read or in which nothing was logged.
    """
    opened = open_comparison(path)
    window = opened.window(None)
    t0_ms, t1_ms = window.t0_ms, window.t1_ms
    entries = opened.entries(window, opened.analyse(t0_ms, t1_ms))
    del entries["measured"], entries["twin"]  # bare repetitions of heave_ratio
    return {
        "rig": entries.pop("rig"),
        "duration_s": (t1_ms - t0_ms) / 1000,
        **entries,
        "encoder": encoder_count(opened.bag, opened.rig)
        | {"reference_lost_s": reference_lost_s(opened.bag)},
        "latency_ms": latency_ms(opened.bag, t0_ms, t1_ms),
        "overruns": overruns(opened.bag),
        "cpu_cores": cpu_cores(opened.bag),
        "live": live_result(opened.bag, t0_ms, t1_ms),
        "software": opened.bag.metadata.get("towtank", {}),
        "calibrations": calibration_rows(opened.rig),
        "assumptions": assumption_rows(opened.rig),
    }


def calibration_rows(rig: Rig) -> list[dict[str, Any]]:
    """Every sensor that can be calibrated, and what calibration was in force; nulls without one."""
    rows = []
    for sensor in type(rig.calibrations).model_fields:
        calibration = getattr(rig.calibrations, sensor)
        row = {"sensor": sensor, "id": None, "date": None, "due": None, "file": None}
        if calibration is not None:
            row |= {"id": calibration.id, "date": calibration.date.isoformat()}
            row |= {"due": calibration.due and calibration.due.isoformat()}
            row |= {"file": calibration.file}
        rows.append(row)
    return rows


def assumption_rows(rig: Rig) -> list[dict[str, Any]]:
    """Every assumed quantity of the rig with its range and source."""
    return [
        {
            "quantity": name,
            "value": quantity.value,
            "unit": quantity.unit,
            "range": list(quantity.range),
            "source": quantity.source,
        }
        for name, quantity in rig.assumptions().items()
    ]
