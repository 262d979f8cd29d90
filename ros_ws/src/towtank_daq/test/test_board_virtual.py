# SPDX-License-Identifier: Apache-2.0
"""The driver on the real firmware, in the virtual board without a clock."""

import importlib.util
import itertools
import math
import random
import statistics
import sys
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import pytest
from towtank_daq.board import AdcBoard, BoardError, Transport
from towtank_daq.configuration import Configuration, configuration_at
from towtank_daq.identity import NO_NUMBER, StoredIdentity
from towtank_daq.protocol_records import configure

pytestmark = pytest.mark.slow

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


class VirtualLine(Transport):
    """Transport and clock on a virtual board: reading is what makes its time pass."""

    def __init__(self, vboard, board) -> None:
        self._vboard = vboard
        self.board = board
        self.volts = VOLTS
        self.crank_rad_per_s = 2 * math.pi * CRANK_REVOLUTIONS_PER_S
        self.carriage_rad_per_s = 2 * math.pi * CARRIAGE_REVOLUTIONS_PER_S
        self.scans = []
        self.stall_ns = 0
        self.stalls = 0
        self.next_stall_ns = lambda: 0
        self._stall_at_ns = 0
        self._fed_ns = 0

    def monotonic_ns(self) -> int:
        return self.board.now_ns

    def write(self, data: bytes) -> None:
        self.board.write(data)

    def read(self, timeout_s: float) -> bytes:
        end_ns = self.board.now_ns + round(1e9 * timeout_s)
        while True:
            if self.stall_ns and self.board.now_ns >= self._stall_at_ns:
                self._run(self.board.now_ns + self.stall_ns)
                self._stall_at_ns = self.next_stall_ns()
                self.stalls += 1
            data = self.board.read()
            if data or self.board.now_ns >= end_ns:
                return data
            self._run(min(end_ns, self.board.now_ns + QUANTUM_NS))

    def _run(self, until_ns: int) -> None:
        while self.board.now_ns < until_ns:
            self._feed()
            self.board.run_until(min(until_ns, self.board.now_ns + MS))

    def read_for(self, duration_ns: int) -> bytes:
        """All that comes within this time."""
        end_ns, data = self.board.now_ns + duration_ns, b""
        while self.board.now_ns < end_ns:
            data += self.read((end_ns - self.board.now_ns) / SECOND)
        return data

    def _feed(self) -> None:
        while self._fed_ns < self.board.now_ns + 20 * MS:
            self._fed_ns += 5 * MS
            turned_s = max(0.0, self._fed_ns / SECOND - REST_S)
            self.board.push_bench(
                self._vboard.BenchFrame(
                    self._fed_ns,
                    self.volts,
                    self.crank_rad_per_s * turned_s,
                    self.carriage_rad_per_s * turned_s,
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


def test_identity_is_written_and_outlives_a_reset(vboard, protocol):
    with vboard.VirtualBoard(ELF, seed=1) as board:
        line = VirtualLine(vboard, board)
        driver = AdcBoard(line, protocol, print, print, line.monotonic_ns)
        board.run_until(20 * MS)
        assert driver.connect().calibration_id == NO_NUMBER
        assert driver.stored_identity().state == "unset"
        with pytest.raises(BoardError, match="calibration id 4294967295: give one from 0"):
            driver.store_identity(17, NO_NUMBER)
        driver.store_identity(17, 3)
        driver.reset()
        identity = driver.connect()
        assert (identity.board_serial, identity.calibration_id) == (17, 3)
        assert driver.stored_identity() == StoredIdentity("valid", 17, 3)


def test_every_scan_is_there_and_good(ten_seconds):
    """10 s of host time at 100 Hz of board time: 1000 scans, 5 more or fewer at 5000 ppm."""
    scans = ten_seconds.scans
    assert [scan.sequence for scan in scans] == list(range(len(scans)))
    assert len(scans) == pytest.approx(1000 * (1 + 1e-6 * ten_seconds.ppm), abs=2)
    counted = ten_seconds.driver.statistics
    assert (counted.scans_lost, counted.scans_bad, counted.restarts) == (0, 0, 0)
    assert (counted.frames.bad, counted.unknown_frames, counted.sync_failures) == (0, 0, 0)
    assert ten_seconds.board.counters()["conversions_out_of_range"] == 0


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
    UART's 11 bit times a byte (32 us), reading in steps of 50 us (12 us). Half a step of the
    encoder (24 us) stands on both sides, and interrupts are served within some 20 us. What varies
    comes from the first second: jitter of 20 us over the 0.45 s of the first rounds, drawn out to
    a second, is 50 us.
    """
    least, greatest = ten_seconds.clock_errors_s()
    assert -75e-6 < least <= greatest < 125e-6
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
        assert (before.count_epoch, after.count_epoch) == (1, 2)


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
        bad = [scan for scan in rig.scans if not scan.complete]
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


# -- commands


@pytest.fixture
def open_driver(vboard, protocol):
    """Starts virtual boards with a driver that has found them, still idle."""
    with ExitStack() as stack:

        def open_one(**options):
            board = stack.enter_context(vboard.VirtualBoard(ELF, **{"seed": 21} | options))
            line = VirtualLine(vboard, board)
            driver = AdcBoard(line, protocol, line.scans.append, print, line.monotonic_ns)
            line.read(0.05)
            driver.connect()
            return line, driver

        yield open_one


def test_the_configuration_outlives_power(open_driver, description, tmp_path):
    """Also into another process's virtual board, through the EEPROM's file."""
    eeprom = tmp_path / "eeprom"
    wanted = Configuration(
        rate_hz=50,
        filter_type="sinc4",
        filter_fs=9,
        gains=(1, 2, 1, 1, 1, 1),
        order=("excitation", "depressor_pressure", "accel_x"),
    )
    line, driver = open_driver(eeprom=eeprom)
    origins = description.configuration_origin
    assert driver.counters().configuration_origin == origins["default_empty"]
    assert driver.configuration() == configuration_at(description, 100)
    driver.configure(wanted)
    assert driver.counters().configuration_origin == origins["stored"]
    line.board.close()

    _, driver = open_driver(eeprom=eeprom)
    assert driver.counters().configuration_origin == origins["stored"]
    assert driver.configuration() == wanted
    assert eeprom.stat().st_size == 4096


def test_scans_follow_the_configuration(open_driver, description):
    """Order, filter and gain reach the codes: still the bench's volts, within 6 sigma, in the
    channels chosen, and nothing in the others."""
    line, driver = open_driver()
    configuration = replace(
        configuration_at(description, 50),
        filter_type="sinc4",
        gains=(2, 2, 1, 1, 1, 1),
        order=("excitation", "depressor_pressure", "accel_x"),
    )
    driver.configure(configuration)
    driver.start()
    driver.poll(1.0)
    driver.stop()
    assert len(line.scans) >= 48
    assert driver.statistics.scans_bad == 0
    for scan in line.scans:
        assert scan.valid_mask == scan.configured_mask == 0b100110
        assert (scan.codes[0], scan.codes[3], scan.codes[4]) == (0, 0, 0)
    for index in (1, 2, 5):
        channel = description.channels[index]
        convert = description.adc_channel(channel.name, VOLTS[-1], configuration.gains[index]).volts
        for scan in line.scans:
            assert convert(scan.codes[index]) == pytest.approx(
                VOLTS[index], abs=6 * channel.noise_volts / channel.gain
            )


def test_a_configuration_is_for_an_idle_board(open_driver, description):
    _, driver = open_driver()
    driver.configure(configuration_at(description, 100))
    driver.start()
    with pytest.raises(BoardError, match="refuses 'configure': not idle: another program"):
        driver.configure(configuration_at(description, 50))
    with pytest.raises(BoardError, match="refuses 'self_test': not idle"):
        driver.self_test()
    assert driver.configuration() == configuration_at(description, 100)


@pytest.mark.parametrize("after_ms", [1, 2, 20, 45, 70, 80])
def test_power_lost_while_the_configuration_is_written(
    open_driver, description, protocol, vboard, tmp_path, after_ms
):
    """The old configuration or the new one, never another; and the next one is taken."""
    old = configuration_at(description, 50)
    # Other than what its slot held in all bytes but the version and the upper ones of two u16
    new = Configuration(20, "sinc4", 7, (2,) * 6, tuple(reversed(old.order)))
    line, driver = open_driver(eeprom=tmp_path / "eeprom")
    driver.configure(old)
    driver.configure(configuration_at(description, 100))
    driver.configure(old)
    line.board.write(protocol.request(configure(new.arguments(description)), 77))
    line.read_for(after_ms * MS)
    line.board.reset(vboard.ResetCause.POWER_ON)
    line.read_for(100 * MS)
    driver.connect()
    found = driver.configuration()
    origin = protocol.configuration_origin(driver.counters().configuration_origin)
    # The request takes 1 ms on the line; 17 or 18 bytes are written, 3.4 ms each
    if after_ms == 1:
        assert (found, origin) == (old, "stored")
    elif after_ms < 17 * 3.4:
        assert (found, origin) == (old, "stored_older")
    else:
        assert (found, origin) in [(old, "stored_older"), (new, "stored")]
    driver.configure(new)
    assert driver.configuration() == new


def test_self_test_of_a_sound_board(open_driver, description):
    """Offset and test voltage are exact in the model, up to the mean of 8 conversions' noise of
    20 uV (7 uV, halved in the 20 mV by the gain of 32); REFIN1 is 10 V / 4; the deflections are
    board.yaml's, less the 0.4 % that the pole holds back and 4 sigma of two means of 35 uV."""
    _, driver = open_driver()
    report = driver.self_test()
    found = {check.name: check.value for check in report.checks}
    assert report.passed, [str(check) for check in report.failures]
    assert found["ADC offset, input shorted"] == pytest.approx(0.0, abs=4 * 7e-6)
    assert found["ADC test voltage"] == pytest.approx(0.020, abs=1e-6)
    assert found["ADC supply"] == pytest.approx(3.3, abs=1e-5)
    assert found["reference REFIN1"] == pytest.approx(2.5, abs=1e-5)
    for axis, volts in (("accel_x", 0.05), ("accel_y", 0.05), ("accel_z", 0.06)):
        deflection = found[f"{axis} deflection by its self-test"]
        assert deflection == pytest.approx(0.996 * volts, abs=4e-3 * volts + 70e-6)


def test_scans_after_a_self_test_hold_nothing_of_it(open_driver, description):
    line, driver = open_driver(noise_volts=0.0)
    assert driver.self_test().passed
    driver.configure(configuration_at(description, 100))
    driver.start()
    driver.poll(0.2)
    convert = description.adc_channel("accel_x", VOLTS[-1]).volts
    assert convert(line.scans[0].codes[2]) == pytest.approx(VOLTS[2], abs=1e-6)


def test_self_test_finds_what_is_wrong(open_driver):
    line, driver = open_driver(self_test_volts=(0, 0, 0, 0.05, 0.05, 0))
    (failure,) = driver.self_test().failures
    assert failure.name == "accel_x deflection by its self-test"
    assert "check the accelerometer's supply" in str(failure)

    line.volts = (*VOLTS[:5], 0.0)  # no excitation
    line.read_for(400 * MS)
    names = [check.name for check in driver.self_test().failures]
    assert names == ["reference REFIN1", "accel_x deflection by its self-test"]

    line.board.set_faults(adc_silent=True)
    (failure,) = driver.self_test().failures
    assert str(failure).startswith("ADC answers: 0 (1 to 1): check the ADC's 3.3 V supply")

    line.board.set_faults(spi_error_one_in=10)
    assert "SPI errors" in [check.name for check in driver.self_test().failures]


@pytest.mark.parametrize("streaming", [False, True])
def test_reset_by_command(open_driver, description, protocol, streaming):
    line, driver = open_driver()
    driver.configure(configuration_at(description, 50))
    if streaming:
        driver.start()
        driver.poll(0.3)
    driver.reset()
    health = driver.counters()
    assert protocol.reset_causes(health.reset_cause) == "command"
    assert health.boot_count == 2
    assert health.state == description.board_state["idle"]
    assert driver.configuration().rate_hz == 50
    driver.start()
    driver.poll(0.3)
    driver.stop()
    assert driver.statistics.scans_lost == 0
    assert line.board.counters()["resets"] == 1


def test_counters_and_time_at_any_time(open_driver, description):
    _, driver = open_driver()
    driver.configure(configuration_at(description, 200))
    driver.start()
    driver.poll(1.0)
    counters = driver.counters()
    assert counters.state == description.board_state["streaming"]
    assert counters.scans_scheduled in range(199, 204)
    exchange = driver.board_time()
    middle = (exchange.board_received + exchange.board_sent) // 2
    assert driver.clock.host_ns(middle) == pytest.approx(
        (exchange.sent_ns + exchange.received_ns) / 2, abs=1e6
    )


# -- load


def test_200_scans_a_second_with_both_encoders_at_20_000_edges_a_second(
    vboard, protocol, description
):
    """20 s: 4000 scans, 20 health frames, 60 sync exchanges, 800 000 edges: no scan is lost, cut
    short or bad, no edge is lost, and each count is that of its instant. The rates are a little
    more, and odd: the edges fall on every phase of the scan and of each other."""
    rates = (20_013.7, -20_041.3)
    turns = [2 * math.pi * rate / COUNTS for rate in rates]
    with vboard.VirtualBoard(ELF, seed=31) as board:
        line = VirtualLine(vboard, board)
        line.crank_rad_per_s, line.carriage_rad_per_s = turns
        driver = AdcBoard(line, protocol, line.scans.append, print, line.monotonic_ns)
        line.read(0.05)
        driver.connect()
        driver.configure(configuration_at(description, 200))
        driver.start()
        driver.poll(20.0)
        driver.stop()
        health = driver.counters()
        counted = driver.statistics
        assert counted.scans_scheduled == pytest.approx(4000, abs=3)
        assert (counted.scans_lost, counted.scans_bad, counted.restarts) == (0, 0, 0)
        assert (counted.frames.bad, counted.unknown_frames, counted.sync_failures) == (0, 0, 0)
        assert [scan.sequence for scan in line.scans] == list(range(len(line.scans)))
        assert {scan.flags for scan in line.scans} == {0}
        assert (health.missed_ticks, health.scan_overruns, health.dropped_frames) == (0, 0, 0)
        assert (health.illegal_steps, health.rx_overflows) == (0, 0)
        counters = board.counters()
        assert min(counters["crank_edges"], counters["carriage_edges"]) > 20 * 20_000
        first = line.scans[0]
        for scan in line.scans:
            # One count for where the first tick fell between two, one for an edge whose interrupt
            # waits while the tick's runs
            elapsed_s = (scan.ticks - first.ticks) / 2e6
            assert scan.crank - first.crank == pytest.approx(rates[0] * elapsed_s, abs=2)
            assert scan.carriage - first.carriage == pytest.approx(rates[1] * elapsed_s, abs=2)


def test_stamps_through_drift_and_stalls(vboard, protocol):
    """95 % within 0.2 ms of the truth: the board's clock 5000 ppm fast and drifting by 50 ppm a
    minute (in steps of half a second, 0.4 ppm each); the host held up for 20 ms at random, twice a
    second. The truth is the evenly turning shaft, to half a step (24 us)."""
    source = random.Random(3)
    with vboard.VirtualBoard(ELF, clock_ppm=5000.0, seed=12) as board:
        rig = Rig(vboard, board, protocol)
        rig.line.stall_ns = 20 * MS
        rig.line.next_stall_ns = lambda: board.now_ns + round(source.expovariate(2.0) * SECOND)
        for step in range(120):
            board.set_clock_ppm(5000.0 + 50.0 * step / 120)
            rig.driver.poll(0.5)
        rig.driver.stop()
        assert rig.driver.statistics.scans_lost == 0
        assert rig.line.stalls > 80
        rate = COUNTS * CARRIAGE_REVOLUTIONS_PER_S
        errors = [
            abs(scan.stamp_ns / SECOND - REST_S - (scan.carriage + 0.5) / rate)
            for scan in rig.scans
        ]
        assert len(errors) > 6000
        of_95 = sorted(errors)[round(0.95 * len(errors))]
        assert of_95 < 0.2e-3
        assert of_95 < rig.driver.clock.u95_s < 0.2e-3
        assert max(errors) < 0.5e-3
