# SPDX-License-Identifier: Apache-2.0
"""Hours of board time without the clock: `towtank bench soak`.

The real firmware in the virtual board, the real driver on its line. The bench holds the voltages
and swings both shafts to and fro across the end of their 32-bit counts, so that the truth of every
scan is known. Nothing is kept but the account: each scan is judged as it comes.
"""

from __future__ import annotations

import json
import math
import struct
import sys
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.table import Table
from towtank_daq.board import AdcBoard, Scan, Transport
from towtank_daq.configuration import configuration_at
from towtank_daq.description import BoardDescription, installed_description, load_description
from towtank_daq.protocol import Protocol, troubles
from towtank_daq.protocol_records import HealthFrame

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "firmware" / "vboard"))

from vboard import BenchFrame, VirtualBoard  # noqa: E402

ELF = ROOT / "build" / "firmware" / "towtank_board.elf"

SECOND = 1_000_000_000
VOLTS = (0.016, 0.020, 1.60, 1.70, 2.31, 10.0)  # at the terminals
COUNTS = 4096  # per revolution
START = (2**31 - 1000, -(2**31) + 700)  # what the counters of crank and carriage begin with
AMPLITUDE = (3000, 2000)  # counts to either side: both swing across the end
QUARTER_S = (2, 3)  # of a swing: 1500 and 667 edges a second
LARGEST_SIGMA = 7.0  # one code in 4e11 lies farther off
STAMP_S = 1e-3  # the clock's error and a look at the line each 0.5 ms
WRAPS_TO_REACH = 3
_QUANTUM_NS = 500_000
_REST_S = 3  # at the end, for a last count that nothing is to be allowed for


@dataclass(frozen=True)
class Wraps:
    """How often a counter or timer passed its end."""

    counter: str
    bits: int
    wraps: int


@dataclass
class Account:
    """What became of every scan; all that is not in order is counted."""

    board_s: float = 0.0
    rate_hz: int = 0
    scheduled: int = 0
    """Ticks, as the board tells at the stop."""
    received: int = 0
    lost: int = 0
    bad: int = 0
    """With a channel not valid."""
    flagged: int = 0
    out_of_step: int = 0
    """Not one number and one period after the scan before."""
    wrong_codes: int = 0
    """Codes more than 7 standard deviations off the bench's voltage."""
    wrong_counts: int = 0
    """Encoder counts that are not those of the scan's instant."""
    last_count_errors: tuple[int, int] = (0, 0)
    """Of crank and carriage against the edges that the virtual board put on the pins."""
    bad_frames: int = 0
    sync_failures: int = 0
    restarts: int = 0
    troubles: dict[str, int] = field(default_factory=dict)
    """The board's own counters of what went wrong."""
    largest_sigma: float = 0.0
    wraps: list[Wraps] = field(default_factory=list)
    cpu_s: float = 0.0

    @property
    def complete(self) -> bool:
        """Whether every scan that the board scheduled is there and is right."""
        out_of_order = (
            self.lost,
            self.bad,
            self.flagged,
            self.out_of_step,
            self.wrong_codes,
            self.wrong_counts,
            *self.last_count_errors,
            self.bad_frames,
            self.sync_failures,
            self.restarts,
            *self.troubles.values(),
        )
        return self.received == self.scheduled > 0 and not any(out_of_order)


def swing(axis: int, seconds: float) -> float:
    """Counts of a triangular swing since time 0; its corners lie on whole seconds."""
    quarter = QUARTER_S[axis]
    phase = seconds / quarter % 4.0
    height = phase if phase <= 1.0 else 2.0 - phase if phase <= 3.0 else phase - 4.0
    return AMPLITUDE[axis] * height


class SwingingBench(Transport):
    """Transport and clock on a virtual board whose shafts swing; reading lets its time pass."""

    def __init__(self, board: Any, moving_s: int) -> None:
        self._board = board
        self._moving_s = moving_s
        self._fed_s = 0
        self.requests = 0

    def monotonic_ns(self) -> int:
        return int(self._board.now_ns)

    def write(self, data: bytes) -> None:
        self.requests += 1
        self._board.write(data)

    def read(self, timeout_s: float) -> bytes:
        end_ns = self._board.now_ns + round(1e9 * timeout_s)
        while True:
            data = bytes(self._board.read())
            if data or self._board.now_ns >= end_ns:
                return data
            self._feed()
            self._board.run_until(min(end_ns, self._board.now_ns + _QUANTUM_NS))

    def counts(self, axis: int, at_s: float) -> float:
        """Where a shaft is, in counts from where it began."""
        return swing(axis, min(max(at_s - 1.0, 0.0), self._moving_s))

    def _feed(self) -> None:
        """A frame a second, for lines join them: half a second ahead."""
        while self._fed_s * SECOND < self._board.now_ns + SECOND // 2:
            self._fed_s += 1
            angles = [2 * math.pi * self.counts(axis, self._fed_s) / COUNTS for axis in (0, 1)]
            # A hair more, so that the floor of a corner's count does not hang on the last bit
            self._board.push_bench(
                BenchFrame(self._fed_s * SECOND, VOLTS, angles[0] + 1e-7, angles[1] + 1e-7)
            )


class Judge:
    """Holds each scan against the truth as it comes."""

    def __init__(self, account: Account, bench: SwingingBench, board: BoardDescription) -> None:
        self._account = account
        self._bench = bench
        channels = [board.adc_channel(name, VOLTS[-1]) for name in board.channel_names]
        self._volts = [channel.volts for channel in channels]
        self._sigma = [c.noise_volts / c.gain for c in board.channels]
        self._slack = [1.5 + STAMP_S * AMPLITUDE[axis] / QUARTER_S[axis] for axis in (0, 1)]
        self._ends = [0, 0]
        self.last: Scan | None = None
        self._first_ticks = 0
        self.period_ticks = 0

    def __call__(self, scan: Scan) -> None:
        account, last = self._account, self.last
        account.flagged += scan.flags != 0
        if last is None:
            account.out_of_step += scan.sequence != 0
            self._first_ticks = scan.ticks
        else:
            account.out_of_step += (
                scan.sequence != last.sequence + 1 or scan.ticks != last.ticks + self.period_ticks
            )
            for axis, before, now in (
                (0, last.crank, scan.crank),
                (1, last.carriage, scan.carriage),
            ):
                self._ends[axis] += (before + 2**31) >> 32 != (now + 2**31) >> 32
        self.last = scan
        self._judge_codes(scan)
        at_s = scan.stamp_ns / SECOND
        for axis, count in ((0, scan.crank), (1, scan.carriage)):
            off = count - START[axis] - self._bench.counts(axis, at_s)
            account.wrong_counts += abs(off) > self._slack[axis]

    def _judge_codes(self, scan: Scan) -> None:
        account = self._account
        for index, code in enumerate(scan.codes):
            if not scan.valid_mask >> index & 1:
                continue
            off = abs(float(self._volts[index](code)) - VOLTS[index]) / self._sigma[index]
            account.largest_sigma = max(account.largest_sigma, off)
            account.wrong_codes += off > LARGEST_SIGMA

    def wraps(self) -> list[Wraps]:
        """Of what the scans carry."""
        last = self.last
        if last is None:
            return []
        ticks = (last.ticks >> 32) - (self._first_ticks >> 32)
        return [
            Wraps("scan sequence", 16, last.sequence >> 16),
            Wraps("scan ticks, silence and health timers", 32, ticks),
            Wraps("sample timer", 16, (last.ticks >> 16) - (self._first_ticks >> 16)),
            Wraps("crank count", 32, self._ends[0]),
            Wraps("carriage count", 32, self._ends[1]),
        ]


def soak(board_s: int, rate_hz: int = 100, ticks_before_wrap: int | None = None) -> Account:
    """Let the board run and hold every scan against the truth.

    board_s: board time, s. ticks_before_wrap: set the board's 32-bit time this far before its end,
    for a short run; without it the board's time begins at its power-on.
    """
    began = time.process_time()
    account = Account(board_s=board_s, rate_hz=rate_hz)
    description = load_description(installed_description())
    with VirtualBoard(ELF, seed=2012, crank_counts_per_revolution=COUNTS) as board:
        # The shafts rest until second 1, and again for the last seconds
        bench = SwingingBench(board, board_s - 1 - _REST_S)
        judge = Judge(account, bench, description)
        if ticks_before_wrap is not None:
            _set_time(board, 2**32 - ticks_before_wrap)
        board.run_until(50_000_000)
        for name, count in zip(("crank", "carriage"), START, strict=True):
            board.preset(name, struct.pack("<i", count), offset=1)  # struct quadrature
        driver = AdcBoard(bench, Protocol(description), judge, say, bench.monotonic_ns)
        driver.connect()
        configuration = configuration_at(description, rate_hz)
        judge.period_ticks = description.microcontroller.tick_hz // rate_hz
        driver.configure(configuration)
        driver.start()
        while (left_s := board_s - board.now_ns / SECOND) > 0:
            driver.poll(min(left_s, 60.0))
            say(f"{board.now_ns / SECOND:.0f} of {board_s} s")
        driver.stop()
        health = driver.counters()
        _settle(account, driver, health)
        pins = board.counters()
        last = judge.last
        if last is not None:
            account.last_count_errors = (
                last.crank - START[0] - pins["crank_counts"],
                last.carriage - START[1] - pins["carriage_counts"],
            )
        account.wraps = [
            *judge.wraps(),
            Wraps("request id", 8, bench.requests >> 8),
            Wraps("receive buffer", 8, pins["bytes_from_host"] >> 8),
            Wraps("transmit buffer", 8, pins["bytes_to_host"] >> 8),
        ]
    account.cpu_s = time.process_time() - began
    return account


def _set_time(board: Any, ticks: int) -> None:
    """Sets the board's clock while its start waits for the ADC: nothing has looked at it yet."""
    board.run_until(5_000_000)
    board.preset("overflows", struct.pack("<I", ticks >> 16))


def _settle(account: Account, driver: AdcBoard, health: HealthFrame) -> None:
    counted = driver.statistics
    account.scheduled = health.scans_scheduled
    account.received = counted.scans_received
    account.lost = counted.scans_lost
    account.bad = counted.scans_bad
    account.bad_frames = counted.frames.bad + counted.unknown_frames
    account.sync_failures = counted.sync_failures
    account.restarts = counted.restarts
    account.troubles = troubles(health)


def say(line: str) -> None:
    """A line of progress, apart from what is printed at the end."""
    print(f"soak: {line}", file=sys.stderr, flush=True)


def tables(account: Account) -> list[Table]:
    """The account for people."""
    scans = Table(title=f"{account.board_s:.0f} s of board time, {account.rate_hz} Hz")
    scans.add_column("scans and frames")
    scans.add_column("number", justify="right")
    for name, value in asdict(account).items():
        if name == "troubles":
            for trouble, count in value.items():
                scans.add_row(f"board: {trouble.replace('_', ' ')}", str(count))
        elif name not in ("wraps", "board_s", "rate_hz", "cpu_s", "largest_sigma"):
            shown = ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)
            scans.add_row(name.replace("_", " "), shown)
    scans.add_row("largest deviation of a code", f"{account.largest_sigma:.2f} σ")
    scans.add_row("CPU time", f"{account.cpu_s:.0f} s")
    scans.add_row("board time over CPU time", f"{account.board_s / account.cpu_s:.1f}")
    wraps = Table(title="Passed their end")
    for heading in ("counter or timer", "bits", "times"):
        wraps.add_column(heading, justify="left" if heading.startswith("c") else "right")
    for counter in account.wraps:
        wraps.add_row(counter.counter, str(counter.bits), str(counter.wraps))
    return [scans, wraps]


@click.command()
@click.option("--hours", type=click.FloatRange(min=0.005), required=True)
@click.option("--json", "as_json", is_flag=True)
def main(hours: float, as_json: bool) -> None:
    account = soak(round(3600 * hours))
    if as_json:
        print(json.dumps(asdict(account) | {"complete": account.complete}))
    else:
        console = Console(width=None if sys.stdout.isatty() else 100)
        for table in tables(account):
            console.print(table)
    if not account.complete:
        sys.exit("not every scan is there and right: see the account")
    few = [wraps.counter for wraps in account.wraps if wraps.wraps < WRAPS_TO_REACH]
    if few:
        sys.exit(f"fewer than {WRAPS_TO_REACH} times past their end: {', '.join(few)}; run longer")


if __name__ == "__main__":
    main()
