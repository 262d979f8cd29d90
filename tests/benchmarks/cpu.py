# SPDX-License-Identifier: Apache-2.0
"""What acquisition costs: `towtank bench cpu`.

The virtual board streams in real time to the nodes of a trial, all but the twin; recorder and
comparison listen to them. The chain is what comes between the serial port and the topics with
engineering units: the board's node and the sensors'. Its processor time, by process, is a fraction
of one core. Let nothing else run: other load spoils caches and adds to it.
"""

from __future__ import annotations

import contextlib
import json
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import click
import psutil
import rclpy
from rich.console import Console
from rich.table import Table
from towtank_bringup.conductor import Conductor, open_conductor
from towtank_bringup.graph import TrialSettings, joined, measurement
from towtank_bringup.processes import ProcessGroup
from towtank_bringup.rigs import rig_path
from towtank_bringup.virtual_station import virtual_station
from towtank_lab.virtual_sensors import VirtualSensors
from towtank_node import names
from towtank_node.stamps import ros_minus_monotonic_ns
from towtank_rig import load_rig

RIG = "nit_calicut_2012"
LIMITS = {100: 0.10, 200: 0.17}
"""Of one core, for the whole chain, by scans per second."""
SETTLING_S = 5.0
CHAIN = "towtank_daq"
"""The package whose nodes are the chain."""


@dataclass(frozen=True)
class Cost:
    """Processor time over time, by process, and what the board's node says of its scans."""

    rate_hz: int
    seconds: float
    chain: dict[str, float]
    listeners: dict[str, float]
    limit: float
    scans_received: int
    scans_lost: int

    @property
    def total(self) -> float:
        return sum(self.chain.values())

    @property
    def good(self) -> bool:
        return self.total < self.limit and not self.scans_lost


def measure(rate_hz: int, seconds: float) -> Cost:
    """The cost of acquisition at a rate."""
    rig_file = rig_path(RIG)
    with (
        tempfile.TemporaryDirectory(prefix="towtank-") as folder,
        virtual_station(load_rig(rig_file), rig_file, 1) as (port, sensors),
        turning(sensors),
    ):
        settings = TrialSettings(rig_file, Path(folder) / "bag", port, rate_hz)
        graph = joined(
            tuple(item for item in measurement(settings) if item.full_name != names.TWIN_NODE),
            ros_minus_monotonic_ns(time.time_ns),
        )
        processes = ProcessGroup(Path(folder) / "logs")
        conductor: Conductor | None = None
        try:
            processes.start(graph, processes.check)
            conductor = open_conductor(graph, processes.check, lambda line: None)
            conductor.bring_up()
            conductor.spin_for(SETTLING_S)
            before, began = cpu_times(processes), time.monotonic()
            received, lost = counted(conductor)
            conductor.spin_for(seconds)
            after, span_s = cpu_times(processes), time.monotonic() - began
            received_then, lost_then = counted(conductor)
            conductor.shut_down()
        finally:
            if conductor is not None:
                conductor.close()
                rclpy.shutdown()
            processes.stop()
    shares = {name: (after[name] - before[name]) / span_s for name in after}
    chain = {item.full_name for item in graph if getattr(item, "package", "") == CHAIN}
    return Cost(
        rate_hz,
        span_s,
        {name: share for name, share in shares.items() if name in chain},
        {name: share for name, share in shares.items() if name not in chain},
        LIMITS[rate_hz],
        received_then - received,
        lost_then - lost,
    )


@contextlib.contextmanager
def turning(sensors: VirtualSensors) -> Iterator[None]:
    """Let the crank turn, half a revolution a second, so that the encoder counts."""
    ending = threading.Event()

    def turn() -> None:
        began = time.monotonic()
        while not ending.wait(0.01):
            sensors.move({"angle_deg": 180.0 * (time.monotonic() - began)})

    thread = threading.Thread(target=turn, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ending.set()
        thread.join()


def cpu_times(processes: ProcessGroup) -> dict[str, float]:
    """Processor time so far of each process, s."""
    times = {name: psutil.Process(pid).cpu_times() for name, pid in processes.pids().items()}
    return {name: spent.user + spent.system for name, spent in times.items()}


def counted(conductor: Conductor) -> tuple[int, int]:
    """Scans received and lost so far, as the board's node tells once a second."""
    received, lost = (
        conductor.reported(key)[names.BOARD_NODE] for key in ("scans_received", "scans_lost")
    )
    return received, lost


def table(cost: Cost) -> Table:
    """A cost for people."""
    shown = Table(title=f"{cost.rate_hz} scans a second, {cost.seconds:.0f} s")
    shown.add_column("process")
    shown.add_column("% of a core", justify="right")
    for name, share in cost.chain.items():
        shown.add_row(name, f"{100 * share:.1f}")
    shown.add_row("the chain", f"{100 * cost.total:.1f}", style="bold")
    shown.add_row("limit", f"{100 * cost.limit:.0f}", end_section=True)
    for name, share in cost.listeners.items():
        shown.add_row(f"(listens: {name})", f"{100 * share:.1f}")
    shown.add_row("scans received", str(cost.scans_received))
    shown.add_row("scans lost", str(cost.scans_lost))
    return shown


@click.command()
@click.option("--seconds", type=click.FloatRange(min=5.0), required=True)
@click.option("--json", "as_json", is_flag=True)
def main(seconds: float, as_json: bool) -> None:
    costs = [measure(rate_hz, seconds) for rate_hz in LIMITS]
    if as_json:
        print(json.dumps([asdict(cost) | {"total": cost.total} for cost in costs]))
    else:
        console = Console(width=None if sys.stdout.isatty() else 100)
        for cost in costs:
            console.print(table(cost))
    if missed := [str(cost.rate_hz) for cost in costs if not cost.good]:
        sys.exit(f"more than the limit, or lost scans, at {', '.join(missed)} Hz")


if __name__ == "__main__":
    main()
