# SPDX-License-Identifier: Apache-2.0
"""Guided calibrations: what to do next, readings at each step, told as they come.

A guide talks through two functions and takes readings from a third, so that a terminal, a script
and a test are the same to it. It yields each row, as a readings file has it, when it is taken.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from towtank_rig import Rig

from towtank_lab.accelerometer_calibration import SIX_POSITIONS
from towtank_lab.board_readings import BoardReading, ChannelReading, channel_of
from towtank_lab.errors import ProcedureError

Row = dict[str, float]

# A reading that scatters by more than this, times what is expected, was taken of a moving sensor.
_UNSTEADY = 4.0


@dataclass(frozen=True)
class Terminal:
    """How a guide meets the one who does the work.

    ask: shows a question, returns the answer; Enter is the empty one. say: shows a line. progress:
    shows a line that the next one takes the place of.
    """

    ask: Callable[[str], str]
    say: Callable[[str], None]
    progress: Callable[[str], None]


@dataclass(frozen=True)
class Station:
    """Where the readings come from.

    move: does what a step asks for, by the step's row; nothing where somebody's hands do. take: a
    reading over some seconds. noise: expected scatter of one sample by channel, V.
    """

    move: Callable[[Mapping[str, float]], None]
    take: Callable[[float, Callable[[BoardReading], None]], BoardReading]
    noise: Mapping[str, float]


def pressure_rows(
    rig: Rig, sensor: str, depths: Sequence[float], seconds: float, desk: Terminal, at: Station
) -> Iterator[Row]:
    """Lead through immersions at the depths (m), in their order; the answer may be the true one."""
    channel = getattr(rig.sensors, sensor).channel
    for number, wanted in enumerate(depths, start=1):
        depth = _number(
            desk,
            f"{number}/{len(depths)}: bring the port of {sensor} {wanted:.3f} m below still water; "
            "Enter, or the depth that it really has, m",
            wanted,
        )
        at.move({"depth_m": depth})
        (volts,) = _read((channel,), seconds, desk, at)
        yield {"depth_m": depth, **_columns("volts", volts)}


def accelerometer_rows(
    rig: Rig,
    tilts: Sequence[tuple[float, float]],
    seconds: float,
    desk: Terminal,
    at: Station,
) -> Iterator[Row]:
    """Lead through the six positions, and then the tilts of a table (roll and pitch, degrees)."""
    sensor = rig.sensors.accelerometer.channels
    steps = [
        (f"lay the fish with {name} on the levelled table", attitude)
        for name, attitude in SIX_POSITIONS.items()
    ]
    steps += [
        (
            f"tilt the upright fish to roll {roll:g}, pitch {pitch:g} degrees",
            (roll, pitch),
        )
        for roll, pitch in tilts
    ]
    for number, (step, (roll, pitch)) in enumerate(steps, start=1):
        desk.ask(f"{number}/{len(steps)}: {step}; Enter")
        attitude = {"roll_deg": roll, "pitch_deg": pitch}
        at.move(attitude)
        read = _read((sensor.x, sensor.y, sensor.z), seconds, desk, at)
        row: Row = dict(attitude)
        for axis, volts in zip("xyz", read, strict=True):
            row |= _columns(f"volts_{axis}", volts)
        yield row


def crank_rows(
    angles: Sequence[float], with_heights: bool, seconds: float, desk: Terminal, at: Station
) -> Iterator[Row]:
    """Lead through the marks of the crank's disc at the angles (degrees), in their order.

    Raises ProcedureError when the board was reset between two marks.
    """
    epoch = None
    for number, angle in enumerate(angles, start=1):
        question = (
            f"{number}/{len(angles)}: turn the crank, in the sense in which it runs, to {angle:g} "
            "degrees from mark 0"
        )
        row: Row = {"angle_deg": angle}
        if with_heights:
            row["height_m"] = _number(desk, f"{question}; the tow point's height there, m", None)
        else:
            desk.ask(f"{question}; Enter")
        at.move(row)
        reading = at.take(seconds, lambda _: None)
        if epoch not in (None, reading.count_epoch):
            raise ProcedureError(
                "the board was reset since the mark before, and its counts have begun anew: check "
                "its power, and begin again at the first mark"
            )
        epoch = reading.count_epoch
        row["counts"] = reading.crank_counts
        desk.say(f"   {reading.crank_counts} counts")
        yield row


def _read(
    names: Sequence[str], seconds: float, desk: Terminal, at: Station
) -> tuple[ChannelReading, ...]:
    """Take one reading of the channels, again for as long as the answer says so."""

    def show(so_far: BoardReading) -> None:
        read = [so_far.channels[name] for name in names if name in so_far.channels]
        desk.progress("   " + "   ".join(_told(volts) for volts in read))

    while True:
        reading = at.take(seconds, show)
        read = tuple(channel_of(reading, name) for name in names)
        desk.say("   " + "   ".join(_told(volts) for volts in read))
        moved = list(_unsteady(names, read, at.noise))
        if not moved:
            return read
        answer = desk.ask(
            f"   unsteady: {', '.join(moved)}; let it come to rest and Enter to read again, or "
            "'keep'"
        )
        if answer.strip() == "keep":
            return read


def _unsteady(
    names: Sequence[str], read: Sequence[ChannelReading], noise: Mapping[str, float]
) -> Iterator[str]:
    for name, volts in zip(names, read, strict=True):
        if volts.scatter > _UNSTEADY * noise[name]:
            yield (
                f"{name} scatters by {1e6 * volts.scatter:.1f} µV, its noise is "
                f"{1e6 * noise[name]:.1f} µV"
            )


def _told(volts: ChannelReading) -> str:
    return (
        f"{1e3 * volts.mean:.4f} mV, scatter {1e6 * volts.scatter:.2f} µV over "
        f"{volts.samples} samples"
    )


def _columns(name: str, volts: ChannelReading) -> Row:
    return {
        name: volts.mean,
        f"{name}_scatter": volts.scatter,
        f"{name}_samples": volts.samples,
        f"{name}_code": volts.code,
    }


def _number(desk: Terminal, question: str, default: float | None) -> float:
    """Ask until the answer is a number, or Enter where that stands for one."""
    while True:
        answer = desk.ask(question).strip()
        if not answer and default is not None:
            return default
        try:
            number = float(answer)
        except ValueError:
            number = math.nan
        if math.isfinite(number):
            return number
        desk.say(f"   {answer!r} is no number: write it like 0.5")
