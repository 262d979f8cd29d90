# SPDX-License-Identifier: Apache-2.0
"""What a broken sensor or wire does to the volts at the board's terminals.

    fish_pressure:open@20        from 20 s after the plant's start
    accel_x:short@20-25          until 25 s
    depressor_pressure:stuck@0,excitation:low@30

open: a bridge's amplifier without one of its inputs goes to its rail (12 V, over its gain); the
filter capacitor of an accelerometer's output is charged to the supply by the ADC's input current.
short: a bridge's outputs touch, an accelerometer's touches ground. stuck: the volts stay as they
were. noisy: fifty times the rig's highest noise on top. low, high: the excitation is off by a
fifth, and what the bridges give with it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray
from towtank_rig import Rig

Array = NDArray[np.float64]
Kind = Literal["open", "short", "stuck", "noisy", "low", "high"]
EXCITATION = "excitation"

_OPEN_BRIDGE, _OPEN_ACCELEROMETER = 0.3, 3.3  # V
_NOISE_FACTOR = 50.0
_EXCITATION_FACTOR = {"low": 0.8, "high": 1.2}


class FaultError(ValueError):
    """A fault that cannot be; one line with cause and mend."""


@dataclass(frozen=True)
class TerminalFault:
    """One fault of one channel of the board, from `start` to `stop` (s after the plant's start)."""

    channel: str
    kind: Kind
    start: float
    stop: float = math.inf


def parse_faults(text: str) -> tuple[TerminalFault, ...]:
    """Read faults as the module's text shows them, separated by commas; FaultError for others."""
    return tuple(_parse(part.strip()) for part in text.split(",") if part.strip())


def _parse(text: str) -> TerminalFault:
    what, at, when = text.partition("@")
    channel, colon, kind = what.partition(":")
    start, dash, stop = when.partition("-")
    wrong = FaultError(
        f"sensor fault '{text}': write CHANNEL:KIND@START or CHANNEL:KIND@START-STOP, KIND one of "
        f"{', '.join(get_args(Kind))}, times in s"
    )
    if not (at and colon) or kind not in get_args(Kind):
        raise wrong
    if (kind in _EXCITATION_FACTOR) != (channel == EXCITATION):
        raise FaultError(
            f"sensor fault '{text}': low and high are for the excitation, the others for a sensor"
        )
    try:
        times = float(start), float(stop) if dash else math.inf
    except ValueError:
        raise wrong from None
    if not 0.0 <= times[0] < times[1]:
        raise FaultError(f"sensor fault '{text}': it must stop after it starts, and not before 0")
    return TerminalFault(channel, kind, *times)  # type: ignore[arg-type]


class TerminalFaults:
    """Faults upon the volts of a board's terminals.

    channels: their names in order. Raises FaultError for a fault of another channel.
    """

    def __init__(
        self, faults: Sequence[TerminalFault], rig: Rig, channels: Sequence[str], seed: int = 0
    ) -> None:
        for fault in faults:
            if fault.channel not in channels:
                raise FaultError(
                    f"sensor fault: the board has no channel '{fault.channel}': give one of "
                    f"{', '.join(channels)}"
                )
        self._faults = tuple(faults)
        self._index = {name: channels.index(name) for name in channels}
        sensors = rig.sensors
        self._bridges = [sensors.fish_pressure.channel, sensors.depressor_pressure.channel]
        self._noise = {name: _highest_noise(rig, name) for name in channels}
        self._held: dict[TerminalFault, float] = {}
        self._rng = np.random.default_rng(seed)

    def apply(self, time: ArrayLike, volts: Array) -> Array:
        """Return volts of shape (…, channels), at times of shape (…), with the faults in them."""
        if not self._faults:
            return volts
        time, volts = np.asarray(time), volts.copy()
        for fault in self._faults:
            during = (fault.start <= time) & (time < fault.stop)
            if during.any():
                column = volts[..., self._index[fault.channel]]
                column[during] = self._faulty(fault, column[during])
                if fault.kind in _EXCITATION_FACTOR:
                    for bridge in self._bridges:
                        volts[..., self._index[bridge]][during] *= _EXCITATION_FACTOR[fault.kind]
        return volts

    def _faulty(self, fault: TerminalFault, volts: Array) -> ArrayLike:
        match fault.kind:
            case "open":
                bridge = fault.channel in self._bridges
                return _OPEN_BRIDGE if bridge else _OPEN_ACCELEROMETER
            case "short":
                return 0.0
            case "stuck":
                return self._held.setdefault(fault, float(volts.flat[0]))
            case "noisy":
                noise = _NOISE_FACTOR * self._noise[fault.channel]
                return volts + noise * self._rng.standard_normal(volts.shape)
            case _:
                return volts * _EXCITATION_FACTOR[fault.kind]


def _highest_noise(rig: Rig, channel: str) -> float:
    sensors = rig.sensors
    by_channel = {
        sensors.fish_pressure.channel: sensors.fish_pressure.errors.noise,
        sensors.depressor_pressure.channel: sensors.depressor_pressure.errors.noise,
        **dict.fromkeys(
            sensors.accelerometer.channels.model_dump().values(), sensors.accelerometer.errors.noise
        ),
    }
    noise = by_channel.get(channel)
    return 0.0 if noise is None else (noise.range[1] if noise.range else noise.value)
