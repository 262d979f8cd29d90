# SPDX-License-Identifier: Apache-2.0
"""Heave ratios of a recorded bag: `compare_bag` is what `towtank compare` prints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from towtank_bag.layout import RECORDER_METADATA
from towtank_bag.reader import Bag, BagError, open_bag
from towtank_bag.recorded_rig import recorded_rig
from towtank_rig import Rig, RigError, load_rig, parse_rig

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
from towtank_compare.trial_log import LoggedWindow, logged_window, restarts, strangers

SOURCES = ("measured", *SIMULATED)

LAST_INSTANT_S = 2**63 / 1e9 - 1.0
"""Later ones cannot be told in ns as 64 bits."""


class CompareError(RuntimeError):
    """A bag gives no result; the text names the cause and the mend in one line."""


def compare_bag(
    path: str | Path,
    window: Sequence[float] | None = None,
    rig_file: str | Path | None = None,
) -> dict[str, Any]:
    """Heave ratios of a bag over the logged part of its trial, or over one window.

    window: begin and end in s since the epoch, as in `live.window` of a result; milliseconds count.
    rig_file: used instead of the rig in the bag, and told of.
    Returns rig, window [s, s], measured and twin (the bare ratios, as the comparison node published
    them for this window), heave_ratio, amplitude_m, scans, restarts, strangers, fish_place, reasons
    for what is missing, bag_problem (what is damaged in the bag and lost by it, or null) and
    bag_notes (what else must be known of it). Raises BagError for a bag that cannot be read,
    RigError for a rig file that cannot be used, and CompareError where nothing can be analysed.
    """
    opened = open_comparison(path, rig_file)
    chosen = opened.window(window)
    analyses = opened.analyse(chosen.t0_ms, chosen.t1_ms)
    if not any(analyses.results.values()):
        why = [f"{source}: {reason}" for source, reason in analyses.reasons.items()]
        why += [opened.bag.problem] if opened.bag.problem else []
        raise CompareError(f"{path}: no heave ratio: {'; '.join(why)}")
    return opened.entries(chosen, analyses)


@dataclass(frozen=True)
class Analyses:
    """Results by source, None where there is none, and then the reason. `along_fish`: amplitude of
    the twin's heave by place on the fish, m."""

    results: dict[str, HeaveResult | None]
    reasons: dict[str, str]
    along_fish: dict[str, float]


@dataclass(frozen=True)
class Comparison:
    """An opened bag and the rig that it was recorded with. rig_note: what must be known of where
    the rig is from, or None."""

    bag: Bag
    rig: Rig
    rig_note: str | None = None

    def window(self, window: Sequence[float] | None) -> LoggedWindow:
        """The wished window, or the logged one."""
        if window is None:
            return logged_window(self.bag)
        if not all(0 <= t <= LAST_INSTANT_S for t in window):
            raise CompareError(
                f"window {window[0]} to {window[1]}: give two instants in s since the epoch"
            )
        t0_ms, t1_ms = (round(1000 * t) for t in window)
        if t1_ms <= t0_ms:
            raise CompareError(f"window {window[0]} to {window[1]}: it must end after it begins")
        return LoggedWindow(t0_ms, t1_ms, None)

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

    def entries(self, window: LoggedWindow, analyses: Analyses) -> dict[str, Any]:
        """The part of a result that both the trial's result and a comparison have."""
        t0_ms, t1_ms = window.t0_ms, window.t1_ms
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
            "strangers": strangers(self.bag),
            "sensor_health": sensor_health(self.bag, t0_ms, t1_ms),
            "analysis": {
                source: analysis_entry(result)
                for source, result in results.items()
                if result is not None
            },
            "reasons": analyses.reasons,
            "bag_problem": self.bag.problem,
            "bag_notes": [*self.bag.notes, *filter(None, (self.rig_note, window.note))],
        }


def open_comparison(path: str | Path, rig_file: str | Path | None = None) -> Comparison:
    """Open a bag with the rig in it, or with another; raises BagError, and RigError for that."""
    bag = open_bag(path)
    if rig_file is not None:
        rig = load_rig(rig_file)
        recorded_with_it = rig.sha256 == bag.metadata.get(RECORDER_METADATA, {}).get("rig_sha256")
        note = f"the rig is that of {rig_file}, and not shown to be the one of the recording"
        return Comparison(bag, rig, None if recorded_with_it else note)
    recorded = recorded_rig(bag)
    try:
        rig = parse_rig(recorded.text, f"{path}: rig.yaml")
    except RigError as error:
        raise BagError(f"the rig file inside the bag is not understood: {error}") from error
    return Comparison(bag, rig, recorded.note)
