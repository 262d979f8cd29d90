# SPDX-License-Identifier: Apache-2.0
"""Lost and bad scans of the board, its encoder counts against the truth, and what looked wrong with
the sensors."""

from __future__ import annotations

import math

import numpy as np
from towtank_bag.reader import Bag
from towtank_interfaces.msg import TrialEvent
from towtank_node import topics
from towtank_node.health import Health
from towtank_node.names import CARRIAGE_JOINT, CRANK_JOINT
from towtank_node.scan_account import ScanAccount
from towtank_node.topics import PLANT_JOINTS, SCANS
from towtank_rig import Rig
from towtank_rig.conversion import carriage_encoder, crank_encoder

from towtank_compare.heave import NS_PER_MS
from towtank_compare.samples import joint_series
from towtank_compare.trial_log import events

_MARKS = (TrialEvent.STARTED, TrialEvent.LOG_START, TrialEvent.LOG_STOP, TrialEvent.STOPPED)
HEALTH = {
    "fish_pressure": topics.FISH_DEPTH,
    "depressor_pressure": topics.DEPRESSOR_DEPTH,
    "accelerometer": topics.INCLINATION,
}
"""Topics that tell a sensor's health."""


def scan_count(bag: Bag, t0_ms: int, t1_ms: int) -> dict[str, int]:
    """Scans of a window: scheduled by the board, received in the bag, lost, bad.

    Lost are those missing between the first and the last one that came in, as ScanAccount counts
    them, and those missing before and after, as far as the window lies in the trial. A scan is bad
    when a channel that is configured has no valid conversion, or the board raised a flag.
    """
    fields = ["sequence", "board_ticks"]
    scans = bag.series(SCANS.name, [*fields, "valid_mask", "flags"])
    stamps = scans["stamp_ns"]
    inside = (stamps >= t0_ms * NS_PER_MS) & (stamps <= t1_ms * NS_PER_MS)
    account = ScanAccount()
    columns = (scans[name][inside].astype(np.int64).tolist() for name in (*fields, "stamp_ns"))
    for scan in zip(*columns, strict=True):
        account.take(*scan)
    begin_ns, end_ns = _within_the_trial(bag, t0_ms * NS_PER_MS, t1_ms * NS_PER_MS)
    lost = account.lost + _missing_at_the_ends(np.sort(stamps), begin_ns, end_ns)
    incomplete = scans["valid_mask"] != _configured(bag)
    bad = incomplete[inside] | (scans["flags"][inside] != 0)
    return {
        "scheduled": account.received + lost,
        "received": account.received,
        "lost": lost,
        "bad": int(np.count_nonzero(bad)),
    }


def _configured(bag: Bag) -> np.ndarray:
    """Mask of the channels that each scan was to have; of all in a bag that is too old to tell:
    the board was then always configured so."""
    if bag.has_field(SCANS.name, "configured_mask"):
        return bag.series(SCANS.name, ["configured_mask"])["configured_mask"]
    codes = bag.series(SCANS.name, ["codes"])["codes"]
    channels = codes.shape[1] if codes.ndim > 1 else 0  # no scan tells how many there were
    return np.full(len(codes), (1 << channels) - 1)


def _within_the_trial(bag: Bag, begin_ns: int, end_ns: int) -> tuple[int, int]:
    """The part of a window in which scans were due: from the trial's first mark to its last. The
    whole window where parts of the bag are lost, and marks perhaps with them."""
    marks = [event.stamp_ns for event in events(bag) if event.name in _MARKS]
    if bag.lost or not marks:
        return begin_ns, end_ns
    return max(begin_ns, min(marks)), min(end_ns, max(marks))


def _missing_at_the_ends(stamps: np.ndarray, begin_ns: int, end_ns: int) -> int:
    """Scans that fit between a window's ends and the first and the last one in it, and are not
    there. stamps: of all scans, in order, ns."""
    if len(stamps) < 2:
        return 0
    period_ns = float(np.median(np.diff(stamps)))
    if period_ns <= 0:
        return 0
    first, behind = np.searchsorted(stamps, [begin_ns, end_ns + 1])
    if first == behind:
        return max(0, int((end_ns - begin_ns) / period_ns))
    before = stamps[first] - stamps[first - 1] if first else math.inf
    after = stamps[behind] - stamps[behind - 1] if behind < len(stamps) else math.inf
    return sum(
        # As many as the gap leaves room for within the window; none where the next one is there
        int(min(to_the_end, whole_gap - period_ns / 2) / period_ns)
        for to_the_end, whole_gap in (
            (stamps[first] - begin_ns, before),
            (end_ns - stamps[behind - 1], after),
        )
    )


def sensor_health(bag: Bag, t0_ms: int, t1_ms: int) -> dict[str, dict[str, int] | None]:
    """Samples of a window by sensor: `samples`, and how many of them carry each flag.

    Null for a sensor that the bag tells nothing of.
    """
    found: dict[str, dict[str, int] | None] = {}
    for sensor, topic in HEALTH.items():
        if not bag.has_field(topic.name, "health"):
            found[sensor] = None
            continue
        series = bag.series(topic.name, ["health.flags"])
        stamps = series["stamp_ns"]
        inside = (stamps >= t0_ms * NS_PER_MS) & (stamps <= t1_ms * NS_PER_MS)
        flags = series["health.flags"][inside].astype(np.int64)
        found[sensor] = {
            "samples": len(flags),
            **{flag.names[0]: int(np.count_nonzero(flags & flag)) for flag in Health},
        }
    return found


def reference_lost_s(bag: Bag) -> list[float]:
    """Instants, s since the epoch, of the first scans after resets of the board: from each on the
    positions of crank and carriage are not known until they are zeroed. Empty where the bag is too
    old to tell: its counts went on over a reset as if nothing had been missed."""
    if not bag.has_field(SCANS.name, "count_epoch"):
        return []
    scans = bag.series(SCANS.name, ["count_epoch"])
    order = np.argsort(scans["stamp_ns"], kind="stable")
    stamps, epochs = scans["stamp_ns"][order], scans["count_epoch"][order]
    return (stamps[1:][epochs[1:] != epochs[:-1]] * 1e-9).tolist()


def encoder_count(bag: Bag, rig: Rig) -> dict[str, int | None]:
    """Counts of both encoders between the first and the last scan of the bag, as the board counted
    them and as the plant's true angles give them (null without a plant). Null where the board was
    reset in between.

    An encoder has counted the last edge that it passed, so the truth is the difference of the
    rounded-down counts. A whole trial begins and ends at rest, where the comparison is exact; in
    one that broke off, an edge near the last scan may make a difference of one.
    """
    scans = bag.series(SCANS.name, ["crank_count", "carriage_count"])
    order = np.argsort(scans["stamp_ns"], kind="stable")
    entry: dict[str, int | None] = {}
    whole = len(order) and not reference_lost_s(bag)
    for joint, encoder in (
        (CRANK_JOINT, crank_encoder(rig)),
        (CARRIAGE_JOINT, carriage_encoder(rig)),
    ):
        expected, counted = None, None
        if whole:
            ends = order[[0, -1]]
            start, end = scans[f"{joint}_count"][ends].tolist()
            counted = end - start
            truth = joint_series(bag, PLANT_JOINTS.name, joint)
            if len(truth):
                origin_ns = int(truth.stamp_ns[0])
                true_ends = np.interp(
                    (scans["stamp_ns"][ends] - origin_ns) * 1e-9,
                    truth.seconds_since(origin_ns),
                    truth.values,
                )
                start, end = encoder.counts(true_ends).tolist()
                expected = end - start
        entry[f"{joint}_expected"], entry[f"{joint}_counted"] = expected, counted
    return entry
