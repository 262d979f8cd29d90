# SPDX-License-Identifier: Apache-2.0
"""A walk through a connected board: who it is, what it finds in itself, and how it streams.

Every finding is a number between limits. The limits come from board.yaml (self-test), from the
rig (noise of its sensors, counts of its encoders) and from what the driver relies on (clock). What
cannot be found out is said: it has neither passed nor failed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from towtank_rig import Rig
from towtank_rig.conversion import carriage_encoder, crank_encoder

from towtank_daq.board import AdcBoard, BoardError, Scan
from towtank_daq.clock import SLOPE_TOLERANCE
from towtank_daq.configuration import configuration_at
from towtank_daq.description import BoardDescription
from towtank_daq.health_limits import accelerometer_limits, pressure_limits
from towtank_daq.identity import StoredIdentity, calibration_mismatch, number_text
from towtank_daq.noise import (
    noise_margin,
    slow_wander,
    wander_margin,
    wander_samples,
    white_noise,
)
from towtank_daq.protocol import troubles
from towtank_daq.self_test import Check

_SLICE_S = 0.01  # as fine as the virtual bench takes a movement
_FEWEST_SCANS = 100  # noise is then known to 18 %
RESIDUAL_S = 0.2e-3  # what stamps shall be good for
ROUND_TRIP_S = (
    5e-3  # of a sync exchange less the bytes' time: a USB adapter of 1 ms and a busy host
)
REST_S = 1.0
"""For so long from the start of the stream both shafts are left alone, s."""
REST_COUNTS = 4  # a line of the encoder's disc: a shaft on an edge may tremble over it
TURN_BY_HAND = 0.05  # of a shaft's turn, to which somebody finds a mark again
_RESET_WITHOUT_BOOTLOADER_S = 0.9  # the watchdog's half a second, and start-up; else 1.4 s
_LONGEST_RESET_S = 2.5
WANDER_S = 4.0  # of streaming at rest, for what is slower than 1 Hz to be seen
_STACK_RESERVE = 256  # bytes; an interrupt that comes in another takes some 40

Passed = Callable[[float], None]
"""Gets the seconds of streaming that have passed."""


@dataclass(frozen=True)
class NotChecked:
    """What has neither passed nor failed, and what it takes to check it."""

    section: str
    name: str
    wanted: str


@dataclass(frozen=True)
class Examination:
    """What was found, by section.

    Attributes:
        facts: What is no matter of limits, by name.
        checks: Findings by section.
        not_checked: What was not looked at.
    """

    facts: dict[str, str]
    checks: dict[str, tuple[Check, ...]]
    not_checked: tuple[NotChecked, ...]

    @property
    def all(self) -> list[Check]:
        """Findings of all sections."""
        return [check for checks in self.checks.values() for check in checks]

    @property
    def failures(self) -> list[Check]:
        """Findings outside their limits."""
        return [check for check in self.all if not check.passed]


def examine(
    board: AdcBoard,
    scans: list[Scan],
    rig: Rig,
    description: BoardDescription,
    *,
    seconds: float,
    turns: float | None,
    travel: float | None,
    passed: Passed,
) -> Examination:
    """Examine a board, which `connect()` need not have found yet; leaves it idle and configured.

    It lets the board reset itself: encoder counts begin anew.

    scans: where the board's `on_scan` puts them. seconds: of streaming, with the sensors at rest.
    turns, travel: by how many, in its running sense, the crank is turned after REST_S, and by how
    many m along the run the carriage is moved; None if it is not.

    Raises BoardError or OSError where there is no board to examine, OSError where its line goes.
    """
    identity = board.connect()
    last_reset = board.counters().reset_cause
    facts = {
        "board": number_text(identity.board_serial),
        "firmware": ".".join(map(str, identity.firmware_version)),
        "schema": f"{identity.schema_hash:08x}",
        "ADC": f"{identity.adc_id:#04x}",
        "calibration id": number_text(identity.calibration_id),
    }
    left: list[NotChecked] = []
    checks = {"identity": tuple(_identity(board.stored_identity(), rig, left))}
    causes = [name for name, bit in description.reset_cause.items() if last_reset & bit]
    facts["last reset"] = ", ".join(causes) or "not told (a bootloader hides it)"
    try:
        reset_s = board.reset()
    except BoardError as error:
        gone = Check("comes back by itself", math.nan, "s", 0.0, _LONGEST_RESET_S, str(error))
        rest = (("self-test", "all"), ("scans", "stream"), *_TAKES_A_STREAM)
        left += [NotChecked(*what, "mend the reset first") for what in rest]
        return Examination(facts, {**checks, "reset": (gone,)}, tuple(left))
    facts["bootloader"] = "yes" if reset_s > _RESET_WITHOUT_BOOTLOADER_S else "none"
    checks["reset"] = (_comes_back(reset_s),)
    board.configure(configuration_at(description, round(rig.board.sample_rate.value)))
    checks["self-test"] = board.self_test().checks
    before = board.counters()
    scans.clear()
    try:
        _stream(board, seconds, passed)
        after = board.counters()
    except BoardError as error:
        checks["scans"] = (Check("stream", 0, "", 1, 1, str(error)),)
        left += [NotChecked(*what, "mend the stream first") for what in _TAKES_A_STREAM]
        return Examination(facts, checks, tuple(left))
    told = [name for name, bit in description.adc_error.items() if after.adc_error_bits & bit]
    if told:
        facts["ADC has told of"] = ", ".join(told).replace("_", " ")
    checks["scans"] = tuple(_scans(board))
    checks["noise"] = tuple(_noise(scans, rig, description))
    wander_wants = (
        "leave crank and carriage at rest"
        if turns is not None or travel is not None
        else f"give --seconds {WANDER_S:g} or more"
        if seconds < WANDER_S
        else ""
    )
    if not wander_wants:
        checks["noise"] += tuple(_wander(scans, rig, description))
    known = troubles(before)
    new = {name: count - known[name] for name, count in troubles(after).items()}
    shafts = _shafts(scans, rig, turns, travel)
    checks["encoders"] = (
        *(check for shaft in shafts for check in shaft.checks()),
        _none("illegal steps of both", new.pop("illegal_steps"), _MENDS["illegal_steps"]),
    )
    checks["clock"] = tuple(_clock(board))
    checks["counters"] = (
        *(_none(name.replace("_", " "), count, _MENDS[name]) for name, count in new.items()),
        Check(
            "stack never used",
            after.stack_low_water,
            "bytes",
            _STACK_RESERVE,
            math.inf,
            "the firmware needs more memory than it has: report it",
        ),
    )
    left += [NotChecked("encoders", s.name, s.wanted) for s in shafts if s.given is None]
    if wander_wants:
        left.append(NotChecked("noise", "slow wander", wander_wants))
    return Examination(facts, checks, tuple(left))


def _stream(board: AdcBoard, seconds: float, passed: Passed) -> None:
    board.start()
    slices = max(1, round(seconds / _SLICE_S))
    for number in range(slices):
        passed(seconds * number / slices)
        board.poll(seconds / slices)
    passed(seconds)
    board.poll(_SLICE_S)
    board.stop()


def _identity(stored: StoredIdentity, rig: Rig, left: list[NotChecked]) -> Iterator[Check]:
    """What the board says of itself, and whether it is the one that the rig is calibrated with."""
    if stored.state != "unset":
        yield Check(
            "serial number and calibration id stored",
            float(not stored.trouble),
            "",
            1,
            1,
            stored.trouble,
        )
    wanted = rig.board.calibration_id
    if wanted is None:
        left.append(
            NotChecked("identity", "calibration of this board", "name it in board.calibration_id")
        )
    else:
        mismatch = calibration_mismatch(stored, wanted)
        yield Check("calibration of this board", float(not mismatch), "", 1, 1, mismatch)


def _none(name: str, count: int, mend: str) -> Check:
    return Check(name, count, "", 0, 0, mend)


def _comes_back(reset_s: float) -> Check:
    return Check(
        "comes back by itself",
        reset_s,
        "s",
        0.0,
        _LONGEST_RESET_S,
        "its bootloader is held by bytes of another program: stop that",
    )


def port_checks(others: str, exclusive: bool, repairs: int) -> tuple[Check, ...]:
    """Findings about the port, for whoever has opened it.

    others: programs that have it open as well; exclusive: whether the kernel refuses it to further
    ones; repairs: how often its settings had to be made anew.
    """
    return (
        _none("others have it open", bool(others), f"stop {others or 'them'}"),
        Check("held for this program", exclusive, "", 1, 1, "give the port of a serial driver"),
        _none(
            "settings changed by others",
            repairs,
            "mask ModemManager, and close whatever monitors the port",
        ),
    )


def _scans(board: AdcBoard) -> Iterator[Check]:
    counted = board.statistics
    yield Check(
        "scans received",
        counted.scans_received,
        "",
        _FEWEST_SCANS,
        math.inf,
        "give more --seconds, or look at what else fails",
    )
    yield _none("scans lost", counted.scans_lost, "check the cable, and what else keeps the host")
    yield _none("scans with a bad channel", counted.scans_bad, "check the ADC's wires")
    yield _none("restarts in the run", counted.restarts, "check the board's power")
    yield _none("damaged frames", counted.frames.bad, "check the cable and its ground")


def _noise(scans: list[Scan], rig: Rig, description: BoardDescription) -> Iterator[Check]:
    """White noise of each channel; the least of a live one is far below a code's step."""
    nominal = rig.board.excitation.value
    greatest = greatest_noise(rig, description)
    for index, name in enumerate(description.channel_names):
        codes = [scan.codes[index] for scan in scans if scan.valid_mask >> index & 1]
        step = description.adc_channel(name, nominal).resolution
        expected = greatest[name]
        enough = len(codes) > 3
        yield Check(
            f"{name} noise",
            white_noise(np.array(codes, dtype=float)) * step if enough else math.nan,
            "V",
            0.1 * step,
            expected * (1.0 + noise_margin(len(codes))) if enough else expected,
            "keep the sensors at rest; check shield, ground and wires",
        )


def _wander(scans: list[Scan], rig: Rig, description: BoardDescription) -> Iterator[Check]:
    """What is slower than 1 Hz in the pressure channels: hum that the scan rate folds down, mostly.

    The limit is the highest that the rig assumes of it, beside what white noise leaves.
    """
    rate, nominal = rig.board.sample_rate.value, rig.board.excitation.value
    greatest = greatest_noise(rig, description)
    for sensor in (rig.sensors.fish_pressure, rig.sensors.depressor_pressure):
        index = description.channel_names.index(sensor.channel)
        codes = [scan.codes[index] for scan in scans if scan.valid_mask >> index & 1]
        step = description.adc_channel(sensor.channel, nominal).resolution
        hum = sensor.errors.hum
        white = math.sqrt(2.0 / wander_samples(rate)) * greatest[sensor.channel]
        yield Check(
            f"{sensor.channel} slow wander",
            slow_wander(np.array(codes, dtype=float), rate) * step,
            "V",
            0.0,
            math.hypot(
                hum.range[1] if hum.range else hum.value,
                white * (1.0 + wander_margin(len(codes), rate)),
            ),
            "check shield, ground and wires; keep draught and waves "
            "away; or take a scan rate to which no mains harmonic folds (docs/laboratory.md)",
        )


def greatest_noise(rig: Rig, description: BoardDescription) -> dict[str, float]:
    """Greatest standard deviation of a sound channel's white noise, V at the terminals, by name."""
    sensors, nominal = rig.sensors, rig.board.excitation.value
    axes = sensors.accelerometer.channels
    limits = {
        sensors.fish_pressure.channel: pressure_limits(rig, description, "fish_pressure"),
        sensors.depressor_pressure.channel: pressure_limits(rig, description, "depressor_pressure"),
        **{getattr(axes, axis): accelerometer_limits(rig, description, axis) for axis in "xyz"},
    }
    return {
        name: limits[name].noise * description.adc_channel(name, nominal).resolution
        if name in limits
        else description.terminal_noise(name, nominal)
        for name in description.channel_names
    }


@dataclass(frozen=True)
class _Shaft:
    """An encoder's shaft in the stream, and how far it was said to be moved."""

    name: str
    counts: np.ndarray
    at_rest: np.ndarray
    """Whether a count is of the time in which the shaft was left alone."""
    per_count: float
    unit: str
    tolerance: float
    given: float | None
    wanted: str

    def checks(self) -> Iterator[Check]:
        """The count at rest; how far it went, where that can be judged."""
        yield Check(
            f"{self.name} at rest",
            float(np.ptp(self.counts[self.at_rest])) if self.at_rest.any() else math.nan,
            "counts",
            0,
            REST_COUNTS,
            "leave it alone in the first second; check the encoder's shield, ground and pull-ups",
        )
        if self.given is not None:
            yield Check(
                self.name,
                float(self.counts[-1] - self.counts[0]) * self.per_count
                if len(self.counts)
                else math.nan,
                self.unit,
                self.given - self.tolerance,
                self.given + self.tolerance,
                "swap A and B if its sign is wrong; else check the encoder's wires, and in the rig "
                "its counts per turn and what it turns by",
            )


def _shafts(
    scans: list[Scan], rig: Rig, turns: float | None, travel: float | None
) -> tuple[_Shaft, _Shaft]:
    stamps_ns = np.array([scan.stamp_ns for scan in scans])
    at_rest = stamps_ns < stamps_ns[:1] + round(1e9 * REST_S)
    # Of one epoch: behind a reset, as `restarts` says, the counts tell nothing
    known = np.array([scan.count_epoch == scans[0].count_epoch for scan in scans])
    return (
        _Shaft(
            "crank",
            np.where(known, [scan.crank for scan in scans], math.nan),
            at_rest,
            crank_encoder(rig).per_count / (2.0 * math.pi),
            "turns",
            TURN_BY_HAND,
            turns,
            "give --turns N and turn the crank by it",
        ),
        _Shaft(
            "carriage",
            np.where(known, [scan.carriage for scan in scans], math.nan),
            at_rest,
            carriage_encoder(rig).per_count,
            "m",
            TURN_BY_HAND * rig.sensors.carriage_encoder.wheel_circumference.value,
            travel,
            "give --travel METRES and move the carriage by it",
        ),
    )


def _clock(board: AdcBoard) -> Iterator[Check]:
    clock = board.clock
    yield Check(
        "rate against the host's",
        clock.rate_ppm,
        "ppm",
        -1e6 * SLOPE_TOLERANCE,
        1e6 * SLOPE_TOLERANCE,
        "the board's resonator is out of its tolerance: replace it",
    )
    yield Check(
        "scatter of the exchanges",
        clock.residual_s,
        "s",
        0.0,
        RESIDUAL_S,
        "the host is too busy: stop what else runs, or give it a real-time kernel",
    )
    yield Check(
        "round trip",
        clock.round_trip_s,
        "s",
        -math.inf,
        ROUND_TRIP_S,
        "set the USB adapter's latency timer to 1 ms",
    )


_TAKES_A_STREAM = (
    ("noise", "channels"),
    ("encoders", "crank"),
    ("encoders", "carriage"),
    ("clock", "rate and scatter"),
    ("counters", "faults in the run"),
)
_MENDS = {
    "missed_ticks": "report it: the firmware did not keep up",
    "scan_overruns": "lower the rate or the filter word",
    "spi_crc_errors": "shorten the ADC's wires, check their level shifters and its ground",
    "adc_sequence_errors": "check the wires SYNC and DOUT",
    "adc_errors": "check the ADC's supply and its decoupling, and shorten its wires",
    "adc_restarts": "the ADC loses its settings: check its 3.3 V supply",
    "illegal_steps": "check the encoders' shields and pull-ups",
    "rx_overflows": "another program writes to the board: stop it",
    "rx_bad_frames": "check the cable, and that no other program writes to the board",
    "dropped_frames": "report it: the line was too slow for the frames",
}
