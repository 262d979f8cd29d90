# SPDX-License-Identifier: Apache-2.0
"""The circuit keeps to the guaranteed limits of its parts, and a change that breaks one is seen."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parents[1]
sys.path += [str(HERE), str(HERE / "spice"), str(HERE.parents[1] / "firmware/protocol")]

import limits  # noqa: E402
from netlist import build  # noqa: E402
from parts import OFF_BOARD, RESISTORS  # noqa: E402

BOARD = build()


def beyond() -> set[tuple[str, str]]:
    return {
        (found.part, found.quantity) for found in limits.limits(BOARD) if not found.margin >= 0.0
    }


def test_every_limit_is_kept():
    assert beyond() == set()


@pytest.mark.parametrize(
    ("reference", "value", "part", "quantity"),
    [
        ("R406", "97.6k", "INA128", "output at zero pressure, lowest"),
        ("R406", "30k", "AD7124-8", "AIN0, highest"),
        ("R105", "1k", "AD7124-8", "AIN0, highest"),
        ("R404", "12k", "AD7124-8", "REFIN1+, highest"),
        ("R404", "100k", "AD7124-8", "AIN0 − AIN1 over REFIN1, highest"),
        ("R402", "12k", "AD7124-8", "AIN7, highest"),
        ("R106", "499", "AD7124-8", "input current, amplifier at its supply"),
        ("R703", "220", "0603 resistor", "12 V on a line"),
        ("R803", "3k", "MPX2050", "supply"),
        ("R803", "3k", "INA128", "inputs, highest"),
    ],
)
def test_another_resistor_is_seen(monkeypatch, reference, value, part, quantity):
    monkeypatch.setitem(BOARD.kinds, reference, RESISTORS[value])
    assert (part, quantity) in beyond()


def test_a_regulator_out_of_its_tolerance_is_seen(monkeypatch):
    monkeypatch.setattr(limits, "LP2951_33_TOLERANCE", 0.13)
    assert {("AD7124-8", "AVDD at full power, least"), ("AD7124-8", "AVDD, most")} <= beyond()


def test_lines_from_outside_to_the_mega_are_clamped_behind_a_resistor():
    clamped = {
        BOARD.net_of(reference, "COM")
        for reference, kind in BOARD.kinds.items()
        if kind.name == "BAT54S"
    }
    for connector in ("J5", "J6", "J7"):
        for pole in ("1", "2", "3", "4"):
            net = BOARD.net_of(connector, pole)
            if net in ("GND", "5V_ENC"):
                continue
            (series,) = [
                pin.part for pin in BOARD.nets[net].pins if BOARD.kinds[pin.part.ref].name == "1k"
            ]
            assert {pin.net.name for pin in series.pins} - {net} <= clamped
    for reference, kind in BOARD.kinds.items():
        if kind.name == "BAT54S":
            assert (BOARD.net_of(reference, "A"), BOARD.net_of(reference, "K")) == ("GND", "5V")


def test_motor_driver_is_named_and_pulled_down_at_its_end():
    names = [kind.name for kind in OFF_BOARD["J7"]]
    assert "VNH5019" in names and "10k 0.25 W" in names


def test_readme_states_what_the_command_prints():
    assert limits.tables(BOARD) in (HERE / "README.md").read_text(encoding="utf-8")
