# SPDX-License-Identifier: Apache-2.0
"""What it costs to force a bag to the disk while it is recorded: `towtank bench disk`.

Messages of a whole trial's size and number are recorded, with the forcing and without. The last
column of each run is what a power cut at the worst moment would have lost, by the times at which
the disk had taken what.
"""

from __future__ import annotations

import json
import os
import tempfile
import time
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from unittest.mock import patch

import click
from rich.console import Console
from rich.table import Table
from towtank_bag.recorder import POLL_PERIOD_S
from towtank_bag.writer import BagWriter, RawMessage
from towtank_node.qos import SENSOR
from towtank_node.topics import Topic

MESSAGES_PER_S = 1400
MESSAGE_BYTES = 150
TOPIC = Topic("/any", "std_msgs/msg/String", SENSOR)


@dataclass(frozen=True)
class Cost:
    """Of one run: processor time as a fraction of a core, bytes of the file and bytes given to the
    disk, times that it was forced and how long that took, s, and the longest loss, s."""

    forced: bool
    cpu: float
    file_bytes: int
    disk_bytes: int
    forcings: int
    median_s: float
    longest_s: float
    loss_s: float | None


def measure(folder: Path, seconds: float, forced: bool) -> Cost:
    """Record for so long into a new bag in `folder`."""
    takes: list[tuple[float, float]] = []  # begin and end of each forcing
    sync = os.fdatasync

    def timed(descriptor: int) -> None:
        begin = time.monotonic()
        if forced:
            sync(descriptor)
        takes.append((begin, time.monotonic()))

    with patch.object(os, "fdatasync", timed):
        before, busy = _written_bytes(), time.process_time()
        bag = BagWriter(folder / f"bag_{forced}", [TOPIC])
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            now = time.time_ns()
            count = round(MESSAGES_PER_S * POLL_PERIOD_S)
            bag.write([RawMessage(0, now, now, _text()) for _ in range(count)])
            time.sleep(POLL_PERIOD_S)
        bag.close()
    durations = sorted(end - begin for begin, end in takes)
    # Handed over right after one forcing began, it is safe when the next one has ended; the
    # recorder may have had it for a poll by then.
    waits = [later[1] - earlier[0] for earlier, later in pairwise(takes)]
    return Cost(
        forced,
        (time.process_time() - busy) / seconds,
        (folder / f"bag_{forced}" / f"bag_{forced}_0.mcap").stat().st_size,
        _written_bytes() - before,
        len(takes) if forced else 0,
        durations[len(durations) // 2] if forced else 0.0,
        durations[-1] if forced else 0.0,
        max(waits) + POLL_PERIOD_S if forced else None,
    )


def _text() -> bytes:
    """A std_msgs/String that compresses to half, about as a trial's messages do."""
    text = os.urandom(MESSAGE_BYTES // 2).hex().encode()
    return b"\0\1\0\0" + (len(text) + 1).to_bytes(4, "little") + text + b"\0"


def _written_bytes() -> int:
    """What this process has caused to be written to disks so far."""
    lines = Path("/proc/self/io").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("write_bytes"))


@click.command()
@click.option("--seconds", type=float, default=20.0)
@click.option("--folder", type=click.Path(path_type=Path), default=Path("."))
@click.option("--json", "as_json", is_flag=True)
def main(seconds: float, folder: Path, as_json: bool) -> None:
    """Measure both ways, one after the other, in a folder on the disk that is meant."""
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        costs = [measure(Path(scratch), seconds, forced) for forced in (False, True)]
    if as_json:
        click.echo(json.dumps([asdict(cost) for cost in costs], indent=2))
        return
    table = Table(title=f"{MESSAGES_PER_S} messages a second for {seconds:g} s")
    for heading in ("forced", "core", "file, kB", "to disk, kB", "forcings", "median, ms"):
        table.add_column(heading, justify="right")
    table.add_column("longest, ms", justify="right")
    table.add_column("power cut loses, s", justify="right")
    for cost in costs:
        table.add_row(
            "yes" if cost.forced else "no",
            f"{100 * cost.cpu:.1f} %",
            f"{cost.file_bytes / 1000:.0f}",
            f"{cost.disk_bytes / 1000:.0f}",
            f"{cost.forcings}",
            f"{1e3 * cost.median_s:.1f}",
            f"{1e3 * cost.longest_s:.1f}",
            "all" if cost.loss_s is None else f"{cost.loss_s:.2f}",
        )
    Console().print(table)


if __name__ == "__main__":
    main()
