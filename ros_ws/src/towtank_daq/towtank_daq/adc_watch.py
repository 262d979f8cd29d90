# SPDX-License-Identifier: Apache-2.0
"""What to say of an ADC that loses its registers, tells of errors, or gives nothing at all.

The board sets such an ADC up anew by itself and marks the scans; this turns marks and counters into
a line for people: once in an outage, once when it is over, and once for each kind of error.
"""

from __future__ import annotations

from collections.abc import Iterator

from towtank_daq.protocol import Protocol
from towtank_daq.protocol_records import HealthFrame

OUTAGE_S = 1.0
"""So long without any channel, and it is told, s."""
OUTAGE_MEND = "check its 3.3 V supply and the wires CS, SCLK, DIN, DOUT and SYNC"
QUIET_S = 5.0
"""Outages that follow each other faster than this are told together, s."""

_MENDS = {
    "power_on": "check its 3.3 V supply",
    "register_checksum": "keep what sparks away from the board; if it comes again, replace the ADC",
    "rom_checksum": "replace the ADC",
    "spi_checksum": "shorten the ADC's wires, check their level shifters and its ground",
    "spi_clocks": "shorten the ADC's wires, check their level shifters and its ground",
    "spi_not_ready": "report it if it comes often",
    "analog_supply": "check the ADC's supply and its decoupling",
    "digital_supply": "check the ADC's supply and its decoupling",
}


class AdcWatch:
    """One board's ADC; scan() and health() take what comes and give the lines to be said."""

    def __init__(self, protocol: Protocol) -> None:
        self._protocol = protocol
        self._restart_flag = protocol.board.data_flags["adc_restart"]
        self._bits: int | None = None
        self.reset()

    def board_was_reset(self) -> None:
        """Forget all: what the board tells of from here on is new."""
        self.reset()
        self._bits = 0

    def reset(self) -> None:
        """Another stream, of a board that has not forgotten what its ADC has told of."""
        self.outage_s = 0.0
        """From the first to the last scan without a channel, of the outage that lasts."""
        self._begun_ns: int | None = None  # of the outage that lasts
        self._outage_told = False
        self._restarted = False
        self._without = 0  # scans without a channel, of outages not yet told as over
        self._told_ns: int | None = None

    def scan(self, flags: int, valid_mask: int, stamp_ns: int) -> Iterator[str]:
        """One more scan that has come."""
        if valid_mask == 0:
            self._without += 1
            self._restarted = self._restarted or bool(flags & self._restart_flag)
            if self._begun_ns is None:
                self._begun_ns = stamp_ns
            self.outage_s = (stamp_ns - self._begun_ns) / 1e9
            if self.outage_s >= OUTAGE_S and not self._outage_told:
                self._outage_told = True
                yield (
                    f"the ADC has given nothing for {OUTAGE_S:g} s: {OUTAGE_MEND}; "
                    "the board goes on trying to set it up anew"
                )
            return
        self._begun_ns, self._outage_told, self.outage_s = None, False, 0.0
        quiet = self._told_ns is not None and stamp_ns - self._told_ns < 1e9 * QUIET_S
        if self._restarted and not quiet:
            yield (
                f"the ADC had lost its settings and was set up anew: {self._without} scans have no "
                "channel, and the last value of the one before may be wrong; check its 3.3 V "
                "supply if it comes again"
            )
            self._told_ns, self._without, self._restarted = stamp_ns, 0, False
        elif not self._restarted:
            self._without = 0

    def health(self, record: HealthFrame) -> Iterator[str]:
        """The board's counters as they stand; the first may tell of an earlier host's runs."""
        known, self._bits = self._bits, record.adc_error_bits
        new = record.adc_error_bits & ~(known or 0)
        if known is None or not new:
            return
        names = self._protocol.adc_errors(new)
        first = names.split(" + ")[0]
        yield (
            f"the ADC tells of {names.replace('_', ' ')}: "
            f"{_MENDS.get(first, 'look it up in its data sheet')}"
        )
