# SPDX-License-Identifier: GPL-3.0-or-later
"""The board's own firmware on the virtual board, without a clock: what a host would see."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from board_link import ALL_CHANNELS, BOOT, IDENTIFY, RESPONSE, START, STOP, Frames, request
from vboard import BenchFrame, ResetCause, VirtualBoard, records

MILLISECOND = 1_000_000
SECOND = 1_000_000_000
VOLTS = (0.012, -0.003, 1.40, 1.75, 2.20, 10.2)
COUNTS = 2400


def expected_codes(volts: tuple[float, ...]) -> list[float]:
    """Closed form of every channel's code."""
    reference = volts[5] / 4
    bridges = [2**23 * (35.96 * v / reference + 1) for v in volts[:2]]
    return bridges + [2**24 * v / 3.3 for v in volts[2:5]] + [2**24 * 0.2 * volts[5] / 2.5]


class Host:
    """Talks to the firmware and keeps it company: it goes idle when nobody does."""

    def __init__(self, board: VirtualBoard) -> None:
        self.board = board
        self.frames = Frames()
        self._request_id = 0

    def run_until(self, time_ns: int) -> None:
        self.board.run_until(time_ns)
        self.frames.take(self.board.read())

    def ask(self, command: int, arguments: bytes = b"") -> bytes:
        """The data of the response; the status must be ok."""
        self._request_id = self._request_id % 255 + 1
        self.board.write(request(command, self._request_id, arguments))
        head = bytes([command | RESPONSE, self._request_id])
        for _ in range(100):
            self.run_until(self.board.now_ns + MILLISECOND)
            for payload in self.frames.payloads:
                if payload[:2] == head:
                    assert payload[2] == 0, payload
                    return payload[3:]
        raise AssertionError(f"no response to {command:#x}")

    def stay_until(self, time_ns: int) -> None:
        while self.board.now_ns < time_ns:
            self.run_until(min(time_ns, self.board.now_ns + SECOND))
            self.ask(IDENTIFY)


@pytest.fixture
def host(board_elf):
    with VirtualBoard(
        board_elf,
        crank_counts_per_revolution=COUNTS,
        carriage_counts_per_revolution=COUNTS,
        noise_volts=0.0,
    ) as board:
        host = Host(board)
        host.run_until(50 * MILLISECOND)
        yield host


def push_constant(board: VirtualBoard, volts: tuple[float, ...], until_ns: int) -> None:
    for time in (board.now_ns + MILLISECOND, until_ns):
        assert board.push_bench(BenchFrame(time, volts, 0.0, 0.0)) == 0


def test_boot_frame_and_identify(host):
    (boot,) = host.frames.of_type(BOOT)
    assert boot[1:4] == bytes([ResetCause.POWER_ON, 1, 0])
    schema_hash = boot[4:8]
    identity = host.ask(IDENTIFY)
    assert identity[1:5] == schema_hash
    told = records.IdentifyResponse.unpack(identity)
    assert told.adc_id == 0x14  # it answers
    assert told.clock_hz == 2_000_000


def test_scans_carry_the_closed_form_codes(host):
    push_constant(host.board, VOLTS, 10 * SECOND)
    host.ask(START)
    host.stay_until(3 * SECOND)
    host.ask(STOP)
    scans = host.frames.scans()
    # The front end starts settled at the first sample's voltages.
    assert len(scans) > 250
    for scan in scans:
        if scan.valid_mask == ALL_CHANNELS:
            assert np.abs(np.subtract(scan.codes, expected_codes(VOLTS))).max() <= 0.51
    assert host.frames.bad == 0


def test_no_scan_is_lost(host):
    push_constant(host.board, VOLTS, 10 * SECOND)
    host.ask(START)
    host.stay_until(5 * SECOND)
    scheduled = records.StopResponse.unpack(host.ask(STOP)).scans_scheduled
    scans = host.frames.scans()
    assert [s.sequence for s in scans] == list(range(scheduled))
    assert set(np.diff([s.ticks for s in scans])) == {20_000}
    assert all(s.valid_mask == ALL_CHANNELS and s.flags == 0 for s in scans)


def test_encoder_counts_are_exact(host):
    random = np.random.default_rng(3)
    # 5 000 edges/s on each line pair at most: 0.13 rad in 10 ms at 2400 counts a turn.
    steps = random.uniform(-0.13, 0.13, (2, 300))
    angles = np.cumsum(steps, axis=1) + np.array([[5.0], [-40.0]])
    start = host.board.now_ns + 10 * MILLISECOND
    for i, (crank, carriage) in enumerate(angles.T):
        host.board.push_bench(BenchFrame(start + i * 10 * MILLISECOND, VOLTS, crank, carriage))
    host.ask(START)
    host.stay_until(start + 3_100 * MILLISECOND)
    host.ask(STOP)
    last = host.frames.scans()[-1]
    scale = COUNTS / (2 * math.pi)
    expected = np.floor(angles[:, -1] * scale) - np.floor(angles[:, 0] * scale)
    assert (last.crank, last.carriage) == tuple(expected)
    assert host.frames.health().illegal_steps == 0


def test_noise_has_the_nominal_sigma(board_elf):
    with VirtualBoard(board_elf, seed=9) as board:
        host = Host(board)
        host.run_until(50 * MILLISECOND)
        push_constant(board, VOLTS, 20 * SECOND)
        host.ask(START)
        host.stay_until(8 * SECOND)
        codes = np.array([s.codes for s in host.frames.scans() if s.valid_mask == ALL_CHANNELS])
    # board.yaml's noise at the ADC's input, in codes.
    reference = VOLTS[5] / 4
    sigma = [20e-6 * 2**23 / reference] * 2 + [35e-6 * 2**24 / 3.3] * 3 + [25e-6 * 2**24 / 2.5]
    standard_error = 1 / math.sqrt(2 * len(codes))
    assert len(codes) > 700
    assert np.abs(codes.std(axis=0) / sigma - 1).max() < 4 * standard_error


def short_trial(elf: Path, seed: int) -> bytes:
    """Two seconds of a trial with noise and motion: all bytes that the board sends."""
    with VirtualBoard(elf, seed=seed) as board:
        for i in range(200):
            volts = (0.01 * math.sin(0.1 * i), 0.02, 1.65, 1.65, 2.31, 10.0)
            board.push_bench(BenchFrame((i + 1) * 10 * MILLISECOND, volts, 0.02 * i, 0.05 * i))
        board.run_until(50 * MILLISECOND)
        board.write(request(START, 1))
        board.run_until(2 * SECOND)
        return board.read()


def test_the_same_inputs_give_the_same_bytes(board_elf):
    first = short_trial(board_elf, seed=4)
    assert len(first) > 180 * 40
    assert short_trial(board_elf, seed=4) == first
    assert short_trial(board_elf, seed=5) != first


def test_the_board_comes_back_from_a_watchdog_reset(host):
    push_constant(host.board, VOLTS, 20 * SECOND)
    host.ask(START)
    host.stay_until(SECOND)
    host.board.reset(ResetCause.WATCHDOG)
    host.run_until(host.board.now_ns + 50 * MILLISECOND)
    boot = host.frames.of_type(BOOT)[-1]
    assert boot[1:4] == bytes([ResetCause.WATCHDOG, 2, 0])
    before = len(host.frames.scans())
    host.ask(START)
    host.stay_until(host.board.now_ns + SECOND)
    assert len(host.frames.scans()) - before > 80


def test_spi_errors_are_seen_and_marked(host):
    push_constant(host.board, VOLTS, 20 * SECOND)
    host.ask(START)
    host.stay_until(2 * SECOND)
    host.board.set_faults(spi_error_one_in=50)
    host.stay_until(6 * SECOND)
    host.board.set_faults()
    host.stay_until(8 * SECOND)  # for another health frame
    host.ask(STOP)
    injected = host.board.counters()["spi_errors_injected"]
    assert injected > 20
    invalid = sum(6 - s.valid_mask.bit_count() for s in host.frames.scans())
    # Each read is as likely hit, and costs a code if it is of a channel: six in each of 100 scans a
    # second. The others are one register read back a scan, twice a second that which was written
    # and the 39 at most that values depend on, and housekeeping's. Five deviations are given.
    share = 600 / (600 + 100 + 2 * (39 + 1) + 1)
    assert abs(invalid - share * injected) < 5 * math.sqrt(injected * share * (1 - share))
    assert invalid <= host.frames.health().spi_crc_errors <= injected
    for scan in host.frames.scans():
        for i, code in enumerate(scan.codes):
            valid = scan.valid_mask >> i & 1
            expected = expected_codes(VOLTS)[i] if valid else 0
            assert abs(code - expected) <= 0.51
