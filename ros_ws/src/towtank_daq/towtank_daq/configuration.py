# SPDX-License-Identifier: Apache-2.0
"""What may be chosen about the board's scans, checked before the board is asked.

The board checks the same and refuses with a number; here the refusal says what is wrong and what
would do.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from towtank_daq.description import BoardDescription
from towtank_daq.protocol_records import ConfigureArguments

_NO_CHANNEL = 255
_GAINS = (1, 2, 4, 8, 16, 32, 64, 128)
_SLOWEST_ADC = 1.05  # its clock may be 5 % slow
_CONVERTING = 0.9  # greatest part of a period that configuration_at lets the conversions take
_READOUT_S = 0.2e-3  # the board's time for the last conversion and the frame


class ConfigurationError(ValueError):
    """A configuration that the board cannot have; one line with cause and mend."""


@dataclass(frozen=True, slots=True)
class Configuration:
    """How the board scans."""

    rate_hz: int
    """Scans per second."""
    filter_type: str
    """Of the ADC: a name in board.yaml's adc.filter.types."""
    filter_fs: int
    """The ADC's filter word: a conversion takes (order 32 fs + dead cycles) / master clock."""
    gains: tuple[int, ...]
    """The ADC's amplification of each channel, in board.yaml's order."""
    order: tuple[str, ...]
    """Names of the channels in the order in which they are converted; those left out are not."""

    def conversion_s(self, board: BoardDescription) -> float:
        """Nominal duration of one channel's conversion, s."""
        adc = board.adc
        cycles = adc.filter.types[self.filter_type].order * 32 * self.filter_fs
        return (cycles + adc.filter.dead_cycles) / adc.master_clock_hz

    def longest_conversions_s(self, board: BoardDescription) -> float:
        """Duration of a scan's conversions on the slowest ADC, s."""
        return len(self.order) * self.conversion_s(board) * _SLOWEST_ADC

    def channel_delays_ns(self, board: BoardDescription) -> list[int]:
        """Instant of each channel's sample after the scan's tick, ns; 0 for one left out.

        The channel at place i of the order is converted from i T to (i+1) T and weighs that span
        evenly about its middle; the single pole before it delays slow signals by its time constant
        1/(2 pi f): delay = (i + 1/2) T - 1/(2 pi f).
        """
        conversion_s = self.conversion_s(board)
        delays_ns = [0] * len(board.channels)
        for place, name in enumerate(self.order):
            index = board.channel_names.index(name)
            pole_s = 1.0 / (2.0 * math.pi * board.channels[index].pole_hz)
            delays_ns[index] = round(1e9 * ((place + 0.5) * conversion_s - pole_s))
        return delays_ns

    def configured_mask(self, board: BoardDescription) -> int:
        """Bit i: channel i is converted, as `valid_mask` of a complete scan has it."""
        return sum(1 << board.channel_names.index(name) for name in self.order)

    def arguments(self, board: BoardDescription) -> ConfigureArguments:
        """The arguments of `configure`. Raises ConfigurationError."""
        self._check(board)
        order = [board.channel_names.index(name) for name in self.order]
        return ConfigureArguments(
            rate_hz=self.rate_hz,
            filter_type=board.adc.filter.types[self.filter_type].code,
            filter_fs=self.filter_fs,
            gains=self.gains,
            order=(*order, *[_NO_CHANNEL] * (len(board.channels) - len(order))),
        )

    def _check(self, board: BoardDescription) -> None:
        rates, words = board.sampling.rate_hz, board.adc.filter.fs
        if not rates.minimum <= self.rate_hz <= rates.maximum:
            raise ConfigurationError(
                f"scan rate {self.rate_hz} Hz: the board takes {rates.minimum} to "
                f"{rates.maximum} Hz"
            )
        if self.filter_type not in board.adc.filter.types:
            raise ConfigurationError(
                f"filter '{self.filter_type}': the board has "
                + " and ".join(board.adc.filter.types)
            )
        if not words.minimum <= self.filter_fs <= words.maximum:
            raise ConfigurationError(
                f"filter word {self.filter_fs}: the board takes {words.minimum} to {words.maximum}"
            )
        if len(self.gains) != len(board.channels):
            raise ConfigurationError(
                f"{len(self.gains)} gains: give one for each of the {len(board.channels)} channels"
            )
        for name, gain in zip(board.channel_names, self.gains, strict=True):
            if gain not in _GAINS:
                raise ConfigurationError(
                    f"gain {gain} of {name}: the ADC has {', '.join(map(str, _GAINS))}"
                )
        for name in self.order:
            if name not in board.channel_names:
                raise ConfigurationError(
                    f"channel '{name}': the board has {', '.join(board.channel_names)}"
                )
            if self.order.count(name) > 1:
                raise ConfigurationError(f"channel '{name}' stands twice: name it once")
        if not self.order:
            raise ConfigurationError("no channel is scanned: name at least one")
        longest_s = self.longest_conversions_s(board) + _READOUT_S
        if longest_s > 1.0 / self.rate_hz:
            raise ConfigurationError(
                f"{len(self.order)} channels at {self.rate_hz} Hz with {self.filter_type} and "
                f"filter word {self.filter_fs}: a scan may take {1e3 * longest_s:.2f} ms of "
                f"{1e3 / self.rate_hz:.2f} ms; lower the rate or the filter word, or scan fewer "
                "channels"
            )


def configuration_at(board: BoardDescription, rate_hz: int) -> Configuration:
    """board.yaml's configuration at a scan rate: with its filter word, or less where that is too
    slow to leave a tenth of the period for reading out."""
    words = board.adc.filter.fs
    configuration = Configuration(
        rate_hz=rate_hz,
        filter_type=board.adc.filter.type,
        filter_fs=words.default,
        gains=tuple(board.adc.setups[channel.setup].pga for channel in board.channels),
        order=tuple(board.channel_names),
    )
    while (
        configuration.filter_fs > words.minimum
        and configuration.longest_conversions_s(board) * rate_hz > _CONVERTING
    ):
        configuration = replace(configuration, filter_fs=configuration.filter_fs - 1)
    return configuration


def configuration_of(record: ConfigureArguments, board: BoardDescription) -> Configuration:
    """What the board says of its configuration."""
    names = {kind.code: name for name, kind in board.adc.filter.types.items()}
    return Configuration(
        rate_hz=record.rate_hz,
        filter_type=names[record.filter_type],
        filter_fs=record.filter_fs,
        gains=record.gains,
        order=tuple(board.channel_names[i] for i in record.order if i != _NO_CHANNEL),
    )
