# SPDX-License-Identifier: Apache-2.0
"""A changed copy of a rig is a rig of its own, and explains itself by its own text."""

import hashlib
from pathlib import Path

import pytest
from pydantic import ValidationError
from towtank_rig import Quantity, RigError, load_rig, parse_rig
from towtank_rig.loading import replaced, vary

RIG = load_rig(Path(__file__).resolve().parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml")


def test_replace_changes_what_it_is_told_and_nothing_else():
    changed = replaced(RIG, {"lines.primary.length": 1.3, "lines.primary.segments": 40})
    assert changed.lines.primary.length.value == 1.3
    assert changed.lines.primary.segments == 40
    assert RIG.lines.primary.length.value == 1.2
    before, after = dict(RIG.quantities()), dict(changed.quantities())
    assert {path for path in before if before[path] != after[path]} == {"lines.primary.length"}
    assert after["lines.primary.length"].source == before["lines.primary.length"].source


@pytest.mark.parametrize(
    ("path", "new", "value"),
    [
        ("fish.fins.0.area", 0.012, 0.012),
        ("fish.fins.2.position.y", 0.01, 0.01),  # a short string in the file
        ("fish.munk_moment", 0.75, 0.75),  # dimensionless
        ("run.crank_rate", 2, 2.0),
        ("lines.depressor.length", "0.9 m", 0.9),
        ("lines.depressor.length", {"value": "0.9 m", "range": [0.1, 2]}, 0.9),
        ("sensors.fish_pressure.errors.span", 0.0, 0.0),
        ("water.density", 996.6789012345678, 996.6789012345678),
    ],
)
def test_replace_takes_every_form_of_a_value(path, new, value):
    assert dict(replaced(RIG, {path: new}).quantities())[path].value == value


def test_a_new_key_joins_its_section_and_a_whole_section_can_change():
    slider = {"tow_point.motion.kind": "slider_crank", "tow_point.motion.rod_length": "0.35 m"}
    motion = replaced(RIG, slider).tow_point.motion
    assert (motion.kind, motion.rod_length.value) == ("slider_crank", 0.35)
    ranged = replaced(RIG, {"board.excitation": {"value": "10 V", "range": [9.9, 10.1]}})
    assert ranged.board.excitation.range == (9.9, 10.1)
    assert replaced(RIG, {"fish.fins": []}).fish.fins == ()
    bending = replaced(RIG, {"lines.primary.bending_stiffness": "0.2 N m^2"}).lines
    assert (bending.primary.bending_stiffness.value, bending.secondary.bending_stiffness) == (
        0.2,
        None,
    )
    bare = replaced(RIG, {"calibrations": {}, "fish.fins": [], "run.ramp_time": 5})
    assert bare.calibrations.fish_pressure is None
    assert bare.run.ramp_time.value == 5 and bare.fish.tow_point == RIG.fish.tow_point
    with_range = {"lines.depressor.length.range": [0.1, 0.9], "lines.depressor.length": 0.8}
    assert replaced(RIG, with_range).lines.depressor.length.range == (0.1, 0.9)


def test_text_and_hash_of_a_copy_give_the_copy_again():
    changed = replaced(RIG, {"fish.axial_drag": 0.5})
    again = parse_rig(changed.text, changed.source)
    assert again == changed
    assert again.sha256 == changed.sha256 != RIG.sha256
    assert RIG.sha256 == hashlib.sha256(RIG.text.encode()).hexdigest()
    assert "faired body" in changed.text, "comments and sources stay"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"lines.primry.length": 1.0}, "lines.primry.length: no such key"),
        ({"lines.primary.lenght": 1.0}, "lines.primary.lenght: unknown key"),
        ({"fish.fins.9.area": 0.01}, "fish.fins.9.area: no such key"),
        ({"name.x": 1}, "name.x: no such key"),
        ({"lines.primary.length": 30.0}, "outside its range"),
        ({"depressor.mass": -1.0}, "-1 is impossible"),
        ({"fish.fins": [], "fish.fins.0.area": 0.01}, "another change lies within"),
        ({"lines.primary.length": float("nan")}, "is not a number"),
        ({"lines.primary.segments": 2.5}, "lines.primary.segments"),
    ],
)
def test_replace_refuses_what_a_file_may_not_hold(changes, message):
    with pytest.raises(RigError) as caught:
        replaced(RIG, changes)
    assert message in str(caught.value)
    assert "nit_calicut_2012.yaml" in str(caught.value)


def test_a_rig_does_not_change():
    with pytest.raises(ValidationError):
        RIG.fish.length = Quantity(value=2.0, unit="m")
    with pytest.raises(ValidationError):
        RIG.fish.length.value = 2.0


def test_assumptions_are_the_assumed_quantities_with_range_and_source():
    assumptions = RIG.assumptions()
    assert "lines.primary.length" in assumptions and "run.carriage_speed" not in assumptions
    for quantity in assumptions.values():
        low, high = quantity.range
        assert low <= quantity.value <= high and quantity.source


def test_vary_gives_what_a_file_with_these_values_gives():
    values = {
        "lines.primary.length": "7.5 m",  # beyond the range that the file has for its own value
        "lines.primary.segments": 40,
        "fish.fins.2.position.y": "0.01 m",
        "fish.munk_moment": 0.75,
    }
    in_a_file = values | {"fish.munk_moment": {"value": 0.75}}  # replace keeps a number's range
    assert list(vary(RIG, values).quantities()) == list(replaced(RIG, in_a_file).quantities())
    assert vary(RIG, values).lines.primary.segments == 40
    assert RIG.lines.primary.length.value == 1.2


@pytest.mark.parametrize(
    ("path", "new", "words"),
    [
        ("lines.primary.length", "-1 m", ["lines.primary.length", "impossible"]),
        ("lines.primary.length", "1 mm", ["lines.primary.length", "'mm'"]),
        ("lines.tertiary.length", "1 m", ["lines.tertiary.length", "no such key"]),
        ("fish.fins.9.area", "1 m^2", ["fish.fins.9.area", "no such key"]),
        ("depressor.mass", "1 kg", ["depressor.apparent_mass_in_water", "weighs as much"]),
    ],
)
def test_vary_refuses_what_a_file_could_not_hold(path, new, words):
    with pytest.raises(RigError) as caught:
        vary(RIG, {path: new})
    for word in words:
        assert word in str(caught.value)
