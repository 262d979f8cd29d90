# SPDX-License-Identifier: Apache-2.0
"""What looks wrong with a sensor, from its codes and from what it is to keep to (health_limits).

* Codes that an intact sensor cannot give: OPEN.
* Codes of a short circuit, by themselves or as a mean that does not move: SHORT.
* Noise makes equal codes in a row unlikely; where there are so many that it would happen by chance
  once in 10^12 scans: STUCK. And a pressure sensor that over a whole turn of the crank shows
  nothing but its noise does not feel the water.
* Noise is what third differences leave over: motion at the crank's frequency hardly passes them.
  More than the rig's noise at its highest: NOISE.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from towtank_node.health import Health
from towtank_rig import Rig
from towtank_rig.conversion import Channel, calibrated_channel, crank_encoder
from towtank_rig.instruments import PressureSensorName

from towtank_daq.description import BoardDescription
from towtank_daq.health_limits import (
    Limits,
    accelerometer_limits,
    excitation_range,
    pressure_limits,
)
from towtank_daq.noise import is_still, noise_margin, white_noise

ADVICE = {
    Health.OPEN: "reads what an intact sensor cannot give: check its wires and the sensor",
    Health.SHORT: "reads as a short circuit: check its wires for water",
    Health.SATURATED: "is at an end of the ADC's scale: check its wires and the gain",
    Health.STUCK: "does not move: check the port, the wires and the ADC",
    Health.EXCITATION: "has an excitation out of range: check the supply of the bridges",
    Health.NOISE: "is noisier than the rig expects: check shield, ground and wires",
}


class ChannelWatch:
    """Judges one channel's codes; update() takes one a scan.

    Saturation, range and equal codes are judged at once; noise and short circuits over blocks of
    ``block`` scans, and then hold until the next block is full.
    """

    def __init__(self, channel: Channel, limits: Limits, block: int) -> None:
        self._limits = limits
        self._top = 2**channel.bits - 1
        self._equal = limits.equal_codes
        self._block = block
        self._noise_limit = limits.noise * (1.0 + noise_margin(block))
        self._codes: list[int] = []
        self._repeats = 0
        self._last: int | None = None
        self._of_block = Health(0)

    def update(self, code: int | None) -> Health:
        """Flags after one more scan; None where the scan lacks a conversion."""
        if code is None:
            self._codes.clear()
            self._repeats, self._last = 0, None
            return self._of_block
        flags = self._of_block
        if code <= 0 or code >= self._top:
            flags |= Health.SATURATED
        limits = self._limits
        if code < limits.low or code > limits.high:
            at_ground = limits.short[0] <= code <= limits.short[1]
            flags |= Health.SHORT if at_ground else Health.OPEN
        self._repeats = self._repeats + 1 if code == self._last else 1
        self._last = code
        if self._equal is not None and self._repeats >= self._equal:
            flags |= Health.STUCK
        self._codes.append(code)
        if len(self._codes) == self._block:
            self._judge_block()
        return flags

    def _judge_block(self) -> None:
        codes = np.array(self._codes, dtype=float)
        self._codes.clear()
        flags = Health(0)
        if white_noise(codes) > self._noise_limit:
            flags |= Health.NOISE
        low, high = self._limits.short
        if low <= float(codes.mean()) <= high and float(codes.std()) <= self._noise_limit:
            flags |= Health.SHORT
        self._of_block = flags


class MotionWatch:
    """Judges whether a pressure sensor follows a turn of the crank; noise: its greatest, codes."""

    def __init__(self, rig: Rig, noise: float) -> None:
        self._noise = noise
        self._turn = crank_encoder(rig).counts_per_revolution
        self._codes: list[int] = []
        self._start: int | None = None
        self._epoch = 0
        self._flags = Health(0)

    def update(self, code: int | None, crank_count: int, count_epoch: int = 0) -> Health:
        """Flags after one more scan; they hold until the crank has turned once more."""
        if self._start is None or code is None or count_epoch != self._epoch:
            self._start = crank_count
            self._codes.clear()
        self._epoch = count_epoch
        if code is not None:
            self._codes.append(code)
        if abs(crank_count - self._start) >= self._turn:
            codes = np.array(self._codes, dtype=float)
            self._flags = Health.STUCK if is_still(codes, self._noise) else Health(0)
            self._codes.clear()
            self._start = crank_count
        elif len(self._codes) > 10_000:  # the crank stands
            self._start = None
        return self._flags


class PressureHealth:
    """Health of one pressure sensor and of the bridges' excitation."""

    def __init__(self, rig: Rig, board: BoardDescription, sensor: PressureSensorName) -> None:
        block = _block(rig)
        name = getattr(rig.sensors, sensor).channel
        self._channel = board.channel_names.index(name)
        self._excitation = board.channel_names.index("excitation")
        nominal = rig.board.excitation.value
        channel = calibrated_channel(rig, sensor, board.adc_channel(name, nominal))
        limits = pressure_limits(rig, board, sensor)
        self._watch = ChannelWatch(channel, limits, block)
        self._motion = MotionWatch(rig, limits.noise)
        low, high = excitation_range(rig, board)
        adc = board.adc_channel("excitation", nominal)
        self._excitation_codes = int(adc.codes(low)), int(adc.codes(high))

    def update(
        self, codes: Sequence[int], valid_mask: int, crank_count: int, count_epoch: int = 0
    ) -> Health:
        """Flags after one more scan."""
        code = codes[self._channel] if valid_mask >> self._channel & 1 else None
        flags = self._watch.update(code)
        if more := self._motion.update(code, crank_count, count_epoch):
            flags |= more  # the union of enumeration's flags takes longer than all else here
        if valid_mask >> self._excitation & 1:
            low, high = self._excitation_codes
            if not low <= codes[self._excitation] <= high:
                flags |= Health.EXCITATION
        return flags


class AccelerometerHealth:
    """Health of the accelerometer's three axes."""

    def __init__(self, rig: Rig, board: BoardDescription) -> None:
        names = rig.sensors.accelerometer.channels
        nominal = rig.board.excitation.value
        self._watches = [
            (
                board.channel_names.index(name),
                ChannelWatch(
                    board.adc_channel(name, nominal),
                    accelerometer_limits(rig, board, axis),
                    _block(rig),
                ),
            )
            for axis, name in (("x", names.x), ("y", names.y), ("z", names.z))
        ]

    def update(self, codes: Sequence[int], valid_mask: int) -> Health:
        """Flags of all axes together after one more scan."""
        flags = Health(0)
        for channel, watch in self._watches:
            if more := watch.update(codes[channel] if valid_mask >> channel & 1 else None):
                flags |= more
        return flags


def _block(rig: Rig) -> int:
    """Scans that noise is judged over: those of a second, at least enough for a judgement."""
    return max(round(rig.board.sample_rate.value), 20)
