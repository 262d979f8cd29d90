# SPDX-License-Identifier: Apache-2.0
"""The schematic shows the netlist: every pin once, joined as the netlist joins them."""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ElementTree
from collections import Counter
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parents[1]
sys.path += [str(HERE), str(HERE / "spice")]

import schematic  # noqa: E402
from netlist import Board, build  # noqa: E402
from sheet import Sheet  # noqa: E402


@pytest.fixture(scope="module")
def board() -> Board:
    return build()


@pytest.fixture(scope="module")
def sheets(board) -> dict[str, Sheet]:
    return schematic.draw(board)


def connected_pins(board: Board) -> Counter:
    """Pins of the netlist that are not open, by reference and name."""
    return Counter(
        (reference, pin.name)
        for reference, part in board.parts.items()
        for pin in part.pins
        if pin.net is not None
    )


def faults(board: Board, sheets: dict[str, Sheet]) -> list[str]:
    """Where the sheets join other pins than the netlist does."""
    found = []
    pieces = Counter()
    unnamed = set()
    for name, sheet in sheets.items():
        for flags, pins in sheet.nets():
            nets = {board.net_of(*pin) for pin in pins}
            if len(nets | flags) != 1:
                found.append(f"{name}: {sorted(pins)} are joined as {sorted(flags)}")
                continue
            (net,) = nets | flags
            pieces[net] += 1
            if not flags:
                unnamed.add(net)
    # A net drawn in several pieces is one only if each bears its name.
    found += [f"{net} is in {pieces[net]} pieces" for net in unnamed if pieces[net] > 1]
    return found


def test_every_connected_pin_is_drawn_once(board, sheets):
    drawn = Counter(pin for sheet in sheets.values() for pin in sheet.pins)
    assert drawn == connected_pins(board)


def test_lines_join_what_the_netlist_joins(board, sheets):
    assert faults(board, sheets) == []


def test_a_line_too_many_is_found(board):
    sheets = schematic.draw(board)
    logic = sheets["4_logic"]
    logic.wire(logic.pins["A601", "PB0"], logic.pins["A601", "PB1"])
    assert len(faults(board, sheets)) == 1


def test_a_missing_line_is_found(board):
    sheets = schematic.draw(board)
    supplies = sheets["2_supplies"]
    supplies.lines.remove(((3.5, 0), (5, 0)))
    assert faults(board, sheets) == ["12V_IN is in 2 pieces"]


def test_lines_that_cross_are_not_joined(board):
    sheet = Sheet(board)
    sheet.flag("A", (0, 0))
    sheet.flag("B", (1, -1))
    sheet.wire((0, 0), (2, 0))
    sheet.wire((1, -1), (1, 1))
    assert [flags for flags, _ in sheet.nets()] == [{"A"}, {"B"}]


def test_a_line_that_ends_on_another_is_joined(board):
    sheet = Sheet(board)
    sheet.flag("A", (0, 0))
    sheet.flag("B", (1, -1))
    sheet.wire((0, 0), (2, 0))
    sheet.wire((1, -1), (1, 0))
    assert [flags for flags, _ in sheet.nets()] == [{"A", "B"}]


def test_drawings_are_the_committed_ones(sheets):
    committed = {path.stem: path.read_text("utf-8") for path in schematic.FOLDER.glob("*.svg")}
    # Redraw with: python hardware/board/schematic.py
    assert {name: sheet.svg() for name, sheet in sheets.items()} == committed


def test_drawings_show_every_part_with_its_value(board, sheets):
    texts = {
        word
        for sheet in sheets.values()
        for element in ElementTree.fromstring(sheet.svg()).iter()
        if element.text
        for word in element.text.split()
    }
    assert board.parts.keys() <= texts
    assert {"1.43k", "3.9k", "INA128", "AD7124-8"} <= texts
