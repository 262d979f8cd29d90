# SPDX-License-Identifier: GPL-3.0-or-later
"""The UART at 250 kbaud, both ways, and the faults of its cable."""

from __future__ import annotations

import math

import numpy as np
from probe_link import MILLISECOND

BYTE_NS = 11 * 4_000  # simavr's UART takes 11 bit times of 4 µs


def test_echo_loses_nothing_at_full_rate(open_probe):
    probe = open_probe()
    random = np.random.default_rng(1)
    sent = b""
    for _ in range(20):
        data = random.bytes(200)
        probe.board.write(b"e" + bytes([len(data)]) + data)
        sent += data
    # 20 · 202 bytes in, then the echo's last bytes out.
    probe.board.run_until(probe.board.now_ns + (20 * 202 + 10) * BYTE_NS)
    assert probe.board.read() == sent


def test_bytes_take_their_time_on_the_line(open_probe):
    probe = open_probe()
    probe.board.write(b"e\x64" + bytes(100))
    start = probe.board.now_ns
    probe.board.run_until(start + 102 * BYTE_NS // 2)
    half = len(probe.board.read())
    assert 40 <= half <= 50  # two bytes of command before, two or three on the way
    probe.board.run_until(start + 110 * BYTE_NS)
    assert half + len(probe.board.read()) == 100


def test_pulled_cable_passes_nothing(open_probe):
    probe = open_probe()
    probe.board.set_faults(serial_byte_drop_rate=1.0)
    probe.board.write(b"e\x02ab")
    probe.board.run_until(probe.board.now_ns + 5 * MILLISECOND)
    assert probe.board.read() == b""
    assert probe.board.counters()["serial_bytes_dropped"] == 4
    probe.board.set_faults()
    assert probe.ask(b"e\x02ab", 2) == b"ab"


def test_bit_errors_come_at_their_rate_and_are_counted(open_probe):
    probe = open_probe()
    sent = bytes(255) * 20
    probe.board.write((b"e\xff" + bytes(255)) * 20)
    rate = 1e-3
    # The faults begin once the requests are in the cable: only the answer suffers.
    probe.board.set_faults(serial_bit_error_rate=rate)
    probe.board.run_until(probe.board.now_ns + 20 * 257 * BYTE_NS + 10 * MILLISECOND)
    received = probe.board.read()
    assert len(received) == len(sent)
    flipped = sum(byte.bit_count() for byte in received)
    assert flipped == probe.board.counters()["serial_bits_flipped"]
    expected = rate * 8 * len(sent)
    assert abs(flipped - expected) < 4 * math.sqrt(expected)  # Poisson, four standard deviations


def test_dropped_and_doubled_bytes_are_counted(open_probe):
    probe = open_probe()
    probe.board.write((b"e\xff" + bytes(255)) * 10)
    probe.board.set_faults(serial_byte_drop_rate=0.02, serial_byte_double_rate=0.02)
    probe.board.run_until(probe.board.now_ns + 10 * 257 * BYTE_NS + 10 * MILLISECOND)
    counters = probe.board.counters()
    assert counters["serial_bytes_dropped"] > 0
    assert counters["serial_bytes_doubled"] > 0
    lost = counters["serial_bytes_dropped"] - counters["serial_bytes_doubled"]
    assert len(probe.board.read()) == 2550 - lost
