# SPDX-License-Identifier: Apache-2.0
"""The driver on the real firmware, in the virtual board without a clock."""

import importlib.util
import itertools
import math
import statistics
import sys
from pathlib import Path

import pytest
from towtank_daq.board import AdcBoard
from towtank_daq.configuration import configuration_at

ROOT = Path(__file__).parents[4]
ELF = ROOT / "build" / "firmware" / "towtank_board.elf"
VOLTS = (0.016, 0.020, 1.60, 1.70, 2.31, 10.0)  # at the terminals
CRANK_REVOLUTIONS_PER_S = 1.25
CARRIAGE_REVOLUTIONS_PER_S = 5.0
COUNTS = 4096  # per revolution
REST_S = 0.1  # both shafts stand still until then
QUANTUM_NS = 50_000  # how finely the line is looked at
SECOND = 1_000_000_000
MS = 1_000_000


@pytest.fixture(scope="module")
def vboard():
    """The virtual board's Python module, which is not part of any package."""
    path = ROOT / "firmware" / "vboard" / "vboard.py"
    spec = importlib.util.spec_from_file_location("towtank_vboard", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


class VirtualLine:
    """Transport and clock on a virtual board: reading is what makes its time pass."""

    def __init__(self, vboard, board) -> None:
        self._vboard = vboard
        self.board = board
        self._fed_ns = 0

    def monotonic_ns(self) -> int:
        return self.board.now_ns

    def write(self, data: bytes) -> None:
        self.board.write(data)

    def read(self, timeout_s: float) -> bytes:
        end_ns = self.board.now_ns + round(1e9 * timeout_s)
        while True:
            data = self.board.read()
            if data or self.board.now_ns >= end_ns:
                return data
            self._feed()
            self.board.run_until(min(end_ns, self.board.now_ns + QUANTUM_NS))

    def _feed(self) -> None:
        while self._fed_ns < self.board.now_ns + 20 * MS:
            self._fed_ns += 5 * MS
            turned_s = max(0.0, self._fed_ns / SECOND - REST_S)
            self.board.push_bench(
                self._vboard.BenchFrame(
                    self._fed_ns,
                    VOLTS,
                    2 * math.pi * CRANK_REVOLUTIONS_PER_S * turned_s,
                    2 * math.pi * CARRIAGE_REVOLUTIONS_PER_S * turned_s,
                )
            )


class Rig:
    """A virtual board with the driver on it, streaming at 100 Hz."""

    def __init__(self, vboard, board, protocol) -> None:
        self.board = board
        self.line = VirtualLine(vboard, board)
        self.scans = []
        self.warnings = []
        self.driver = AdcBoard(
            self.line, protocol, self.scans.append, self.warnings.append, self.line.monotonic_ns
        )
        board.run_until(20 * MS)  # the board has been switched on a moment before
        self.identity = self.driver.connect()
        self.driver.configure(configuration_at(protocol.board, 100))
        self.driver.start()

    def clock_errors_s(self) -> tuple[float, float]:
        """Bounds of the stamps' errors: count n holds from n to n + 1 steps of the even turn."""
        rate = COUNTS * CARRIAGE_REVOLUTIONS_PER_S
        errors = [
            scan.stamp_ns / SECOND - REST_S - (scan.carriage + 0.5) / rate for scan in self.scans
        ]
        return min(errors), max(errors)


@pytest.fixture(scope="module", params=[0.0, 5000.0, -5000.0], ids=lambda ppm: f"{ppm:+.0f}ppm")
def ten_seconds(request, vboard, protocol):
    """A run of 10 s that several tests look at."""
    with vboard.VirtualBoard(ELF, clock_ppm=request.param, seed=11) as board:
        rig = Rig(vboard, board, protocol)
        rig.driver.poll(10.0)
        rig.driver.stop()
        rig.ppm = request.param
        yield rig


def test_identity(ten_seconds, protocol):
    assert ten_seconds.identity.schema_hash == protocol.board.schema_hash
    assert ten_seconds.identity.adc_id >> 4 == 1  # the AD7124 family


def test_every_scan_is_there_and_good(ten_seconds):
    """10 s of host time at 100 Hz of board time: 1000 scans, 5 more or fewer at 5000 ppm."""
    scans = ten_seconds.scans
    assert [scan.sequence for scan in scans] == list(range(len(scans)))
    assert len(scans) == pytest.approx(1000 * (1 + 1e-6 * ten_seconds.ppm), abs=2)
    counted = ten_seconds.driver.statistics
    assert (counted.scans_lost, counted.scans_bad, counted.restarts) == (0, 0, 0)
    assert (counted.frames.bad, counted.unknown_frames, counted.sync_failures) == (0, 0, 0)


def test_scans_lie_evenly_in_board_time(ten_seconds):
    ticks = [scan.ticks for scan in ten_seconds.scans]
    assert {b - a for a, b in itertools.pairwise(ticks)} == {20_000}


def test_codes_are_the_bench_volts_within_their_noise(ten_seconds, description):
    """Mean within five standard errors of the truth, scatter within 15 % of the nominal noise
    (its own relative standard error over 1000 scans is 2 %; quantisation is far below)."""
    scans = ten_seconds.scans
    for index, channel in enumerate(description.channels):
        convert = description.adc_channel(channel.name, VOLTS[-1]).volts
        volts = [float(convert(scan.codes[index])) for scan in scans]
        sigma = channel.noise_volts / channel.gain
        assert statistics.fmean(volts) == pytest.approx(
            VOLTS[index], abs=5 * sigma / math.sqrt(len(volts))
        )
        assert statistics.pstdev(volts) == pytest.approx(sigma, rel=0.15)


def test_encoder_counts_are_exact(ten_seconds):
    """Both shafts started from rest together and turn in a fixed ratio: at each scan the slow
    count lies within one step of its share of the fast one (which leads it by less than one)."""
    ratio = CRANK_REVOLUTIONS_PER_S / CARRIAGE_REVOLUTIONS_PER_S
    for scan in ten_seconds.scans:
        assert -1 <= scan.crank - ratio * scan.carriage <= 1
    seconds = (ten_seconds.scans[-1].ticks - ten_seconds.scans[0].ticks) / 2e6
    true_s = seconds / (1 + 1e-6 * ten_seconds.ppm)
    turned = ten_seconds.scans[-1].carriage - ten_seconds.scans[0].carriage
    assert turned == pytest.approx(COUNTS * CARRIAGE_REVOLUTIONS_PER_S * true_s, abs=1.5)


def test_stamps_are_the_sampling_instants(ten_seconds):
    """All stamps of ten seconds, the first included, against the evenly turning shaft.

    What biases the map, by half of what the answer is held up more than the request: the emulated
    UART's 11 bit times a byte (34 us), the coding of the answer after its stamp was taken (some
    200 us: 100 us), reading in steps of 50 us (12 us). Half a step of the encoder (24 us) stands
    on both sides, and interrupts are served within some 20 us. What varies comes from the first
    second: jitter of 20 us over the 0.45 s of the first rounds, drawn out to a second, is 50 us.
    """
    least, greatest = ten_seconds.clock_errors_s()
    assert -50e-6 < least <= greatest < 250e-6
    assert greatest - least < 2 * 24.4e-6 + 2 * 50e-6
    assert ten_seconds.driver.clock.rate_ppm == pytest.approx(ten_seconds.ppm, abs=10.0)
    assert ten_seconds.driver.clock.residual_s < 50e-6


def test_latency_is_the_scan_and_the_wire(vboard, protocol):
    """The scan takes 6.55 ms, its frame of 45 bytes 2.0 ms at 11 bit times a byte; the firmware
    gets 1 ms to fetch the last conversion and to code the frame."""
    with vboard.VirtualBoard(ELF, seed=1) as board:
        line = VirtualLine(vboard, board)
        latencies = []
        driver = AdcBoard(
            line,
            protocol,
            lambda scan: latencies.append(line.monotonic_ns() - scan.stamp_ns),
            print,
            line.monotonic_ns,
        )
        driver.connect()
        driver.configure(configuration_at(protocol.board, 100))
        driver.start()
        driver.poll(1.0)
    assert len(latencies) >= 98
    assert 8.0 * MS < statistics.median(latencies) < 9.6 * MS


def test_watchdog_reset_in_mid_run(vboard, protocol):
    with vboard.VirtualBoard(ELF, seed=5) as board:
        rig = Rig(vboard, board, protocol)
        rig.driver.poll(2.0)
        board.reset(vboard.ResetCause.WATCHDOG)
        rig.driver.poll(4.0)
        rig.driver.stop()
        pairs = itertools.pairwise(rig.scans)
        ((before, after),) = [(a, b) for a, b in pairs if b.sequence != a.sequence + 1]
        gap = after.sequence - before.sequence
        assert gap == round((after.stamp_ns - before.stamp_ns) / (10 * MS))
        assert rig.driver.statistics.scans_lost == gap - 1
        assert rig.driver.statistics.restarts == 1
        assert rig.warnings[0].startswith("the board was reset (watchdog)")
        # counts go on from the last known one, less what the shaft turned while the board was down
        assert before.carriage <= after.carriage


def test_bit_errors_on_the_line(vboard, protocol):
    """One bit in ten thousand flips both ways: frames are lost, their number is known, and none
    that arrives is wrong."""
    with vboard.VirtualBoard(ELF, seed=6) as board:
        rig = Rig(vboard, board, protocol)
        board.set_faults(serial_bit_error_rate=1e-4)
        rig.driver.poll(10.0)
        board.set_faults()
        rig.driver.stop()
        counted = rig.driver.statistics
        assert counted.frames.bad > 10  # 45 bytes of 8 bits: 3.5 % of 1000 frames
        assert counted.restarts == 0
        assert counted.scans_scheduled == pytest.approx(1000, abs=2)
        first = rig.scans[0]
        for scan in rig.scans:
            assert scan.ticks == first.ticks + 20_000 * (scan.sequence - first.sequence)
            assert scan.codes[5] == pytest.approx(2**24 * 0.8, rel=1e-3)  # 10 V / 5 / 2.5 V


def test_scans_that_the_board_cannot_read_are_counted_as_bad(vboard, protocol):
    with vboard.VirtualBoard(ELF, seed=7) as board:
        rig = Rig(vboard, board, protocol)
        board.set_faults(spi_error_one_in=200)
        rig.driver.poll(5.0)
        rig.driver.stop()
        bad = [scan for scan in rig.scans if scan.valid_mask != protocol.board.all_valid]
        assert len(bad) > 3
        assert rig.driver.statistics.scans_bad == len(bad)
        assert rig.driver.statistics.scans_lost == 0
        assert all(
            scan.codes[i] == 0 for scan in bad for i in range(6) if not scan.valid_mask >> i & 1
        )


def test_silent_adc_is_named(vboard, protocol):
    with vboard.VirtualBoard(ELF, seed=8) as board:
        board.set_faults(adc_silent=True)
        with pytest.raises(Exception, match="refuses 'start': adc fault"):
            Rig(vboard, board, protocol)
