# SPDX-License-Identifier: Apache-2.0
"""The acquisition under the faults of a wet laboratory: none loses or invents a sample unmarked.

The real firmware and the driver run in the virtual board without a clock. The terminals' volts rise
steadily and both shafts turn evenly, so that every code and count tells the instant at which it was
true: each scan that arrives is held against its own stamp, and each one that does not must be in
the account of the lost.

Two faults of the campaign have their tests elsewhere: sensor open and short in
test_sensor_faults.py, a full disk under a whole trial in test_bad_input.py.
"""

from __future__ import annotations

import functools
import itertools
import math
import os
import pty
import subprocess
import termios
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import pytest
from offline_trial import ELF
from towtank_daq.board import AdcBoard, BoardError, NoAnswer, Scan
from towtank_daq.configuration import configuration_at
from towtank_daq.description import installed_description, load_description
from towtank_daq.protocol import Protocol
from towtank_daq.serial_port import SerialPort, SerialPortError
from vboard import Bootloader, ResetCause, VirtualBoard
from virtual_line import COUNTS, MS, SECOND, TerminalLine, VirtualLine

BOARD = load_description(installed_description())
PERIOD_NS = 10 * MS
REVOLUTIONS_PER_S = (0.5, 2.0)  # crank, carriage
EXCITATION = 5

# Of the terminals, by channel: V at the start, V/s. A code's step is 37 µs of a bridge's ramp and
# 15 µs of an accelerometer's; the excitation stands, for the bridges' codes are shares of it.
RAMPS = ((2e-3, 2e-4), (3e-3, 2e-4), (1.0, 0.01), (1.1, 0.01), (1.2, 0.01), (10.0, 0.0))

# A stamp is good to 0.25 ms (test_board_virtual.py); two of them, and the steps of the codes
AGREE_S = 0.6e-3


@dataclass
class Run:
    """A board that streams at 100 Hz with the driver on it; everything that came of it."""

    board: VirtualBoard
    line: VirtualLine
    scans: list[Scan] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    protocol: Protocol = field(default_factory=lambda: Protocol(BOARD))

    def __post_init__(self) -> None:
        self.driver = AdcBoard(
            self.line,
            self.protocol,
            self.scans.append,
            self.warnings.append,
            self.line.monotonic_ns,
        )

    def begin(self) -> None:
        self.line.run(20 * MS)
        self.driver.connect()
        self.driver.configure(configuration_at(BOARD, 100))
        self.driver.start()
        self.driver.poll(3.0)
        self.late_s = [self.told_s(self.scans[-1], i) for i in range(EXCITATION)]

    def told_s(self, scan: Scan, channel: int) -> float:
        """By how much the instant that a code tells lies behind the scan's stamp."""
        start, slope = RAMPS[channel]
        adc = BOARD.adc_channel(BOARD.channel_names[channel], RAMPS[EXCITATION][0])
        return (float(adc.volts(scan.codes[channel])) - start) / slope - scan.stamp_ns / SECOND

    @property
    def gaps(self) -> list[tuple[Scan, Scan]]:
        pairs = itertools.pairwise(self.scans)
        return [(a, b) for a, b in pairs if b.sequence != a.sequence + 1]

    @property
    def bad(self) -> list[Scan]:
        return [scan for scan in self.scans if not scan.complete]

    @property
    def gap_s(self) -> float:
        """The one gap's length."""
        ((before, after),) = self.gaps
        return (after.sequence - before.sequence) / 100

    def end(self) -> None:
        """Stop, and hold all that came against the truth."""
        self.driver.stop()
        counted = self.driver.statistics
        sequences = [scan.sequence for scan in self.scans]
        assert sequences == sorted(set(sequences)), "a scan came twice or late"
        assert counted.scans_received == len(self.scans)
        missing = sum(b.sequence - a.sequence - 1 for a, b in self.gaps)
        at_the_end = counted.scans_scheduled - 1 - sequences[-1]
        assert counted.scans_lost == sequences[0] + missing + at_the_end
        assert counted.scans_bad == len(self.bad)
        first = self.scans[0]
        for scan in self.scans:
            # Numbers are instants: to the stamps' error, and half a period more where a board that
            # was started anew fell between two ticks of the old stream
            phase_s = (scan.stamp_ns - first.stamp_ns - scan.sequence * PERIOD_NS) / SECOND
            between_s = 0.5 * PERIOD_NS / SECOND if counted.restarts else 0.0
            assert abs(phase_s) < between_s + AGREE_S
            for channel, late_s in enumerate(self.late_s):
                if scan.valid_mask >> channel & 1:
                    assert self.told_s(scan, channel) == pytest.approx(late_s, abs=AGREE_S)
                else:
                    assert scan.codes[channel] == 0, "an invalid channel has a value"
            # Without noise it stands, but for the rounding of its filtered volts
            if scan.valid_mask >> EXCITATION & 1:
                assert abs(scan.codes[EXCITATION] - first.codes[EXCITATION]) <= 1

    def assert_carriage_counts_are_of_their_instants(self) -> None:
        assert len({scan.count_epoch for scan in self.scans}) == 1
        self._assert_carriage_counts(self.scans)

    def assert_counts_begin_a_new_epoch(self) -> None:
        """At the gap; within each of the two epochs every count is true."""
        ((before, after),) = self.gaps
        assert before.count_epoch != after.count_epoch
        for epoch in (before.count_epoch, after.count_epoch):
            self._assert_carriage_counts([s for s in self.scans if s.count_epoch == epoch])
        assert {s.count_epoch for s in self.scans} == {before.count_epoch, after.count_epoch}
        missed = COUNTS * REVOLUTIONS_PER_S[1] * (after.stamp_ns - before.stamp_ns) / SECOND
        assert abs(after.carriage - before.carriage - missed) > COUNTS

    def _assert_carriage_counts(self, scans: list[Scan]) -> None:
        first = scans[0]
        rate = COUNTS * REVOLUTIONS_PER_S[1]
        for scan in scans:
            turned = rate * (scan.stamp_ns - first.stamp_ns) / SECOND
            assert scan.carriage - first.carriage == pytest.approx(turned, abs=2 + rate * AGREE_S)


def line_of(board: VirtualBoard, dtr_resets: bool = False) -> VirtualLine:
    return VirtualLine(board, RAMPS, REVOLUTIONS_PER_S, dtr_resets)


@pytest.fixture
def run() -> Iterator[Run]:
    with VirtualBoard(ELF, seed=41, noise_volts=0.0) as board:
        started = Run(board, line_of(board))
        started.begin()
        yield started


def test_spi_crc_errors(run):
    """One ADC transaction in a thousand has a bit flipped; a damaged conversion is a channel of a
    scan that is not valid, and nothing else."""
    run.board.set_faults(spi_error_one_in=1000)
    run.driver.poll(20.0)
    run.board.set_faults()
    run.end()
    channels = sum(6 - scan.valid_mask.bit_count() for scan in run.bad)
    health = run.driver.counters()
    assert 3 < channels <= run.board.counters()["spi_errors_injected"]
    assert health.spi_crc_errors + health.adc_sequence_errors >= channels
    assert run.gaps == []


def test_adc_that_stops_answering(run):
    """For two seconds: scans come with their encoder counts and no valid channel."""
    run.board.set_faults(adc_silent=True)
    run.driver.poll(2.0)
    run.board.set_faults()
    run.driver.poll(2.0)
    run.end()
    run.assert_carriage_counts_are_of_their_instants()
    assert 190 < len(run.bad) < 215
    assert run.gaps == [] and run.scans[-1].complete


def assert_marked_in_a_row(run: Run, most: int) -> None:
    """The scans without all channels: not too many, none between whole ones, each with a flag."""
    bad = [scan.sequence for scan in run.bad]
    assert bad == list(range(bad[0], bad[0] + len(bad))) and len(bad) <= most
    assert all(scan.flags for scan in run.bad)
    assert not any(scan.flags for scan in run.scans if scan.complete)


def test_adc_resets_alone(run):
    """Its supply dips while the controller's does not: a scan cut short, two without any channel,
    and the one in which it is set up anew; at most one more for where the dip falls."""
    run.line.run(run.board.now_ns + 3 * MS)
    run.board.dip_adc_supply()
    run.driver.poll(2.0)
    run.end()
    run.assert_carriage_counts_are_of_their_instants()
    assert run.gaps == [] and run.driver.statistics.restarts == 0
    assert_marked_in_a_row(run, 5)
    health = run.driver.counters()
    assert (health.adc_restarts, health.adc_error_bits) == (1, BOARD.adc_error["power_on"])
    told, tells = run.warnings
    assert told.startswith("the ADC had lost its settings and was set up anew: ")
    assert tells == "the ADC tells of power on: check its 3.3 V supply"


def test_adc_without_supply_for_three_seconds(run):
    run.board.set_faults(adc_silent=True)
    run.driver.poll(3.0)
    run.board.dip_adc_supply()
    run.board.set_faults()
    run.driver.poll(2.0)
    run.end()
    run.assert_carriage_counts_are_of_their_instants()
    assert run.gaps == [] and run.driver.statistics.restarts == 0
    assert_marked_in_a_row(run, 300 + 13)  # set-ups are begun 0.1 s apart and take 10 ms
    assert run.warnings[0].startswith("the ADC has given nothing for 1 s")
    assert run.warnings[1].startswith("the ADC had lost its settings and was set up anew")


READ_ONLY = {0x00, 0x02, 0x05, 0x06, 0x08}


def test_a_flipped_bit_in_each_register_of_the_adc(run):
    """One of each, at any instant of a scan (every bit of each: firmware/tests/test_scan.c). Found
    within the scan or the next, at most; none of these spoils a value unmarked (the last conversion
    of a scan is what one may spoil: firmware/protocol/README.md). The check of the chip
    itself is what its own bit turns off: that is read back."""
    random = np.random.default_rng(5)
    for address in sorted(set(range(0x01, 0x39)) - READ_ONLY):
        width = 16 if address in (0x01, 0x04) or 0x09 <= address < 0x21 else 24
        bit = 1 if address == 0x07 else int(random.integers(width))
        run.line.run(run.board.now_ns + int(random.integers(10 * MS)))
        before, first = run.driver.counters().adc_restarts, len(run.scans)
        run.board.flip_adc_bit(address, bit)
        run.driver.poll(0.65 if address == 0x07 else 0.13)
        assert run.driver.counters().adc_restarts == before + 1, hex(address)
        assert len([scan for scan in run.scans[first:] if scan in run.bad]) <= 5
        assert run.scans[-1].complete
    run.end()
    assert all(scan.flags for scan in run.bad)
    assert run.gaps == [] and run.driver.statistics.restarts == 0
    assert BOARD.adc_error["register_checksum"] & run.driver.counters().adc_error_bits


CONVERSION_NS = (3 * 32 * 6 + 95) * SECOND // 614_400
# Behind the tick: the last channel's end, with its read-out and the frame, 0.3 to 0.5 ms, still to
# come before the write; or just before the end of housekeeping's conversion. So near to the write
# that the chip, which looks 2400 times a second, does not look in between.
BEFORE_THE_WRITE_NS = {1: 6 * CONVERSION_NS + 150_000, 2: 7 * CONVERSION_NS - 100_000}


def test_a_bit_that_a_write_hides_from_the_adc_spoils_no_scan_unmarked(run):
    """Once a second a write lets the ADC convert housekeeping behind the scan after the health
    frame's, and another ends that a scan later. A bit that flips just before is in the checksum
    that the chip makes at the write: nothing but reading back finds it. Here the gain of each
    channel is doubled so."""
    for slot in range(6):
        known = run.driver.health
        while run.driver.health is known:
            run.driver.poll(2e-3)
        write = 1 + slot % 2
        tick_ns = run.scans[-1].stamp_ns + write * PERIOD_NS
        run.line.run(tick_ns + BEFORE_THE_WRITE_NS[write])
        run.board.flip_adc_bit(0x19 + slot, 0)
        run.driver.poll(0.15)
        health = run.driver.counters()
        assert health.adc_restarts == slot + 1
        assert health.adc_error_bits & BOARD.adc_error["register_checksum"] == 0, "not hidden"
    run.end()
    assert all(scan.flags for scan in run.bad)
    assert run.gaps == [] and run.driver.statistics.restarts == 0
    assert "the last value of the one before may be wrong" in run.warnings[0]


@pytest.mark.parametrize("goes_on", [False, True])
def test_sync_begins_the_sequence_anew_or_lets_it_go_on(goes_on):
    with VirtualBoard(ELF, seed=43, noise_volts=0.0, sync_goes_on=goes_on) as board:
        run = Run(board, line_of(board))
        run.begin()
        run.driver.poll(3.0)
        assert run.bad == [] and not any(scan.flags for scan in run.scans)
        board.dip_adc_supply()
        run.driver.poll(1.0)
        run.end()
        assert_marked_in_a_row(run, 5)
        health = run.driver.counters()
        assert health.adc_sequence_errors == 0
        assert health.supply_code and health.adc_temperature_code


def test_bit_errors_on_the_line(run):
    run.board.set_faults(serial_bit_error_rate=1e-4)
    run.driver.poll(10.0)
    run.board.set_faults()
    run.end()
    assert run.driver.statistics.scans_lost > 10  # 1000 frames of 45 bytes: 36 are expected
    assert run.driver.statistics.restarts == 0


def test_bytes_dropped_and_doubled(run):
    run.board.set_faults(serial_byte_drop_rate=1e-3, serial_byte_double_rate=1e-3)
    run.driver.poll(10.0)
    run.board.set_faults()
    run.end()
    counters = run.board.counters()
    # Of 1000 data frames of 45 bytes, and others; five deviations of 45 leave 11
    assert min(counters["serial_bytes_dropped"], counters["serial_bytes_doubled"]) > 11
    assert run.driver.statistics.scans_lost > 45


@pytest.mark.parametrize("port", ["stays", "vanishes"])
def test_cable_pulled_for_two_seconds(run, port):
    """The board runs on; its numbers then tell to the scan what is missing."""
    if port == "stays":
        run.board.set_faults(serial_byte_drop_rate=1.0)
        run.driver.poll(2.0)
        run.board.set_faults()
    else:
        run.line.unplug(2.0)
    run.driver.poll(4.0)
    run.end()
    ((before, after),) = run.gaps
    assert 198 <= after.sequence - before.sequence <= 205
    assert run.driver.statistics.restarts == 0
    assert run.driver.statistics.reconnections == (port == "vanishes")
    run.assert_carriage_counts_are_of_their_instants()


def test_port_vanishes_until_the_board_has_gone_idle(run):
    """Without a host for 5 s the board ends its stream, which is then started again."""
    run.line.unplug(8.0)
    run.driver.poll(12.0)
    run.end()
    ((before, after),) = run.gaps
    assert 8.0 < (after.sequence - before.sequence) / 100 < 10.0
    assert run.driver.statistics.restarts == 1
    run.assert_carriage_counts_are_of_their_instants()  # it counts on while idle


def test_power_goes_with_the_port(run):
    """Neither boot frame nor boot count tell of it: the board's time does."""
    run.line.unplug(2.0)
    run.driver.poll(1.0)
    run.board.reset(ResetCause.POWER_ON)
    run.driver.poll(6.0)
    run.end()
    assert len(run.gaps) == 1
    assert run.driver.statistics.restarts == 1
    run.assert_counts_begin_a_new_epoch()


def test_port_that_does_not_come_back(run):
    run.line.unplug(60.0)
    with pytest.raises(SerialPortError, match="is gone: plug the board in"):
        run.driver.poll(60.0)
    assert run.warnings == [
        "port board is gone: plug the board in and configure again; waiting for it 30 s"
    ]


def test_board_that_falls_silent_and_comes_back(run):
    """Silent for 10 s: its cable is out, but the adapter's port is there."""
    run.board.set_faults(serial_byte_drop_rate=1.0)
    run.driver.poll(10.0)
    run.board.set_faults()
    run.driver.poll(12.0)
    run.end()
    assert run.driver.statistics.restarts == 1
    assert len(run.gaps) == 1
    assert run.warnings[0].startswith("the board has sent nothing for 2.5 s")


@pytest.mark.parametrize("cause", [ResetCause.WATCHDOG, ResetCause.BROWN_OUT])
def test_reset_in_the_run(run, cause):
    run.board.reset(cause)
    run.driver.poll(5.0)
    run.end()
    assert len(run.gaps) == 1
    assert run.driver.statistics.restarts == 1
    run.assert_counts_begin_a_new_epoch()
    name = {ResetCause.WATCHDOG: "watchdog", ResetCause.BROWN_OUT: "brown out"}[cause]
    assert run.warnings[0].replace("_", " ").startswith(f"the board was reset ({name}")


# -- a board with Arduino's bootloader, which every reset starts


@pytest.fixture
def mega(request) -> Iterator[Run]:
    """A Mega as it is shipped; with the parameter False, one whose DTR resets nothing."""
    with VirtualBoard(ELF, seed=41, noise_volts=0.0, bootloader=Bootloader.SHIPPED) as board:
        started = Run(board, line_of(board, dtr_resets=getattr(request, "param", True)))
        started.begin()
        yield started


@pytest.mark.parametrize(
    "cause", [ResetCause.EXTERNAL, ResetCause.BROWN_OUT, ResetCause.WATCHDOG], ids=lambda c: c.name
)
@pytest.mark.parametrize("mega", [False], indirect=True, ids=["no DTR"])
def test_reset_of_a_shipped_board(mega, cause):
    """The driver is quiet until the firmware is up, 0.93 s later, finds and configures it in 0.1 s,
    and learns its clock for half a second: of 6000 scans, 5800 are there. No DTR is needed."""
    mega.board.reset(cause)
    mega.driver.poll(4.0)
    mega.end()
    print(f"\n{cause.name.lower()}: no scans for {mega.gap_s:.2f} s")
    assert mega.gap_s < 2.0
    assert (mega.driver.statistics.restarts, mega.driver.statistics.reconnections) == (1, 0)
    mega.assert_counts_begin_a_new_epoch()
    assert len(mega.warnings) == 1
    assert mega.warnings[0].startswith("the board was reset (")


def test_no_request_falls_into_the_bootloaders_window(mega):
    """Resets at seven phases of the exchange of times, which is three requests a second."""
    for phase in range(7):
        mega.driver.poll(0.3 + 0.15 * phase)
        reset_ns = mega.board.now_ns
        mega.board.reset(ResetCause.EXTERNAL)
        mega.driver.poll(1.6)
        after_s = [(at_ns - reset_ns) / SECOND for at_ns in mega.line.written_ns]
        assert not [s for s in after_s if 0.065 <= s < 0.915]
    mega.driver.poll(1.0)
    mega.end()
    assert mega.driver.statistics.restarts == 7


@pytest.mark.parametrize("woken_s", [0.1, 0.5, 0.9])
def test_a_host_that_was_held_up_over_a_reset_says_nothing_to_the_bootloader(mega, woken_s):
    """Frames of before the reset wait in the port: they are no sign of a board that hears."""
    reset_ns = mega.board.now_ns + SECOND
    mega.line.after(1.0, lambda: mega.board.reset(ResetCause.EXTERNAL))
    mega.line.run(reset_ns + round(woken_s * SECOND))
    mega.driver.poll(4.0)
    mega.end()
    after_s = [(at_ns - reset_ns) / SECOND for at_ns in mega.line.written_ns]
    assert not [s for s in after_s if 0.0 <= s < 0.915]
    assert mega.gap_s < 2.0
    assert (mega.driver.statistics.restarts, mega.driver.statistics.reconnections) == (1, 0)
    mega.assert_counts_begin_a_new_epoch()


@pytest.mark.parametrize(
    ("mega", "at_most_s"), [(True, 5.0), (False, 11.0)], indirect=["mega"], ids=["DTR", "no DTR"]
)
def test_a_bootloader_that_is_held(mega, at_most_s):
    """A byte from somebody: nine seconds, unless DTR ends them. Silence is known after 2.5 s."""
    mega.line.after(0.3, lambda: mega.board.write(b"A"))
    mega.board.reset(ResetCause.EXTERNAL)
    mega.driver.poll(12.0)
    mega.end()
    print(f"\nbootloader held: no scans for {mega.gap_s:.2f} s")
    assert 2.5 < mega.gap_s < at_most_s
    assert mega.driver.statistics.restarts == 1
    assert mega.warnings[0].startswith("the board has sent nothing for 2.5 s")


@pytest.mark.parametrize(
    ("mega", "at_most_s"), [(True, 5.0), (False, 9.0)], indirect=["mega"], ids=["DTR", "no DTR"]
)
def test_a_host_that_finds_a_bootloader_held(mega, at_most_s):
    """As by ModemManager, which asks every new port for a modem."""
    mega.driver.stop()
    mega.line.after(0.5, lambda: mega.board.write(b"AT"))
    mega.board.reset(ResetCause.EXTERNAL)
    mega.line.run(mega.board.now_ns + SECOND)
    mega.board.read()
    begun_ns = mega.board.now_ns
    mega.driver.connect()
    assert (mega.board.now_ns - begun_ns) / SECOND < at_most_s


def test_an_old_bootloader_after_a_watchdog_reset():
    """Nothing but the power ends that: the run does, with its patience."""
    with VirtualBoard(ELF, seed=41, noise_volts=0.0, bootloader=Bootloader.OLD) as board:
        run = Run(board, line_of(board, dtr_resets=True))
        run.begin()
        board.reset(ResetCause.WATCHDOG)
        with pytest.raises(NoAnswer, match="has sent nothing for"):
            run.driver.poll(60.0)
        board.reset(ResetCause.POWER_ON)
        run.driver.connect()


# -- the port, and others at it


@pytest.fixture
def shared() -> Iterator[Run]:
    """A run through a pseudo terminal, whose other end of the line a second program has as well."""
    with VirtualBoard(ELF, seed=41, noise_volts=0.0) as board:
        line = TerminalLine(board, BOARD.wire.baud, RAMPS, REVOLUTIONS_PER_S)
        started = Run(board, line)
        started.begin()
        yield started
        line.close()


def told_after_s(run: Run, seconds: float) -> float:
    """Poll for so long; when the first warning came."""
    begun_ns, told_ns = run.board.now_ns, []
    run.driver.on_warning = lambda text: (
        told_ns.append(run.board.now_ns),
        run.warnings.append(text),
    )
    run.driver.poll(seconds)
    return (told_ns[0] - begun_ns) / SECOND


def test_another_program_changes_the_lines_settings(shared):
    """It is told and put right within a look at them, four times a second; 1 % of 5000 scans is 50,
    and what the terminal has kept in its line mode comes damaged."""
    settings = termios.tcgetattr(shared.line.other)
    settings[0] |= termios.ISTRIP | termios.ICRNL
    settings[3] |= termios.ICANON
    settings[4] = settings[5] = termios.B9600
    termios.tcsetattr(shared.line.other, termios.TCSANOW, settings)
    assert told_after_s(shared, 5.0) < 0.3
    shared.end()
    print(f"\nsettings changed: {shared.driver.statistics.scans_lost} scans lost")
    assert shared.driver.statistics.scans_lost < 50
    assert shared.driver.statistics.line_repairs == 1
    assert shared.driver.statistics.restarts == 0
    (warning,) = shared.warnings
    assert f"has changed the settings of port {shared.line.path} (9600 baud)" in warning
    assert warning.endswith("mask ModemManager, and close whatever monitors the port")


def test_another_program_takes_bytes(shared):
    """It is named where that can be seen; the frames that it leaves are good."""
    thief = subprocess.Popen(["sleep", "60"], stdin=shared.line.other)
    try:
        shared.line.steal = 3
        assert told_after_s(shared, 6.0) < 2.6
    finally:
        thief.kill()
        thief.wait()
    shared.line.steal = 0
    shared.driver.poll(1.0)
    shared.end()
    assert "frames in 2 s were damaged: sleep (pid " in shared.warnings[-1]
    assert shared.warnings[-1].endswith("has the port open as well and takes bytes: stop it")
    assert shared.scans[-1].sequence > shared.scans[-90].sequence == shared.scans[-1].sequence - 89


def test_another_program_takes_all(shared):
    shared.line.steal, shared.line.steal_ns = 4096, 0
    assert told_after_s(shared, 5.0) < 2.7
    shared.line.steal = 0
    shared.driver.poll(4.0)
    shared.end()
    assert len(shared.gaps) == 1 and shared.gap_s < 9.0
    assert shared.warnings[0].startswith("the board has sent nothing for 2.5 s")


def test_garbage_is_no_life(run):
    """At 5 % of the bits no frame gets through, of all the bytes that come."""
    run.board.set_faults(serial_bit_error_rate=0.05)
    run.driver.poll(4.0)
    run.board.set_faults()
    run.driver.poll(3.0)
    run.end()
    assert sum(b.sequence - a.sequence for a, b in run.gaps) < 600
    assert run.driver.statistics.reconnections == 1
    assert any("nothing readable has come from the board for 2.5 s (" in w for w in run.warnings)


@functools.cache
def stamps_of_an_unharmed_board(ppm: float) -> list[int]:
    """Of the first 4 s of scans, by number."""
    with VirtualBoard(ELF, seed=41, noise_volts=0.0, clock_ppm=ppm) as board:
        run = Run(board, line_of(board))
        run.begin()
        run.driver.poll(1.0)
        return [scan.stamp_ns for scan in run.scans]


@pytest.mark.parametrize(
    ("cause", "ppm"), [(ResetCause.WATCHDOG, 5000.0), (ResetCause.BROWN_OUT, -5000.0)]
)
@pytest.mark.parametrize(
    ("before_s", "phase_s"), [(0.5, 0.0005), (0.5, 0.0095), (0.02, 0.005), (0.0004, 0.005)]
)
@pytest.mark.parametrize("boot_frame", [True, False])
def test_reset_shortly_before_the_stop(cause, ppm, before_s, phase_s, boot_frame):
    """No poll comes between. The truth is a board that is the same but for the reset: how many
    scans it has taken by the stop, which comes `phase_s` after one."""
    unharmed = stamps_of_an_unharmed_board(ppm)
    stop_ns = unharmed[-20] + round(phase_s * SECOND)
    with VirtualBoard(ELF, seed=41, noise_volts=0.0, clock_ppm=ppm) as board:
        run = Run(board, line_of(board))
        run.begin()
        run.driver.poll((stop_ns - board.now_ns) / SECOND - before_s)
        run.line.run(stop_ns - round(before_s * SECOND))
        board.reset(cause)
        if not boot_frame:
            board.set_faults(serial_byte_drop_rate=1.0)
            run.line.after(min(before_s, 0.01), board.set_faults)
        run.line.run(stop_ns)  # what has come meanwhile is not yet read
        run.driver.stop()
        counted = run.driver.statistics
        assert counted.scans_received == len(run.scans)
        assert counted.scans_scheduled == sum(stamp_ns < stop_ns for stamp_ns in unharmed)
        assert counted.scans_lost == pytest.approx(100 * before_s, abs=2)
        name = {ResetCause.WATCHDOG: "watchdog", ResetCause.BROWN_OUT: "brown_out"}[cause]
        assert run.warnings == [
            f"the board was reset ({name}): the stream had ended before it was stopped; scans lost "
            f"up to the stop: {counted.scans_lost}"
        ]
        run.driver.start()  # it is well again
        run.driver.poll(0.3)
        assert (run.driver.statistics.scans_lost, len(run.warnings)) == (0, 1)


def test_encoder_bounce(run):
    """The crank stands on an edge and trembles over it by two counts 200 times a second: what is
    counted up is counted down again."""
    run.line.crank_rate, run.line.crank_jitter = 0.0, 2 * math.pi / COUNTS
    edges = run.board.counters()["crank_edges"]
    run.driver.poll(0.1)
    standing = run.scans[-1].crank
    run.driver.poll(5.0)
    run.end()
    assert run.board.counters()["crank_edges"] - edges > 1500
    assert all(abs(scan.crank - standing) <= 3 for scan in run.scans[-400:])
    assert run.driver.counters().illegal_steps == 0


def test_illegal_encoder_steps(run):
    """A shaft that jumps, 300 000 edges a second: more than the board can follow. Scans that saw it
    carry a flag, and the counter says how often."""
    flag = BOARD.data_flags["illegal_step"]
    assert not any(scan.flags & flag for scan in run.scans)
    run.line.crank_rate = 2 * math.pi * 300_000 / COUNTS
    run.driver.poll(0.1)
    run.line.crank_rate = 0.0
    run.driver.poll(2.0)
    run.end()
    assert any(scan.flags & flag for scan in run.scans)
    assert not any(scan.flags & flag for scan in run.scans[-100:])
    assert run.driver.counters().illegal_steps > 0


@pytest.mark.parametrize("ppm", [5000.0, -5000.0])
def test_clock_off(ppm):
    """The periods are those of the board's clock; stamps and codes agree in the host's."""
    with VirtualBoard(ELF, seed=42, noise_volts=0.0, clock_ppm=ppm) as board:
        run = Run(board, line_of(board))
        run.begin()
        run.driver.poll(15.0)
        run.driver.stop()
        assert (run.driver.statistics.scans_lost, run.driver.statistics.scans_bad) == (0, 0)
        run.assert_carriage_counts_are_of_their_instants()
        for scan in run.scans[100:]:
            for channel, late_s in enumerate(run.late_s):
                assert run.told_s(scan, channel) == pytest.approx(late_s, abs=AGREE_S)


@pytest.mark.parametrize("stall_s", [3, 8])
def test_host_stall(run, stall_s):
    """What the board sends meanwhile waits in the port's buffer. After 5 s it ends its stream, and
    the rest is lost by its number."""
    run.line.run(run.board.now_ns + stall_s * SECOND)
    run.driver.poll(4.0)
    run.end()
    assert len(run.gaps) == (stall_s > 5)
    assert run.driver.statistics.restarts == (stall_s > 5)
    run.assert_carriage_counts_are_of_their_instants()


def test_host_killed_and_started_again(run):
    """The next host finds the board streaming, stops it and starts its own run."""
    run.line.read(0.5)
    after = Run(run.board, run.line)
    after.begin()
    after.end()
    assert (after.driver.statistics.scans_lost, after.driver.statistics.restarts) == (0, 0)


def test_two_hosts_on_one_port():
    """The second is refused; the first does not notice."""
    controller, port = pty.openpty()
    path = os.ttyname(port)
    first = SerialPort(path, BOARD.wire.baud)
    try:
        with pytest.raises(SerialPortError, match="in use by another program: stop that first"):
            SerialPort(path, BOARD.wire.baud)
        os.write(controller, b"still")
        assert first.read(1.0) == b"still"
    finally:
        first.close()
        os.close(controller)
        os.close(port)


def test_port_is_opened_again():
    controller, port = pty.openpty()
    opened = SerialPort(os.ttyname(port), BOARD.wire.baud)
    opened.reopen(1.0, reset=False)
    os.write(controller, b"again")
    assert opened.read(1.0) == b"again"
    opened.close()
    os.close(controller)
    os.close(port)
    with pytest.raises(SerialPortError, match="does not exist"):
        opened.reopen(0.0, reset=False)


def test_patience_is_for_what_may_come_back(run):
    """A board with another firmware after a reset is refused at once."""
    assert issubclass(NoAnswer, BoardError)
    run.protocol.board = BOARD.model_copy(update={"protocol": BOARD.protocol + 1})
    run.board.reset(ResetCause.WATCHDOG)
    with pytest.raises(BoardError, match="flash the firmware") as refused:
        run.driver.poll(5.0)
    assert not isinstance(refused.value, NoAnswer)
