# SPDX-License-Identifier: Apache-2.0
"""The course of a trial as its bag tells it: events, overruns, latency, live results."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from towtank_bag.reader import Bag, BagError
from towtank_node.stamps import stamp_ns

from towtank_compare import topics
from towtank_compare.heave import NS_PER_MS

EVENTS = "/trial/events"


@dataclass(frozen=True)
class Event:
    """A mark in the trial; detail: decoded JSON."""

    stamp_ns: int
    name: str
    detail: dict[str, Any]


def events(bag: Bag) -> list[Event]:
    """All events of the trial in their order."""
    found = []
    for _, message in bag.messages(EVENTS) if EVENTS in bag.topics else ():
        detail = json.loads(message.detail) if message.detail else {}
        found.append(Event(stamp_ns(message.header.stamp), message.event, detail))
    return sorted(found, key=lambda event: event.stamp_ns)


def logged_window(bag: Bag) -> tuple[int, int]:
    """From log_start to log_stop, ms since the epoch; where the trial broke off before log_stop,
    to the last measured crank angle. Raises BagError where nothing was logged."""
    marks = {event.name: event.stamp_ns for event in events(bag)}
    if "log_start" not in marks:
        raise BagError(
            f"{bag.directory}: the trial ended before logging began (no log_start on {EVENTS}); "
            f"give a window"
        )
    end_ns = marks.get("log_stop")
    if end_ns is None:
        stamps = bag.series(topics.CRANK, ["position"])["stamp_ns"]
        end_ns = int(stamps.max()) if len(stamps) else marks["log_start"]
    return -(-marks["log_start"] // NS_PER_MS), end_ns // NS_PER_MS


def overruns(bag: Bag) -> dict[str, int]:
    """Overruns by node, from its diagnostics; a node that was started again counts from 0 again."""
    counted: dict[str, int] = {}
    last: dict[str, int] = {}
    for _, message in bag.messages("/diagnostics") if "/diagnostics" in bag.topics else ():
        for status in message.status:
            for pair in status.values:
                if pair.key == "overruns":
                    count, before = int(pair.value), last.get(status.name, 0)
                    more = count - before if count >= before else count
                    counted[status.name] = counted.get(status.name, 0) + more
                    last[status.name] = count
    return dict(sorted(counted.items()))


def restarts(bag: Bag) -> dict[str, int]:
    """How often a node was started again in the trial, by node; without those that never were."""
    counted: dict[str, int] = {}
    for event in events(bag):
        if event.name == "restarted":
            counted[event.detail["node"]] = counted.get(event.detail["node"], 0) + 1
    return counted


def cpu_cores(bag: Bag) -> float | None:
    """Mean number of cores that the trial's processes used while logging, as it was noted."""
    for event in reversed(events(bag)):
        if event.name == "resources":
            return event.detail.get("cpu_cores")
    return None


def latency_ms(bag: Bag, t0_ms: int, t1_ms: int) -> dict[str, Any]:
    """From sampling instant to the topic, ms: publication less stamp of the measured samples.

    Median and 99.9 % point over depths and joint states, and of each topic by itself.
    """
    by_topic = {}
    for topic in (topics.CRANK, topics.MEASURED_FISH, topics.MEASURED_DEPRESSOR):
        stamps = bag.series(topic, [])["stamp_ns"]
        published = bag.raw(topic).publish_time_ns
        inside = (stamps >= t0_ms * NS_PER_MS) & (stamps <= t1_ms * NS_PER_MS)
        by_topic[topic] = (published[inside] - stamps[inside]) * 1e-6
    everything = np.concatenate(list(by_topic.values()))
    entry: dict[str, Any] = _spread(everything)
    entry["by_topic"] = {topic: _spread(values) for topic, values in by_topic.items()}
    return entry


def live_result(bag: Bag, t0_ms: int, t1_ms: int) -> dict[str, Any] | None:
    """The last ratios that the comparison node published for one window within the logged part,
    measured and twin; a source without a result then is null. None where there are no results."""
    published: dict[tuple[int, int], dict[str, float]] = {}
    for source in ("measured", "twin"):
        topic = topics.heave_ratio(source)
        for _, message in bag.messages(topic) if topic in bag.topics else ():
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
