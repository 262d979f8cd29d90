# SPDX-License-Identifier: Apache-2.0
"""What the length of its segments costs the twin's heave ratio, in the very run that is reported.

The twin is run again over the measured motion of crank and carriage, with as many segments as it
had and with half of them. Lumped masses are of second order in the length of a segment, so a third
of the difference is left in the finer run (Richardson 1911, Phil. Trans. A 210, 307-357).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from towtank_compare.compare import Comparison, open_comparison
from towtank_compare.harmonic import AnalysisError
from towtank_compare.heave import analyse_window
from towtank_compare.samples import joint_series
from towtank_node.names import CARRIAGE_JOINT, CRANK_JOINT
from towtank_node.topics import MEASURED_JOINTS, TWIN_CABLES
from towtank_sim.model import ModelError
from towtank_sim.offline import simulate_twin

import sim_core as sc
from towtank_bringup.simulated_heave import twin_samples


def twin_discretisation(bag: str | Path, window: tuple[float, float]) -> dict[str, Any] | None:
    """Segments of the twin in a bag, and what their length adds to its heave ratio.

    window: begin and end in s since the epoch. Returns `discretisation`, or None where the bag has
    no twin or the motion that it has gives no ratio.
    """
    opened = open_comparison(bag)
    if TWIN_CABLES.name not in opened.bag.topics:
        return None
    counts = opened.bag.series(TWIN_CABLES.name, ["segment_counts"])["segment_counts"]
    if not len(counts):
        return None
    try:
        return discretisation(opened, window, int(np.sum(counts[0])))
    except (AnalysisError, ModelError, sc.InvalidInput, sc.ConvergenceError):
        return None


def discretisation(
    opened: Comparison, window: tuple[float, float], segments: int
) -> dict[str, Any]:
    """Run the twin over the motion in a bag with so many segments, and with half of them.

    Returns segments, coarse_segments and ratio_error, the estimated heave ratio with `segments`
    less that with an endless number. Raises AnalysisError and sim_core's errors.
    """
    coarse = segments // 2
    fine_ratio, coarse_ratio = (
        _heave_ratio(opened, number, window) for number in (segments, coarse)
    )
    error = (coarse_ratio - fine_ratio) / ((segments / coarse) ** 2 - 1.0)
    return {"segments": segments, "coarse_segments": coarse, "ratio_error": error}


def _heave_ratio(opened: Comparison, segments: int, window: tuple[float, float]) -> float:
    crank, carriage = (
        joint_series(opened.bag, MEASURED_JOINTS.name, joint)
        for joint in (CRANK_JOINT, CARRIAGE_JOINT)
    )
    if not len(crank.stamp_ns) or len(crank.stamp_ns) != len(carriage.stamp_ns):
        raise AnalysisError("the motion of crank and carriage is not in the bag")
    begin_ns = int(crank.stamp_ns[0])
    seconds = (crank.stamp_ns - begin_ns) * 1e-9
    twin = simulate_twin(opened.rig, seconds, crank.values, carriage.values, segments=segments)
    samples = twin_samples(opened.rig, crank, twin, begin_ns)
    return analyse_window(samples, opened.rig, *(round(1000 * t) for t in window)).ratio
