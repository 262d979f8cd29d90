# SPDX-License-Identifier: GPL-3.0-or-later
"""Resets, clock, interrupt flags, determinism, and what the board does with bad input."""

from __future__ import annotations

import struct

import pytest
from probe_link import (
    ACCELEROMETER,
    ADC_CONTROL,
    CONTROL_CONTINUOUS,
    MILLISECOND,
    QUIET_VOLTS,
    SECOND,
)
from vboard import BENCH_MAGIC, BenchFrame, FrameResult, ResetCause, VirtualBoard, VirtualBoardError

TICKS_PER_SECOND = 2_000_000


# ---------------------------------------------------------------------------------- resets


def test_first_boot_is_a_power_on(open_probe):
    assert open_probe().boot == b"B\x01\x01"


def test_watchdog_resets_again_and_again(open_probe):
    probe = open_probe()
    for boot in (2, 3, 4):
        probe.board.write(b"w")
        probe.board.run_until(probe.board.now_ns + 40 * MILLISECOND)
        assert probe.board.read() == bytes([ord("B"), ResetCause.WATCHDOG, boot])
        assert probe.ask(b"e\x02ok", 2) == b"ok"
    assert probe.board.counters()["resets"] == 3


@pytest.mark.parametrize("cause", [ResetCause.EXTERNAL, ResetCause.BROWN_OUT, ResetCause.WATCHDOG])
def test_ram_survives_all_but_a_power_on(open_probe, cause):
    probe = open_probe()
    probe.board.reset(cause)
    probe.board.run_until(probe.board.now_ns + 2 * MILLISECOND)
    assert probe.board.read() == bytes([ord("B"), cause, 2])
    probe.board.reset(ResetCause.POWER_ON)
    probe.board.run_until(probe.board.now_ns + 2 * MILLISECOND)
    assert probe.board.read() == b"B\x01\x01"


def test_the_adc_keeps_its_registers_while_it_has_power(open_probe):
    probe = open_probe()
    probe.set_up_scan(ACCELEROMETER)
    for cause in (ResetCause.EXTERNAL, ResetCause.WATCHDOG):
        probe.board.reset(cause)
        probe.board.run_until(probe.board.now_ns + 2 * MILLISECOND)
        probe.board.read()
        assert probe.read(ADC_CONTROL) == CONTROL_CONTINUOUS
    probe.board.reset(ResetCause.BROWN_OUT)
    probe.board.run_until(probe.board.now_ns + 7 * MILLISECOND)
    probe.board.read()
    probe.crc = False
    assert probe.read(ADC_CONTROL) == 0


def test_conversions_go_on_after_a_watchdog_reset(open_probe):
    probe = open_probe()
    probe.push(probe.board.now_ns + MILLISECOND)
    probe.push(probe.board.now_ns + 10 * SECOND)
    probe.set_up_scan(ACCELEROMETER)
    _, (before,) = probe.convert(1)
    probe.board.reset(ResetCause.WATCHDOG)
    probe.board.run_until(probe.board.now_ns + 2 * MILLISECOND)
    probe.board.read()
    _, (after,) = probe.convert(1)
    assert after.crc_good
    assert after.code == before.code


def test_other_reset_causes_are_refused(open_probe):
    with pytest.raises(ValueError, match="reset cause"):
        open_probe().board.reset(0x10)


# ---------------------------------------------------------------------- clock and interrupts


@pytest.mark.parametrize("ppm", [0.0, 5000.0, -5000.0])
def test_crystal_runs_fast_by_its_ppm(open_probe, ppm):
    probe = open_probe(clock_ppm=ppm)
    before_ns, before = probe.board.now_ns, probe.ticks()
    probe.board.run_until(before_ns + 10 * SECOND)
    elapsed_ns, elapsed = probe.board.now_ns - before_ns, probe.ticks() - before
    # Both readings wait for the same request byte, within the polling loop's 20 µs.
    expected = elapsed_ns * 1e-9 * TICKS_PER_SECOND * (1 + ppm * 1e-6)
    assert abs(elapsed - expected) < 40


def test_a_change_of_the_crystal_keeps_time_continuous(open_probe):
    probe = open_probe()
    start_ns, start = probe.board.now_ns, probe.ticks()
    probe.board.set_clock_ppm(5000.0)
    assert probe.board.now_ns == pytest.approx(start_ns, abs=2 * MILLISECOND)
    middle_ns = probe.board.now_ns
    probe.board.run_until(middle_ns + SECOND)
    ticks = probe.ticks() - start
    expected = TICKS_PER_SECOND * ((middle_ns - start_ns) * 1e-9 + 1.005)
    assert abs(ticks - expected) < 40


def test_interrupt_flags_behave_as_on_the_chip(open_probe):
    probe = open_probe()
    probe.board.run_until(6 * MILLISECOND)  # until the ADC answers: its bits move the RDY̅ wire
    both, one_left, raised, struck, cleared = probe.ask(b"f", 5)
    assert both == 0x06
    assert one_left == 0x04  # clearing a timer's flag A leaves B
    assert raised == 0x10  # the RDY̅ wire has moved while its interrupt was masked
    assert struck == 1  # and strikes when enabled
    assert cleared == 0  # unless its flag was cleared by writing a one


# ------------------------------------------------------------------------------ determinism


def life(elf_probe, seed: int) -> bytes:
    """Some of everything, and all that the board has said."""
    probe = elf_probe(seed=seed, noise_volts=1e-4)
    for i in range(30):
        probe.push((i + 1) * 10 * MILLISECOND, crank=0.3 * i, carriage=-0.1 * i * i)
    probe.board.set_faults(serial_bit_error_rate=1e-4, spi_error_one_in=20)
    probe.set_up_scan(ACCELEROMETER)
    answers = [probe.boot]
    for _ in range(5):
        probe.board.write(b"t\x10nk")
        probe.board.run_until(probe.board.now_ns + 40 * MILLISECOND)
        answers.append(probe.board.read())
    return b"".join(answers)


def test_the_same_inputs_give_the_same_bytes(open_probe):
    first = life(open_probe, seed=11)
    assert len(first) > 5 * 16 * 9
    assert life(open_probe, seed=11) == first
    assert life(open_probe, seed=12) != first


# --------------------------------------------------------------------------- ADC faults


def test_spi_errors_are_those_injected(open_probe):
    probe = open_probe()
    probe.push(probe.board.now_ns + MILLISECOND)
    probe.push(probe.board.now_ns + 10 * SECOND)
    probe.set_up_scan(ACCELEROMETER)
    probe.board.set_faults(spi_error_one_in=5)
    conversions = [c for _ in range(10) for c in probe.convert(16)[1]]
    bad = sum(not c.crc_good for c in conversions)
    assert bad == probe.board.counters()["spi_errors_injected"]
    assert 10 < bad < 60  # 160 / 5 = 32, σ = 5


def test_a_silent_adc_neither_answers_nor_signals(open_probe):
    probe = open_probe()
    probe.set_up_scan(ACCELEROMETER)
    probe.board.set_faults(adc_silent=True)
    assert probe.spi(b"\x45\x00\x00") == b"\xff\xff\xff"
    _, (conversion,) = probe.convert(1)
    assert conversion.ticks is None
    probe.board.set_faults()
    _, (conversion,) = probe.convert(1)
    assert conversion.crc_good


# ---------------------------------------------------------------------------- bench frames


def frame_bytes(**changes: float) -> bytes:
    values = {"magic": BENCH_MAGIC, "time_ns": 5 * SECOND, "volt": 1.0, "crank": 0.0} | changes
    return struct.pack(
        "<IIq8d",
        int(values["magic"]),
        0,
        int(values["time_ns"]),
        *[values["volt"]] * 6,
        values["crank"],
        0.0,
    )


@pytest.mark.parametrize(
    "frame",
    [
        b"",
        frame_bytes()[:-1],
        frame_bytes() + b"\0",
        frame_bytes(magic=BENCH_MAGIC + 1),
        frame_bytes(volt=float("nan")),
        frame_bytes(crank=float("inf")),
        frame_bytes(time_ns=1_700_000_000 * SECOND),
        frame_bytes(time_ns=-(2**63)),
    ],
    ids=["empty", "short", "long", "magic", "nan", "inf", "another clock", "overflow"],
)
def test_malformed_frames_change_only_their_counter(open_probe, frame):
    probe = open_probe()
    assert probe.board.push_bench(frame) == FrameResult.MALFORMED
    counters = probe.board.counters()
    assert (counters["bench_frames"], counters["bench_frames_malformed"]) == (0, 1)


def test_frames_for_the_past_are_late(open_probe):
    board = open_probe().board
    board.run_until(20 * MILLISECOND)

    def push(time_ns: int) -> FrameResult:
        return board.push_bench(BenchFrame(time_ns, QUIET_VOLTS, 0.0, 0.0))

    assert push(10 * MILLISECOND) == FrameResult.LATE
    assert push(30 * MILLISECOND) == FrameResult.ACCEPTED
    assert push(30 * MILLISECOND) == FrameResult.LATE
    assert board.counters()["bench_frames_late"] == 2


def test_starved_conversions_hold_the_last_value_and_are_counted(open_probe):
    probe = open_probe()
    volts = (0.0, 0.0, 1.0, 1.65, 2.31, 10.0)
    end = probe.board.now_ns + 300 * MILLISECOND
    probe.push(probe.board.now_ns + MILLISECOND, volts)
    probe.push(end, volts)
    probe.set_up_scan(ACCELEROMETER)
    probe.convert(8)
    assert probe.board.counters()["conversions_starved"] == 0
    probe.board.run_until(end + 5 * MILLISECOND)
    before = probe.board.counters()["conversions_starved"]
    _, conversions = probe.convert(8)
    assert probe.board.counters()["conversions_starved"] - before >= 8
    assert {c.code for c in conversions} == {round(2**24 * 1.0 / 2.5)}


# -------------------------------------------------------------------------------- opening


@pytest.mark.parametrize(
    ("content", "complaint"),
    [(None, "No such file"), (b"no ELF at all", "is not an ELF executable for AVR")],
)
def test_a_bad_firmware_file_is_named(tmp_path, content, complaint):
    path = tmp_path / "firmware.elf"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(VirtualBoardError, match=f"{path}.*{complaint}"):
        VirtualBoard(path)


def test_an_elf_for_another_machine_is_refused():
    with pytest.raises(VirtualBoardError, match="is not an ELF executable for AVR"):
        VirtualBoard("/bin/sh")


@pytest.mark.parametrize(
    "options",
    [{"clock_ppm": float("nan")}, {"crank_counts_per_revolution": 0}, {"noise_volts": -1.0}],
)
def test_impossible_options_are_refused(open_probe, options):
    with pytest.raises(VirtualBoardError):
        open_probe(**options)


def test_a_closed_board_says_so(open_probe):
    board = open_probe().board
    board.close()
    with pytest.raises(VirtualBoardError, match="closed"):
        board.run_until(SECOND)
