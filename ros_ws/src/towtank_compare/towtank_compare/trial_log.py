# SPDX-License-Identifier: Apache-2.0
"""The course of a trial as its bag tells it: events, overruns, latency, live results."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from towtank_bag.reader import Bag, BagError, LostStretch
from towtank_node import topics
from towtank_node.names import MEASURED, TWIN
from towtank_node.stamps import stamp_ns

from towtank_compare.heave import NS_PER_MS


@dataclass(frozen=True)
class Event:
    """A mark in the trial; detail: decoded JSON, or the text itself as `text` where it is none."""

    stamp_ns: int
    name: str
    detail: dict[str, Any]


@dataclass(frozen=True)
class LoggedWindow:
    """The logged part of a trial, ms since the epoch. note: why it is not the whole, or None."""

    t0_ms: int
    t1_ms: int
    note: str | None


def events(bag: Bag) -> list[Event]:
    """All events of the trial in their order."""
    found = [
        Event(stamp_ns(message.header.stamp), message.event, _detail(message.detail))
        for _, message in bag.messages(topics.EVENTS.name)
    ]
    return sorted(found, key=lambda event: event.stamp_ns)


def _detail(text: str) -> dict[str, Any]:
    """Other programs and people may note what they like."""
    try:
        detail = json.loads(text) if text else {}
    except (ValueError, RecursionError):
        detail = None
    return detail if isinstance(detail, dict) else {"text": text}


def logged_window(bag: Bag) -> LoggedWindow:
    """From the last log_start to the log_stop behind it; where the trial broke off before that, to
    the last measured crank angle.

    A mark that is lost with a damaged part of the bag was in that part: the window then ends where
    the first such part behind log_start begins, or begins where the last one before log_stop ends.
    Raises BagError where nothing was logged, or the marks are both lost.
    """
    marks = events(bag)
    starts, stops = (
        [event.stamp_ns for event in marks if event.name == name]
        for name in ("log_start", "log_stop")
    )
    begin_ns = max(starts, default=None)
    end_ns = max((s for s in stops if begin_ns is None or s > begin_ns), default=None)
    note = None
    if len(starts) > 1:
        note = f"the bag holds {len(starts)} logs: the last is evaluated, --window chooses another"
    if begin_ns is None and end_ns is not None:
        begin_ns = max((s.to_ns for s in bag.lost if _is_before(s.to_ns, end_ns)), default=None)
        note = "log_start is lost: the window begins behind the damaged part before log_stop"
    if begin_ns is None:
        raise BagError(_why_no_window(bag, "log_start"))
    if end_ns is None:
        end_ns, lost = _last_logged(bag, begin_ns)
        note = lost or note
    return LoggedWindow(-(-begin_ns // NS_PER_MS), end_ns // NS_PER_MS, note)


def _is_before(ns: int | None, end_ns: int) -> bool:
    return ns is not None and ns < end_ns


def _last_logged(bag: Bag, begin_ns: int) -> tuple[int, str | None]:
    """The last crank angle before the first loss behind log_start, and what to say of that."""
    crank = bag.series(topics.MEASURED_JOINTS.name, [])
    stamps, log_times = crank["stamp_ns"], crank["log_time_ns"]
    begins = [_begin_of(stretch, log_times) for stretch in bag.lost]
    losses = [begin for begin in begins if begin is not None and begin >= begin_ns]
    note = None
    if LostStretch(None, None) in bag.lost:
        note = (
            "log_stop is lost, and nothing tells when: the window ends at the last crank angle, "
            "--window chooses another"
        )
    if losses and (log_times > min(losses)).any():
        stamps = stamps[log_times <= min(losses)]
        note = (
            "log_stop is lost: the window ends where the first damaged part behind log_start begins"
        )
    return (int(stamps.max()) if len(stamps) else begin_ns), note


def _begin_of(stretch: LostStretch, log_times: np.ndarray) -> int | None:
    """The log time before a loss, by the crank's angles where the loss begins one of the bag's
    files; None where nothing tells."""
    if stretch.from_ns is not None or stretch.to_ns is None:
        return stretch.from_ns
    return int(log_times[log_times < stretch.to_ns].max(initial=0))


def _why_no_window(bag: Bag, mark: str) -> str:
    """The cause and the mend, where the marks do not tell what was logged."""
    if not bag.lost:
        return (
            f"{bag.directory}: the trial ended before logging began (no {mark} on "
            f"{topics.EVENTS.name}); give a window with --window"
        )
    lost = f"{bag.problem}; there is no {mark} on {topics.EVENTS.name} in what is left"
    stamps = bag.series(topics.MEASURED_JOINTS.name, [])["stamp_ns"]
    if not len(stamps):
        return f"{lost}, and no crank angle: record the trial again"
    within = f"{stamps.min() * 1e-9:.3f} to {stamps.max() * 1e-9:.3f}"
    return f"{lost}: give a window within {within} with --window"


def overruns(bag: Bag) -> dict[str, int]:
    """Overruns by node, from its diagnostics; a node that was started again counts from 0 again."""
    counted: dict[str, int] = {}
    last: dict[str, int] = {}
    for _, message in bag.messages(topics.DIAGNOSTICS.name):
        for status in message.status:
            for pair in status.values:
                # Others write what they like; Python refuses numbers of very many digits
                if pair.key == "overruns" and pair.value.isdecimal() and len(pair.value) < 20:
                    count, before = int(pair.value), last.get(status.name, 0)
                    more = count - before if count >= before else count
                    counted[status.name] = counted.get(status.name, 0) + more
                    last[status.name] = count
    return dict(sorted(counted.items()))


def restarts(bag: Bag) -> dict[str, int]:
    """How often a node was started again in the trial, by node; without those that never were."""
    counted: dict[str, int] = {}
    for event in events(bag):
        if event.name == "restarted" and isinstance(node := event.detail.get("node"), str):
            counted[node] = counted.get(node, 0) + 1
    return counted


def strangers(bag: Bag) -> list[dict[str, str]]:
    """Other programs that published the trial's topics meanwhile: `node` and `topic` of each. What
    they sent was left out."""
    return [
        {"node": str(event.detail.get("node")), "topic": str(event.detail.get("topic"))}
        for event in events(bag)
        if event.name == "stranger"
    ]


def cpu_cores(bag: Bag) -> float | None:
    """Mean number of cores that the trial's processes used while logging, as it was noted."""
    for event in reversed(events(bag)):
        cores = event.detail.get("cpu_cores")
        if event.name == "resources" and isinstance(cores, float) and math.isfinite(cores):
            return cores
    return None


def latency_ms(bag: Bag, t0_ms: int, t1_ms: int) -> dict[str, Any]:
    """From sampling instant to the topic, ms: publication less stamp of the measured samples.

    Median and 99.9 % point over depths and joint states, and of each topic by itself.
    """
    by_topic = {}
    for topic in (topics.MEASURED_JOINTS, *topics.DEPTHS.values()):
        stamps = bag.series(topic.name, [])["stamp_ns"]
        published = bag.raw(topic.name).publish_time_ns
        inside = (stamps >= t0_ms * NS_PER_MS) & (stamps <= t1_ms * NS_PER_MS)
        by_topic[topic.name] = (published[inside] - stamps[inside]) * 1e-6
    everything = np.concatenate(list(by_topic.values()))
    entry: dict[str, Any] = _spread(everything)
    entry["by_topic"] = {topic: _spread(values) for topic, values in by_topic.items()}
    return entry


def live_result(bag: Bag, t0_ms: int, t1_ms: int) -> dict[str, Any] | None:
    """The last ratios that the comparison node published for one window within the logged part,
    measured and twin; a source without a result then is null. None where there are no results."""
    published: dict[tuple[int, int], dict[str, float]] = {}
    for source in (MEASURED, TWIN):
        for _, message in bag.messages(topics.HEAVE_RATIO.within(source).name):
            window = tuple(
                stamp_ns(stamp) // NS_PER_MS for stamp in (message.window_start, message.window_end)
            )
            if message.valid and t0_ms <= window[0] and window[1] <= t1_ms:
                published.setdefault(window, {})[source] = message.value
    if not published:
        return None
    window = max(published, key=lambda w: (len(published[w]), w[1]))
    return {
        "window": [window[0] / 1000, window[1] / 1000],
        "measured": published[window].get("measured"),
        "twin": published[window].get("twin"),
    }


def _spread(values: np.ndarray) -> dict[str, float | None]:
    if not len(values):
        return {"median": None, "p999": None}
    median, p999 = np.quantile(values, [0.5, 0.999])
    return {"median": float(median), "p999": float(p999)}
