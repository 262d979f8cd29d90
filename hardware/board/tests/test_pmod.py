# SPDX-License-Identifier: Apache-2.0
"""The way round the evaluation board wires every pin that the circuit uses, each pole once."""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

HERE = Path(__file__).resolve().parents[1]
sys.path += [str(HERE), str(HERE.parents[1] / "firmware/protocol")]

import pmod  # noqa: E402
from netlist import build  # noqa: E402

BOARD = build()


def test_every_pin_of_the_adc_is_wired_or_stays_on_the_evaluation_board():
    pins = {pin.name for pin in BOARD.parts["U501"].pins}
    assert pmod.POLES.keys() | pmod.ON_THE_EVALUATION_BOARD == pins
    assert not pmod.POLES.keys() & pmod.ON_THE_EVALUATION_BOARD
    wired = {pin.name for pin in BOARD.parts["U501"].pins if pin.net is not None}
    assert pmod.POLES.keys() <= wired


def test_no_pole_is_used_twice_and_all_exist():
    counted = Counter((c, pole) for c, poles in pmod.POLES.values() for pole in poles)
    assert set(counted.values()) == {1}
    rows = {"P1": 12, "P2": 16, "P3": 16}
    assert all(1 <= pole <= rows[connector] for connector, pole in counted)
    # Poles that the guide calls ground or gives to something else
    taken = {("P2", 1), ("P2", 3), ("P2", 5), ("P2", 16), ("P2", 4), ("P2", 6), ("P3", 1)}
    assert not taken & counted.keys()


def test_supplies_of_the_jumpers_are_one_net():
    assert BOARD.net_of("U501", "AVDD") == BOARD.net_of("U501", "IOVDD") == "3V3"
    assert BOARD.net_of("U501", "AVSS") == BOARD.net_of("U501", "REFIN1-") == "GND"
    assert BOARD.net_of("U501", "REFIN1+") != BOARD.net_of("U501", "REFOUT")  # why P7 is opened


def test_page_states_what_the_command_prints():
    page = (HERE / "pmod.md").read_text(encoding="utf-8")
    for block in pmod.tables(BOARD).split("\n\n"):
        assert block in page
