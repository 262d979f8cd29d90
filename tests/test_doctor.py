# SPDX-License-Identifier: Apache-2.0
"""`towtank doctor`: the real firmware in the virtual board, sound and with something wrong."""

from __future__ import annotations

import json
import math

import pytest
from click.testing import CliRunner
from offline_trial import ELF
from towtank_bringup.cli import towtank
from towtank_bringup.plan import conversion_noise
from towtank_bringup.rigs import rig_path
from towtank_daq.board import AdcBoard
from towtank_daq.description import installed_description, load_description
from towtank_daq.doctor import Examination, examine
from towtank_daq.protocol import Protocol
from towtank_rig import load_rig
from vboard import VirtualBoard
from virtual_line import MS, VirtualLine

RIG = load_rig(rig_path("nit_calicut_2012"))
BOARD = load_description(installed_description())
AT_REST = ((5e-3, 0.0), (5e-3, 0.0), (1.65, 0.0), (1.65, 0.0), (2.31, 0.0), (10.0, 0.0))
SECONDS = 4.0


def found_on(faults=None, turn=(0.0, 0.0), turns=None, **options) -> Examination:
    """turn: revolutions per second of crank and carriage."""
    options = {"seed": 51, "noise_volts": conversion_noise(RIG)} | options
    with VirtualBoard(ELF, **options) as virtual:
        line = VirtualLine(virtual, AT_REST, turn)
        line.run(20 * MS)
        virtual.set_faults(**(faults or {}))
        scans = []
        board = AdcBoard(
            line, Protocol(BOARD), scans.append, print, line.monotonic_ns, patience_s=0.0
        )
        return examine(
            board, scans, RIG, BOARD, seconds=SECONDS, turns=turns, passed=lambda share: None
        )


def failures(found: Examination) -> list[str]:
    return [check.name for check in found.failures]


def test_sound_board():
    """The noise found is that of conversion_noise() at the terminals; of 400 scans it is known to
    9 %, three of that."""
    found = found_on(turn=(0.25, 1.0), turns=1.0)
    assert failures(found) == []
    assert set(found.checks) == {"self-test", "scans", "noise", "encoders", "clock", "counters"}
    assert found.facts["last reset"] == "power_on" and found.notes == ()
    for channel, volts, check in zip(
        BOARD.channels, conversion_noise(RIG), found.checks["noise"], strict=True
    ):
        assert check.value == pytest.approx(volts / channel.gain, rel=0.27)


@pytest.mark.parametrize(
    ("names", "mend", "how"),
    [
        (["crank"], "swap A and B", {"turn": (0.25, 1.0), "turns": -1.0}),
        (["rate against the host's"], "resonator", {"clock_ppm": 8000.0}),
        (
            ["depressor_pressure noise"],
            "check shield, ground",
            {"noise_volts": (conversion_noise(RIG)[0], 2e-3, *conversion_noise(RIG)[2:])},
        ),
        (
            [f"{channel.name} noise" for channel in BOARD.channels],
            "keep the sensors at rest",
            {"noise_volts": 0.0},
        ),
    ],
    ids=["reversed", "clock", "noisy", "stuck"],
)
def test_what_is_wrong_is_named(names, mend, how):
    found = found_on(**how)
    assert failures(found) == names
    assert all(mend in check.mend for check in found.failures)


def test_spi_errors_are_found():
    found = found_on(faults={"spi_error_one_in": 50})
    assert {"SPI errors", "scans with a bad channel", "spi crc errors"} <= set(failures(found))


def test_an_adc_that_does_not_answer_ends_the_examination():
    found = found_on(faults={"adc_silent": True})
    assert failures(found) == ["ADC answers", "stream"]
    assert "refuses 'start': adc fault: check the ADC's supply" in found.failures[1].mend
    assert found.notes == ("without a stream nothing else can be checked",)


def test_a_crank_that_was_not_turned_is_said():
    (note,) = found_on().notes
    assert "give --turns" in note


def run(*arguments):
    return CliRunner().invoke(towtank, ["doctor", *map(str, arguments)])


def test_one_board_is_wanted(tmp_path):
    assert run().exit_code == 2
    assert run("--virtual", "--port", tmp_path / "board").exit_code == 2
    missing = run("--port", tmp_path / "board")
    assert missing.exit_code == 1
    assert "does not exist: plug the board in" in missing.output


@pytest.mark.real_time
def test_doctor_on_the_virtual_board():
    examined = run("--virtual", "--seconds", 3, "--turns", 1, "--json")
    assert examined.exit_code == 0, examined.output
    found = json.loads(examined.stdout)
    assert found["passed"] and len(found["checks"]) > 30
    (crank,) = [check for check in found["checks"] if check["name"] == "crank"]
    assert math.isclose(crank["value"], 1.0, abs_tol=0.05)
    table = run("--virtual", "--seconds", 2)
    assert table.exit_code == 0, table.output
    assert "checks passed" in table.stdout and "note: the crank" in table.stdout
