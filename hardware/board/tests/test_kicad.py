# SPDX-License-Identifier: Apache-2.0
"""Pins and footprints agree with KiCad's libraries, and the exported netlist with the circuit."""

from __future__ import annotations

import sys
from fnmatch import fnmatch
from pathlib import Path

import pytest
from simp_sexp import Sexp

HERE = Path(__file__).resolve().parents[1]
sys.path += [str(HERE), str(HERE / "spice"), str(HERE / "tests")]

import kicad  # noqa: E402
import kicad_library  # noqa: E402
from netlist import build  # noqa: E402
from parts import Kind  # noqa: E402

BOARD = build()
KINDS = {kind.name: kind for kind in BOARD.kinds.values()}
# What KiCad's libraries do not draw: its source is in parts.py.
WITHOUT_SYMBOL = {"AD7124-8"}
# A header for wires has a symbol without names; its pads are those of the pins.
HEADER = "Arduino Mega 2560"

# Electrical types of KiCad that a pin's type here may have there.
TYPES = {
    "in": {"input", "passive"},
    "out": {"output", "tri_state", "input"},  # LP2951: KiCad draws its tap as an input
    "tri": {"tri_state"},
    "power": {"power_in"},
    "supply": {"power_out", "passive"},
    "passive": {"passive", "input", "bidirectional"},
    "free": {"passive", "input", "open_collector", "tri_state"},
}


def faults(kind: Kind) -> list[str]:
    """Where a kind's pins are not those of its symbol."""
    symbol = kicad_library.symbol(kind.symbol)
    names = dict(kind.symbol_names)
    found = []
    drawn = {n for n, (_, kind_of_pin) in symbol.pins.items() if kind_of_pin != "no_connect"}
    here = {number for number, _, _ in kind.pins}
    if here != drawn:
        found.append(f"pins {sorted(here ^ drawn)} are only in one of the two")
    for number, name, pin_type in kind.pins:
        if number not in symbol.pins:
            continue
        there, type_there = symbol.pins[number]
        if names.get(name, name) != there:
            found.append(f"pin {number} is {name} here and {there} in {kind.symbol}")
        if type_there not in TYPES[pin_type]:
            found.append(f"pin {number} ({name}) is {pin_type} here and {type_there} there")
    return found


@pytest.mark.parametrize("name", sorted(KINDS.keys() - WITHOUT_SYMBOL - {HEADER}))
def test_pins_are_those_of_the_symbol(name):
    assert faults(KINDS[name]) == []


def test_only_these_are_without_a_symbol_and_say_their_source():
    assert {name for name, kind in KINDS.items() if not kind.symbol} == WITHOUT_SYMBOL
    for name in WITHOUT_SYMBOL:
        assert KINDS[name].source


@pytest.mark.parametrize("name", sorted(KINDS))
def test_footprint_exists_with_a_pad_for_every_pin(name):
    kind = KINDS[name]
    pads = kicad_library.pads(kind.footprint)
    used = [pad for number, _, _ in kind.pins for pad in kind.pads_of(number)]
    assert len(set(used)) == len(used)
    assert set(used) <= pads
    symbol = kicad_library.symbol(kind.symbol) if kind.symbol else None
    # A pad that no pin has is one that the symbol marks as not connected.
    spare = pads - set(used)
    assert spare <= {
        n for n, (_, t) in (symbol.pins if symbol else {}).items() if t == "no_connect"
    }
    if symbol and symbol.footprint_filters:
        name_alone = kind.footprint.split(":")[1]
        assert any(
            fnmatch(kind.footprint if ":" in pattern else name_alone, pattern)
            for pattern in symbol.footprint_filters
        )


def test_the_megas_header_has_every_pin_that_is_wired():
    wired = {pin.num for pin in BOARD.parts["A601"].pins if pin.net is not None}
    assert wired == {number for number, _, _ in KINDS[HEADER].pins if KINDS[HEADER].pads_of(number)}


def test_polarised_capacitors_have_ground_at_their_minus():
    polarised = [r for r, kind in BOARD.kinds.items() if kind.symbol == "Device:C_Polarized"]
    assert len(polarised) == 3
    for reference in polarised:
        assert BOARD.net_of(reference, "2") == "GND" != BOARD.net_of(reference, "1")


@pytest.mark.parametrize("change", ["number", "name", "missing"])
def test_a_wrong_pin_is_found(change):
    kind = KINDS["INA128"]
    swapped = {"5": "6", "6": "5"}
    pins = {
        "number": tuple((swapped.get(n, n), name, t) for n, name, t in kind.pins),
        "name": tuple((n, "REFERENCE" if name == "REF" else name, t) for n, name, t in kind.pins),
        "missing": kind.pins[:-1],
    }[change]
    spoiled = Kind(kind.name, "", "", "", pins, symbol=kind.symbol, symbol_names=kind.symbol_names)
    assert faults(spoiled)


def test_unknown_symbol_and_footprint_are_told():
    with pytest.raises(KeyError):
        kicad_library.symbol("Device:NoSuchThing")
    with pytest.raises(OSError, match="NoSuch"):
        kicad_library.pads("Package_SO:NoSuch")


def section(expression: list, name: str) -> list:
    (found,) = [item for item in expression if isinstance(item, list) and item[0] == name]
    return found[1:]


def test_exported_netlist_is_the_circuit():
    text = (HERE / "board.net").read_text(encoding="utf-8")
    assert text == kicad.export(BOARD)  # write it with: python hardware/board/kicad.py > board.net
    parsed = Sexp(text)
    components = section(parsed, "components")
    assert {section(c, "ref")[0]: section(c, "footprint")[0] for c in components} == {
        reference: kind.footprint for reference, kind in BOARD.kinds.items()
    }
    assert all(section(component, "footprint")[0] for component in components)
    nets = {
        section(net, "name")[0]: {
            (str(section(node, "ref")[0]), str(section(node, "pin")[0]))
            for node in net
            if isinstance(node, list) and node[0] == "node"
        }
        for net in section(parsed, "nets")
    }
    assert nets.keys() == BOARD.nets.keys()
    for name, nodes in nets.items():
        assert nodes == {
            (pin.part.ref, pad)
            for pin in BOARD.nets[name].pins
            for pad in BOARD.kinds[pin.part.ref].pads_of(pin.num)
        }
        assert len(nodes) > 1
