# SPDX-License-Identifier: Apache-2.0
"""A broken rig file is refused in one line that names file, line, key, fault and mend."""

from pathlib import Path

import pytest
from towtank_rig import RigError, load_rig, parse_rig
from towtank_rig.check import check_rig, warnings
from towtank_rig.loading import replaced

RIG = Path(__file__).resolve().parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml"
TEXT = RIG.read_text(encoding="utf-8")

PRIMARY_LENGTH = "    length: {value: 1.2 m, range: [1.0, 2.84]"
SPEED = '  carriage_speed: {value: 1.0 m/s, basis: measured, source: "thesis 8.6"}\n'

# name: (text in the file, what replaces it, dotted path, part of the fault, part of the mend)
BROKEN = {
    "wrong unit": (
        PRIMARY_LENGTH,
        "    length: {value: 120 cm, range: [1.0, 2.84]",
        "lines.primary.length",
        "unit 'cm'",
        "give the value in 'm'",
    ),
    "no unit": (
        "crank_radius: {value: 0.06 m,",
        "crank_radius: {value: 0.06,",
        "tow_point.motion.crank_radius",
        "no unit",
        "give the value in 'm'",
    ),
    "unit on a dimensionless number": (
        "drag: {value: 0.47,",
        "drag: {value: 0.47 m,",
        "depressor.drag",
        "unit 'm'",
        "plain number",
    ),
    "unit as a key": (
        "crank_radius: {value: 0.06 m,",
        "crank_radius: {value: 0.06, unit: m,",
        "tow_point.motion.crank_radius",
        "unit is a key",
        "with the value",
    ),
    "no number": (
        "  y: 0 m\n",
        "  y: yes\n",
        "fish.fins.2.position.y",
        "'yes' is not a number",
        "1.5 m",
    ),
    "not finite": (
        "  y: 0 m\n",
        "  y: .inf\n",
        "fish.fins.2.position.y",
        "not a number",
        "1.5 m",
    ),
    "missing key": (
        SPEED,
        "",
        "run.carriage_speed",
        "missing",
        "add 'carriage_speed: <number> m/s'",
    ),
    "missing section": ("board:\n", "no_board:\n", "board", "missing", "add 'board: <section>'"),
    "missing value": (
        PRIMARY_LENGTH,
        "    length: {range: [1.0, 2.84]",
        "lines.primary.length",
        "value is missing",
        "1.5 m",
    ),
    "unknown key": (SPEED, f"{SPEED}  speed: 3 m/s\n", "run.speed", "unknown key", "ramp_time"),
    "unknown key of a quantity": (
        PRIMARY_LENGTH,
        "    length: {value: 1.2 m, rnage: [1.0, 2.84], range: [1.0, 2.84]",
        "lines.primary.length.rnage",
        "unknown key",
        "value, range, basis, source",
    ),
    "negative mass": (
        "  mass: {value: 6.2 kg,",
        "  mass: {value: -6.2 kg,",
        "depressor.mass",
        "-6.2 is impossible",
        "greater than 0",
    ),
    "length zero": (
        PRIMARY_LENGTH,
        "    length: {value: 0 m, range: [0, 2.84]",
        "lines.primary.length",
        "0 is impossible",
        "greater than 0",
    ),
    "impossible range": (
        PRIMARY_LENGTH,
        "    length: {value: 1.2 m, range: [-1.0, 2.84]",
        "lines.primary.length",
        "-1 is impossible",
        "greater than 0",
    ),
    "Munk factor above one": (
        "munk_moment: {value: 1.0,",
        "munk_moment: {value: 1.1,",
        "fish.munk_moment",
        "1.1 is impossible",
        "at most 1",
    ),
    "value outside its range": (
        PRIMARY_LENGTH,
        "    length: {value: 3 m, range: [1.0, 2.84]",
        "lines.primary.length",
        "outside its range [1, 2.84]",
        "correct the value or the range",
    ),
    "range backwards": (
        PRIMARY_LENGTH,
        "    length: {value: 1.2 m, range: [2.84, 1.0]",
        "lines.primary.length",
        "backwards",
        "lower first",
    ),
    "assumed without range": (
        PRIMARY_LENGTH,
        "    length: {value: 1.2 m",
        "lines.primary.length",
        "assumed without a range",
        "range: [lowest, highest]",
    ),
    "assumed without source": (
        'range: [1, 6], basis: assumed, source: "not given; gentle for a carriage of this size"',
        "range: [1, 6], basis: assumed",
        "run.ramp_time",
        "assumed without a source",
        "source:",
    ),
    "unknown basis": (
        "ramp_time: {value: 4 s, range: [1, 6], basis: assumed",
        "ramp_time: {value: 4 s, range: [1, 6], basis: guessed",
        "run.ramp_time.basis",
        "'guessed'",
        "'assumed'",
    ),
    "unknown motion": (
        "kind: sine",
        "kind: sinus",
        "tow_point.motion.kind",
        "'sinus'",
        "'sine' or 'slider_crank'",
    ),
    "slider crank without rod": (
        "kind: sine",
        "kind: slider_crank",
        "tow_point.motion.rod_length",
        "needs its rod",
        "<number> m",
    ),
    "rod shorter than the crank": (
        "kind: sine",
        "kind: slider_crank\n    rod_length: 0.05 m",
        "tow_point.motion.rod_length",
        "not longer than the crank",
        "correct it",
    ),
    "sine with a rod": (
        "kind: sine",
        "kind: sine\n    rod_length: 0.5 m",
        "tow_point.motion.rod_length",
        "has no rod",
        "remove it",
    ),
    "line in the wrong place": (
        "from: tow_point\n    to: junction",
        "from: tow_point\n    to: fish",
        "lines.primary",
        "tow_point to fish",
        "junction and tow_point",
    ),
    "line heavier in water": (
        "weight_in_water_per_length: {value: 0.154 kg/m",
        "weight_in_water_per_length: {value: 0.354 kg/m",
        "lines.primary.weight_in_water_per_length",
        "as much in water",
        "mass_per_length",
    ),
    "no segments": ("segments: 10", "segments: 0", "lines.primary.segments", "0", "correct"),
    "section that is none": (
        "tank:\n",
        "tank: 3\nother:\n",
        "tank",
        "section is expected",
        "mapping",
    ),
    "list that is none": ("[fish_pressure,", "fish_pressure #", "board.channels", "a list", "["),
    "channel twice": (
        "accel_z, excitation]",
        "accel_z, accel_z]",
        "board.channels",
        "twice",
        "once",
    ),
    "no such date": (
        "date: 2012-01-01",
        "date: 2012-13-01",
        "calibrations.fish_pressure.date",
        "2012-13-01",
        "correct the value",
    ),
    "unknown channel": (
        "x: accel_x",
        "x: accel_q",
        "sensors.accelerometer.channels.x",
        "'accel_q'",
        "accel_x",
    ),
}


@pytest.mark.parametrize("case", BROKEN.values(), ids=BROKEN.keys())
def test_fault_is_told_in_one_line_with_its_place(case):
    old, new, where, what, mend = case
    start = TEXT.index(old)
    with pytest.raises(RigError) as caught:
        parse_rig(TEXT[:start] + new + TEXT[start + len(old) :], "rig.yaml")
    fault = caught.value
    assert fault.where == where
    assert what in fault.what
    assert mend in fault.mend
    assert str(fault) == f"rig.yaml:{fault.line}: {where}: {fault.what}; {fault.mend}"
    assert "\n" not in str(fault)
    # The line is that of the change, or of the section's head if the key is not there: the head is
    # at most the length of the longest section above the change.
    changed_lines = range(TEXT[:start].count("\n") - 12, TEXT[:start].count("\n") + 4)
    assert fault.line in changed_lines or where == "board"


def test_line_is_exact_for_a_key_that_is_there():
    line = TEXT[: TEXT.index(PRIMARY_LENGTH)].count("\n") + 1
    with pytest.raises(RigError, match=rf"^r\.yaml:{line}: lines\.primary\.length: "):
        parse_rig(TEXT.replace("value: 1.2 m", "value: 1.2 ft"), "r.yaml")


@pytest.mark.parametrize(
    ("text", "line", "what"),
    [
        ("", 1, "no mapping"),
        ("just words", 1, "no mapping"),
        ("- a\n- b\n", 1, "no mapping"),
        ("name: x\nwater: {density: 1\nrun: 3\n", 3, "not valid YAML"),
        ("name: x\n\tindented: 3\n", 2, "not valid YAML"),
        ("name: x\nname: y\n", 2, "key 'name' stands twice"),
        ("name: &n x\ndescription: *n\n", 1, "alias of &n"),
        ("name: \x01\n", 1, "not valid YAML"),
    ],
)
def test_text_that_is_no_rig_is_refused(text, line, what):
    with pytest.raises(RigError) as caught:
        parse_rig(text, "r.yaml")
    assert caught.value.line == line
    assert what in str(caught.value)
    assert "\n" not in str(caught.value) and "; " in str(caught.value)


def test_file_that_does_not_exist(tmp_path):
    with pytest.raises(RigError, match=r"nowhere\.yaml: no such file; check the path$"):
        load_rig(tmp_path / "nowhere.yaml")


def test_directory_and_binary_file(tmp_path):
    with pytest.raises(RigError, match=r"cannot be read .*; give a readable file$"):
        load_rig(tmp_path)
    binary = tmp_path / "binary.yaml"
    binary.write_bytes(b"name: \xff\xfe")
    with pytest.raises(RigError, match=r"not UTF-8 text at byte 6; save it as UTF-8$"):
        load_rig(binary)


def test_errors_that_an_old_bag_does_not_know_count_as_none_and_are_told():
    """A bag holds the rig file of its day."""
    later = ("offset_stability:", "temperature_hysteresis:", "supply_ratio:", "zero_angle_error:")
    old = parse_rig(
        "\n".join(line for line in TEXT.splitlines() if not line.strip().startswith(later))
    )
    errors = old.sensors.fish_pressure.errors
    assert errors.offset_stability.value == errors.temperature_hysteresis.value == 0.0
    assert old.sensors.accelerometer.errors.supply_ratio.value == 0.0
    assert old.sensors.crank_encoder.zero_angle_error.value == 0.0
    told = [line for line in warnings(old) if "counts as none" in line]
    assert [line.split(" is not given")[0] for line in told] == [
        f"sensors.{sensor}_pressure.errors: {name}"
        for sensor in ("fish", "depressor")
        for name in ("offset_stability", "temperature_hysteresis")
    ] + ["sensors.accelerometer.errors: supply_ratio", "sensors.crank_encoder: zero_angle_error"]


def test_what_an_old_bags_run_was_not_planned_by_has_a_default_and_is_told():
    later = ("settling_time:", "clearance:")
    old = parse_rig(
        "\n".join(line for line in TEXT.splitlines() if not line.strip().startswith(later))
    )
    assert (old.run.settling_time.value, old.tank.clearance.value) == (15.0, 2.0)
    told = [line for line in warnings(old) if " counts as " in line]
    assert told == [
        "run: settling_time is not given and counts as 15 s; add how long the tow takes to settle, "
        "with the range that may be cut to",
        "tank: clearance is not given and counts as 2 m; add what of its length a run must leave "
        "free",
    ]


def test_check_tells_every_fault_in_order(tmp_path):
    path = tmp_path / "rig.yaml"
    path.write_text(TEXT.replace("1.2 m", "1.2 ft").replace(SPEED, ""), encoding="utf-8")
    found = check_rig(path)
    assert [fault.where for fault in found] == ["run.carriage_speed", "lines.primary.length"]
    assert all(isinstance(fault, RigError) for fault in found)
    assert [str(f) for f in check_rig(tmp_path / "no.yaml")] == [
        f"{tmp_path / 'no.yaml'}: no such file; check the path"
    ]


@pytest.mark.parametrize("path", sorted(RIG.parent.glob("*.yaml")), ids=lambda path: path.stem)
def test_no_warning_about_the_rigs_of_the_project(path):
    assert check_rig(path) == []


@pytest.mark.parametrize(
    ("changes", "warning"),
    [
        ({"depressor.apparent_mass_in_water": 5.1}, "depressor: the masses in air and in water"),
        ({"lines.primary.diameter": 0.003}, "lines.primary: the masses"),
        ({"fish.mass_in_water_filled": "14 kg"}, "fish: displaces 14.00 kg"),
        ({"fish.fins": []}, "no horizontal fins against the Munk moment"),
        ({"fish.fins.0.area": 0.006, "fish.fins.1.area": 0.006}, "static margin -"),
        ({"fish.centre_of_gravity.z": "0.001 m"}, "capsize"),
        ({"lines.primary.length": 2.0}, "fish: hangs down to"),
        ({"run.carriage_speed": 2.0}, "crank periods behind settling_time"),
        ({"sensors.fish_pressure.full_scale": 10000}, "full scale is 10000 Pa"),
        ({"sensors.carriage_encoder.counts_per_revolution": 40000}, "carriage_encoder: 80000"),
        ({"board.sample_rate": 5}, "10.0 samples a crank period"),
    ],
)
def test_implausible_rig_is_told(changes, warning):
    found = warnings(replaced(load_rig(RIG), changes))
    assert any(warning in line for line in found), found
