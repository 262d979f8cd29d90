# SPDX-License-Identifier: Apache-2.0
"""The soak of `towtank bench soak`, for half a minute of board time."""

import struct
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent / "benchmarks"))

from soak import VirtualBoard, soak


def test_every_scan_of_half_a_minute_is_accounted_for():
    """At 200 Hz, with the board's 32-bit time and both encoder counts passing their ends."""
    account = soak(30, rate_hz=200, ticks_before_wrap=10 * 2_000_000)
    assert account.complete, account
    assert account.received > 5800  # 200 a second, less the start
    wraps = {counter.counter: counter.wraps for counter in account.wraps}
    assert wraps["scan ticks, silence and health timers"] == 1
    assert wraps["crank count"] >= 3
    assert wraps["carriage count"] >= 2
    assert wraps["sample timer"] >= 800  # 30.5 a second
    assert min(wraps["receive buffer"], wraps["transmit buffer"]) >= 2


class FaultyBoard(VirtualBoard):
    """One conversion in 500 is read wrong, and the crank's counter begins 20 counts off."""

    def preset(self, variable: str, data: bytes, offset: int = 0) -> None:
        if variable == "crank":
            data = struct.pack("<i", struct.unpack("<i", data)[0] - 20)
        super().preset(variable, data, offset)
        self.set_faults(spi_error_one_in=500)


def test_what_is_wrong_is_found(monkeypatch):
    monkeypatch.setattr("soak.VirtualBoard", FaultyBoard)
    account = soak(8)
    assert not account.complete
    assert account.bad == account.flagged > 3
    # One read in seven is of a register behind the scan, and costs it nothing
    assert account.bad <= account.troubles["spi_crc_errors"] < 2 * account.bad
    assert account.wrong_counts == account.received > 650
    assert account.last_count_errors == (-20, 0)
    assert (account.lost, account.out_of_step, account.wrong_codes) == (0, 0, 0)
