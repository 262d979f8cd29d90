# SPDX-License-Identifier: Apache-2.0
"""Readings for a procedure from the ADC board: means over some seconds, with their scatter.

The board streams while a reading is taken and rests while somebody moves a sensor; its encoder
counts go on meanwhile, unless it is reset.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from towtank_daq.board import AdcBoard, Scan, Transport
from towtank_daq.configuration import configuration_at
from towtank_daq.description import BoardDescription
from towtank_daq.protocol import Protocol
from towtank_rig import Rig
from towtank_rig.calibration_files import BoardIdentity
from towtank_rig.conversion import Channel

from towtank_lab.errors import ProcedureError

_SLICE_S = 0.5
_FEWEST_SCANS = 20


@dataclass(frozen=True)
class ChannelReading:
    """Mean and standard deviation of one channel, V at the terminals, over so many samples; and the
    mean of the raw codes, from which the volts can be made again."""

    mean: float
    scatter: float
    samples: int
    code: float


@dataclass(frozen=True)
class BoardReading:
    """One reading: channels by name, and the crank's count at its end with its epoch."""

    channels: dict[str, ChannelReading]
    crank_counts: int
    count_epoch: int


class BoardReadings:
    """An ADC board from which readings are taken, one after the other."""

    def __init__(
        self,
        transport: Transport,
        rig: Rig,
        description: BoardDescription,
        warn: Callable[[str], None],
        monotonic_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        """Connect to the board and configure it. Raises BoardError, OSError."""
        self._scans: list[Scan] = []
        self._names = description.channel_names
        self._convert: list[Channel] = [
            description.adc_channel(name, rig.board.excitation.value) for name in self._names
        ]
        self._board = AdcBoard(
            transport, Protocol(description), self._scans.append, warn, monotonic_ns
        )
        identity = self._board.connect()
        self._board.configure(configuration_at(description, description.sampling.rate_hz.default))
        self.identity = BoardIdentity(
            serial=f"{identity.board_serial:08x}",
            firmware=".".join(map(str, identity.firmware_version)),
            schema_hash=f"{identity.schema_hash:08x}",
        )

    def take(self, seconds: float, show: Callable[[BoardReading], None]) -> BoardReading:
        """Return the mean of all scans of the next seconds; `show` gets what there is so far.

        Raises ProcedureError for too few good scans, BoardError or OSError if the board fails.
        """
        self._scans.clear()
        self._board.start()
        left = seconds
        while left > 1e-9:
            slice_s = min(_SLICE_S, left)
            self._board.poll(slice_s)
            left -= slice_s
            if len(self._scans) > 1:
                show(self._reading())
        self._board.stop()
        if len(self._scans) < _FEWEST_SCANS:
            raise ProcedureError(
                f"only {len(self._scans)} scans came in {seconds:g} s: check the board's cable"
            )
        return self._reading()

    def conditions(self, excitation: str) -> dict[str, float]:
        """Return what held at the last reading: mean of the excitation's channel, V, and the
        temperature inside the ADC, °C, if the board has told it."""
        found = {}
        last = self._reading().channels if self._scans else {}
        if excitation in last:
            found["excitation_V"] = last[excitation].mean
        health = self._board.health
        if health is not None and health.adc_temperature_code:
            found["adc_temperature_degC"] = adc_temperature(health.adc_temperature_code)
        return found

    def _reading(self) -> BoardReading:
        channels = {}
        for index, (name, channel) in enumerate(zip(self._names, self._convert, strict=True)):
            codes = [s.codes[index] for s in self._scans if s.valid_mask >> index & 1]
            if len(codes) < 2 or channel.saturated(codes).any():
                continue  # whoever wants this channel says that it is missing
            volts = channel.volts(codes)
            scatter = float(np.std(volts, ddof=1))
            channels[name] = ChannelReading(
                float(np.mean(volts)), scatter, len(codes), float(np.mean(codes))
            )
        last = self._scans[-1]
        return BoardReading(channels, last.crank, last.count_epoch)


def adc_temperature(code: int) -> float:
    """Return °C of the AD7124's temperature sensor, a bipolar code of 24 bits (data sheet)."""
    return (code - 2**23) / 13584.0 - 272.5


def channel_of(reading: BoardReading, name: str) -> ChannelReading:
    """Return one channel of a reading; ProcedureError if it has no good samples."""
    if name not in reading.channels:
        raise ProcedureError(
            f"channel {name} gives no readings or lies at an end of its scale: check the sensor's "
            "wiring"
        )
    return reading.channels[name]
