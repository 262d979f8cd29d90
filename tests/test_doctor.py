# SPDX-License-Identifier: Apache-2.0
"""`towtank doctor`: the real firmware in the virtual board, sound and with something wrong."""

from __future__ import annotations

import json
import math

import pytest
from click.testing import CliRunner
from offline_trial import ELF
from towtank_bringup.cli import towtank
from towtank_bringup.plan import EEPROM_BYTES, conversion_noise
from towtank_bringup.rigs import rig_path
from towtank_daq.board import AdcBoard
from towtank_daq.description import installed_description, load_description
from towtank_daq.doctor import REST_S, Examination, examine, port_checks
from towtank_daq.identity import eeprom_image
from towtank_daq.protocol import Protocol
from towtank_rig import load_rig
from towtank_rig.loading import replaced
from vboard import Bootloader, VirtualBoard
from virtual_line import COUNTS, MS, VirtualLine

RIG = load_rig(rig_path("nit_calicut_2012"))
BOARD = load_description(installed_description())
AT_REST = ((5e-3, 0.0), (5e-3, 0.0), (1.65, 0.0), (1.65, 0.0), (2.31, 0.0), (10.0, 0.0))
SECONDS = 4.0
MOVED = (1.0, 1.5)  # turns of the crank, m of the carriage


def found_on(
    faults=None,
    moved=(0.0, 0.0),
    given=(None, None),
    from_s=REST_S,
    creep=0.0,
    rig=RIG,
    dips=False,
    wander=0.0,
    **options,
) -> Examination:
    """moved: turns of the crank and m of the carriage, evenly after `from_s`; given: what the
    doctor is told of them. creep: of the carriage's count before, counts/s. wander: V of the fish's
    sensor."""
    options = {"seed": 51, "noise_volts": conversion_noise(RIG)} | options
    with VirtualBoard(ELF, **options) as virtual:
        line = VirtualLine(virtual, AT_REST, (0.0, creep / COUNTS))
        line.wander = wander
        line.run(20 * MS)
        virtual.set_faults(**(faults or {}))
        scans = []
        board = AdcBoard(
            line, Protocol(BOARD), scans.append, print, line.monotonic_ns, patience_s=0.0
        )
        rates = [distance / (SECONDS - from_s) for distance in moved]
        circumference = RIG.sensors.carriage_encoder.wheel_circumference.value

        dip = iter((virtual.dip_adc_supply,) if dips else ())

        def passed(passed_s: float) -> None:
            if passed_s > 2.0:
                next(dip, lambda: None)()
            if passed_s >= from_s:
                line.crank_rate = 2 * math.pi * rates[0]
                line.carriage_rate = 2 * math.pi * rates[1] / circumference
            if passed_s >= SECONDS:
                line.crank_rate = line.carriage_rate = 0.0

        return examine(
            board,
            scans,
            rig,
            BOARD,
            seconds=SECONDS,
            turns=given[0],
            travel=given[1],
            passed=passed,
        )


OF_THIS_BOARD = "calibration of this board"  # the rig names none


def names(left) -> list[str]:
    return [what.name for what in left]


def failures(found: Examination) -> list[str]:
    return [check.name for check in found.failures]


def test_sound_board():
    """The noise found is that of conversion_noise() at the terminals; of 400 scans it is known to
    9 %, three of that."""
    found = found_on(moved=MOVED, given=MOVED)
    assert failures(found) == []
    assert set(found.checks) == {
        *("identity", "reset", "self-test", "scans", "noise", "encoders", "clock", "counters")
    }
    assert found.facts["last reset"] == "power_on"
    # What is slow cannot be told from the motion.
    assert names(found.not_checked) == [OF_THIS_BOARD, "slow wander"]
    assert found.facts["board"] == found.facts["calibration id"] == "unset"
    assert found.facts["bootloader"] == "none"
    shafts = {check.name: check.value for check in found.checks["encoders"]}
    assert shafts == {
        "crank at rest": pytest.approx(0, abs=1),
        "crank": pytest.approx(MOVED[0], abs=0.02),  # begun and ended by bench frames of 5 ms
        "carriage at rest": pytest.approx(0, abs=1),
        "carriage": pytest.approx(MOVED[1], abs=0.02),
        "illegal steps of both": 0,
    }
    for channel, volts, check in zip(
        BOARD.channels, conversion_noise(RIG), found.checks["noise"], strict=True
    ):
        assert check.value == pytest.approx(volts / channel.gain, rel=0.27)


@pytest.mark.parametrize(
    ("names", "mend", "how"),
    [
        (["crank"], "swap A and B", {"moved": MOVED, "given": (-MOVED[0], MOVED[1])}),
        (["carriage"], "swap A and B", {"moved": MOVED, "given": (MOVED[0], -MOVED[1])}),
        (["carriage"], "counts per turn", {"moved": MOVED, "given": (None, 2 * MOVED[1])}),
        (["crank"], "encoder's wires", {"given": (MOVED[0], None)}),
        (["carriage at rest"], "leave it alone", {"creep": 20.0}),
        (
            ["crank at rest", "carriage at rest"],
            "leave it alone",
            {"moved": MOVED, "given": MOVED, "from_s": 0.5},
        ),
        (["rate against the host's"], "resonator", {"clock_ppm": 8000.0}),
        (
            ["depressor_pressure noise", "depressor_pressure slow wander"],
            "check shield, ground",
            {"noise_volts": (conversion_noise(RIG)[0], 2e-3, *conversion_noise(RIG)[2:])},
        ),
        (["fish_pressure slow wander"], "mains harmonic folds", {"wander": 12e-6}),
        (
            [f"{channel.name} noise" for channel in BOARD.channels],
            "keep the sensors at rest",
            {"noise_volts": 0.0},
        ),
    ],
    ids=[
        *("crank reversed", "carriage reversed", "wrong wheel", "dead encoder"),
        *("creeping count", "moved too early", "clock", "noisy", "hum", "stuck"),
    ],
)
def test_what_is_wrong_is_named(names, mend, how):
    found = found_on(**how)
    assert failures(found) == names
    assert all(mend in check.mend for check in found.failures)


def test_a_bootloader_is_found():
    found = found_on(bootloader=Bootloader.SHIPPED)
    assert failures(found) == []
    assert found.facts["bootloader"] == "yes"
    assert found.facts["last reset"] == "not told (a bootloader hides it)"


def test_a_bootloader_that_does_not_survive_the_watchdog_is_found():
    found = found_on(bootloader=Bootloader.OLD)
    assert failures(found) == ["comes back by itself"]
    assert "bootloader of before 2012 does not survive the watchdog" in found.failures[0].mend
    without = [left for left in found.not_checked if left.name != OF_THIS_BOARD]
    assert {left.wanted for left in without} == {"mend the reset first"}


def test_others_at_the_port_are_found():
    sound, crowded = port_checks("", True, 0), port_checks("screen (pid 7)", False, 2)
    assert all(check.passed for check in sound)
    assert not any(check.passed for check in crowded)
    assert crowded[0].mend == "stop screen (pid 7)"


def test_spi_errors_are_found():
    found = found_on(faults={"spi_error_one_in": 50})
    assert {"SPI errors", "scans with a bad channel", "spi crc errors"} <= set(failures(found))


def test_an_adc_that_does_not_answer_ends_the_examination():
    found = found_on(faults={"adc_silent": True})
    assert failures(found) == ["ADC answers", "stream"]
    assert "refuses 'start': adc fault: check the ADC's supply" in found.failures[1].mend
    left = [(left.section, left.name) for left in found.not_checked]
    assert left[2:4] == [("encoders", "crank"), ("encoders", "carriage")] and len(left) == 6
    assert {left.wanted for left in found.not_checked[1:]} == {"mend the stream first"}


@pytest.mark.parametrize(
    ("given", "left"),
    [
        ((None, None), ["crank", "carriage"]),
        ((0.0, None), ["carriage", "slow wander"]),
        ((None, 0.0), ["crank", "slow wander"]),
    ],
)
def test_what_was_not_moved_has_neither_passed_nor_failed(given, left):
    found = found_on(given=given)
    assert names(found.not_checked) == [OF_THIS_BOARD, *left]
    assert found.failures == [] and not {check.name for check in found.all} & set(left)


def test_an_adc_that_resets_itself_is_found():
    found = found_on(dips=True)
    assert failures(found) == ["scans with a bad channel", "scan overruns", "adc restarts"]
    assert "3.3 V supply" in found.failures[-1].mend
    assert found.facts["ADC has told of"] == "power on"


@pytest.mark.parametrize(
    ("stored", "wrong"),
    [(3, []), (4, [OF_THIS_BOARD]), (None, [OF_THIS_BOARD])],
    ids=["the rig's", "another's", "unset"],
)
def test_a_board_is_that_of_the_rig(tmp_path, stored, wrong):
    rig = replaced(RIG, {"board.calibration_id": 3})
    eeprom = tmp_path / "eeprom"
    image = b"" if stored is None else eeprom_image(BOARD, 17, stored)
    eeprom.write_bytes(image.ljust(EEPROM_BYTES, b"\xff"))
    found = found_on(rig=rig, eeprom=eeprom)
    assert failures(found) == wrong
    assert found.facts["calibration id"] == ("unset" if stored is None else str(stored))
    assert OF_THIS_BOARD not in names(found.not_checked)


def test_a_damaged_identity_is_found(tmp_path):
    image = bytearray(eeprom_image(BOARD, 17, 3).ljust(EEPROM_BYTES, b"\xff"))
    image[4] ^= 1
    (tmp_path / "eeprom").write_bytes(image)
    found = found_on(eeprom=tmp_path / "eeprom")
    assert failures(found) == ["serial number and calibration id stored"]
    assert "write it with `towtank identity`" in found.failures[0].mend


def test_illegal_steps_are_found():
    """Two shafts that turn faster than the board can follow."""
    turns = 4 * 300_000 / COUNTS
    travel = turns * RIG.sensors.carriage_encoder.wheel_circumference.value
    found = found_on(moved=(turns, travel), from_s=0.0, given=(None, None))
    assert "illegal steps of both" in failures(found)


def run(*arguments):
    return CliRunner().invoke(towtank, ["doctor", *map(str, arguments)])


def test_one_board_is_wanted(tmp_path):
    assert run().exit_code == 2
    assert run("--virtual", "--port", tmp_path / "board").exit_code == 2
    missing = run("--port", tmp_path / "board")
    assert missing.exit_code == 1
    assert "does not exist: plug the board in" in missing.output


@pytest.mark.alone
def test_doctor_on_the_virtual_board():
    examined = run("--virtual", "--seconds", 3, "--turns", 1, "--travel", -0.7, "--json")
    assert examined.exit_code == 0, examined.output
    found = json.loads(examined.stdout)
    assert found["passed"] and len(found["checks"]) > 30
    shafts = {c["name"]: c["value"] for c in found["checks"] if c["section"] == "encoders"}
    assert math.isclose(shafts["crank"], 1.0, abs_tol=0.05)
    assert math.isclose(shafts["carriage"], -0.7, abs_tol=0.025)
    assert [what["name"] for what in found["not_checked"]] == [OF_THIS_BOARD, "slow wander"]
    table = run("--virtual", "--seconds", 2, "--turns", 1)
    assert table.exit_code == 0, table.output
    (row,) = [line for line in table.stdout.splitlines() if "│ carriage  " in line]
    assert "not checked" in row and "pass" not in row
    assert "carriage: not checked: give --travel METRES and move" in table.stdout
    assert table.stdout.endswith(" checks passed, 3 not checked\n")
    left = json.loads(run("--virtual", "--seconds", 2, "--json").stdout)
    assert left["passed"]
    assert [what["name"] for what in left["not_checked"]] == [
        *(OF_THIS_BOARD, "crank", "carriage", "slow wander")
    ]
