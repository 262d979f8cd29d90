# SPDX-License-Identifier: Apache-2.0
"""Heave ratios of a recorded bag: `compare_bag` is what `towtank compare` prints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from towtank_bag.reader import Bag, BagError, open_bag
from towtank_rig import Rig, RigError, parse_rig

from towtank_compare.harmonic import AnalysisError
from towtank_compare.heave import HeaveResult, analyse_window
from towtank_compare.places import mid_hull, nose, pressure_port
from towtank_compare.result_form import (
    amplitude_entry,
    analysis_entry,
    ratio_entry,
    window_entry,
)
from towtank_compare.samples import SIMULATED, bag_samples, has_source
from towtank_compare.scans import scan_count, sensor_health
from towtank_compare.trial_log import logged_window, restarts

SOURCES = ("measured", *SIMULATED)


class CompareError(RuntimeError):
    """A bag gives no result; the text names the cause and the mend in one line."""


def compare_bag(path: str | Path, window: Sequence[float] | None = None) -> dict[str, Any]:
    """Heave ratios of a bag over the logged part of its trial, or over one window.

    window: begin and end in s since the epoch, as in `live.window` of a result; milliseconds count.
    Returns rig, window [s, s], measured and twin (the bare ratios, as the comparison node published
    them for this window), heave_ratio, amplitude_m, scans, restarts, fish_place, and reasons for
    what is missing. Raises BagError for a bag that cannot be read and CompareError where nothing
    can be analysed.
    """
    opened = open_comparison(path)
    t0_ms, t1_ms = opened.window(window)
    analyses = opened.analyse(t0_ms, t1_ms)
    if not any(analyses.results.values()):
        reasons = "; ".join(f"{source}: {why}" for source, why in analyses.reasons.items())
        raise CompareError(f"{path}: no heave ratio: {reasons}")
    return opened.entries(t0_ms, t1_ms, analyses)


@dataclass(frozen=True)
class Analyses:
    """Results by source, None where there is none, and then the reason. `along_fish`: amplitude of
    the twin's heave by place on the fish, m."""

    results: dict[str, HeaveResult | None]
    reasons: dict[str, str]
    along_fish: dict[str, float]


@dataclass(frozen=True)
class Comparison:
    """An opened bag and the rig that it was recorded with."""

    bag: Bag
    rig: Rig

    def window(self, window: Sequence[float] | None) -> tuple[int, int]:
        """The wished window, or the logged one, in ms since the epoch."""
        if window is None:
            return logged_window(self.bag)
        t0_ms, t1_ms = (round(1000 * t) for t in window)
        if t1_ms <= t0_ms:
            raise CompareError(f"window {window[0]} to {window[1]}: it must end after it begins")
        return t0_ms, t1_ms

    def analyse(self, t0_ms: int, t1_ms: int) -> Analyses:
        """Every source that the bag holds, over one window."""
        results: dict[str, HeaveResult | None] = {}
        reasons: dict[str, str] = {}
        for source in SOURCES:
            if not has_source(self.bag, source):
                if source != "plant":  # with a real tank there is none
                    results[source], reasons[source] = None, "not in the bag"
                continue
            try:
                results[source] = analyse_window(
                    bag_samples(self.bag, self.rig, source), self.rig, t0_ms, t1_ms
                )
            except AnalysisError as error:
                results[source], reasons[source] = None, str(error)
        along_fish = {}
        if results.get("twin") is not None:
            for place in (nose(self.rig), pressure_port(self.rig), mid_hull(self.rig)):
                samples = bag_samples(self.bag, self.rig, "twin", place)
                result = analyse_window(samples, self.rig, t0_ms, t1_ms)
                along_fish[place.name] = result.fish.amplitude
        return Analyses(results, reasons, along_fish)

    def entries(self, t0_ms: int, t1_ms: int, analyses: Analyses) -> dict[str, Any]:
        """The part of a result that both the trial's result and a comparison have."""
        results = analyses.results
        place = pressure_port(self.rig)
        return {
            "rig": self.rig.name,
            "window": window_entry(t0_ms, t1_ms),
            "measured": results["measured"].ratio if results["measured"] else None,
            "twin": results["twin"].ratio if results["twin"] else None,
            "heave_ratio": {source: ratio_entry(result) for source, result in results.items()},
            "amplitude_m": {body: amplitude_entry(results, body) for body in ("fish", "depressor")},
            "fish_place": {
                "name": place.name,
                "position_m": list(place.position),
                "twin_amplitude_m": analyses.along_fish,
            },
            "scans": scan_count(self.bag, t0_ms, t1_ms),
            "restarts": restarts(self.bag),
            "sensor_health": sensor_health(self.bag, t0_ms, t1_ms),
            "analysis": {
                source: analysis_entry(result)
                for source, result in results.items()
                if result is not None
            },
            "reasons": analyses.reasons,
            "bag_problem": self.bag.problem,
        }


def open_comparison(path: str | Path) -> Comparison:
    """Open a bag with the rig in it; raises BagError."""
    bag = open_bag(path)
    try:
        rig = parse_rig(bag.rig_text, f"{path}: rig.yaml")
    except RigError as error:
        raise BagError(f"the rig file inside the bag is not understood: {error}") from error
    return Comparison(bag, rig)
