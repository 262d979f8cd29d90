# SPDX-License-Identifier: Apache-2.0
"""The laboratory's verbs on the worked examples of docs/laboratory.md, and on bad input."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from click.testing import CliRunner
from towtank_bringup.cli import towtank
from towtank_daq.description import installed_description, load_description
from towtank_rig import load_rig
from towtank_rig.loading import replaced

EXAMPLES = Path(__file__).parents[4] / "docs" / "laboratory"


def run(*arguments: object):
    return CliRunner().invoke(towtank, [str(argument) for argument in arguments])


def json_of(*arguments: object):
    result = run(*arguments, "--json")
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def test_inertia_of_the_rod():
    found = json_of("inertia", EXAMPLES / "rod.yaml")
    assert found["inertia"]["value"] == pytest.approx(
        0.3086, abs=5e-5
    )  # as docs/laboratory.md has it
    assert found["inertia"]["u95"] == pytest.approx(0.0078, abs=5e-5)
    assert found["theory"] == pytest.approx(0.33349, abs=5e-6)
    table = run("inertia", EXAMPLES / "rod.yaml").stdout
    assert "0.30859 ± 0.00782 kg m²" in table and "string distance" in table


def test_trim_of_the_fish():
    found = json_of("trim", EXAMPLES / "fish_trim.yaml")
    assert found["ballast"]["mass"]["value"] == pytest.approx(0.2838, abs=5e-5)
    assert found["results"]["resting_pitch"]["unit"] == "rad"
    assert "ballast: mass" in run("trim", EXAMPLES / "fish_trim.yaml").stdout


def test_similitude_writes_a_valid_rig_and_overwrites_none(tmp_path):
    out = tmp_path / "half.yaml"
    found = json_of("similitude", "nit_calicut_2012", "--scale", 0.5, "--out", out)
    assert load_rig(out).lines.primary.length.value == pytest.approx(0.6)
    assert {"Reynolds number, depressor"} <= {effect["name"] for effect in found["effects"]}
    before = out.read_text()
    again = run("similitude", "nit_calicut_2012", "--scale", 0.25, "--out", out)
    assert again.exit_code == 1 and "exists: give another file" in again.output
    assert out.read_text() == before


@pytest.mark.parametrize("verb", ["inertia", "trim"])
def test_files_of_another_kind_are_refused_in_one_line(verb):
    other = EXAMPLES / {"inertia": "fish_trim.yaml", "trim": "rod.yaml"}[verb]
    result = run(verb, other)
    assert result.exit_code == 1
    (line,) = result.output.strip().splitlines()
    assert line.startswith(f"Error: {other}:") and "; " in line


WHO = ("--rig", "nit_calicut_2012", "--by", "A. Tester", "--reference", "steel tape no. 7")


@pytest.mark.parametrize(
    ("procedure", "readings", "sensor"),
    [
        (["pressure", "fish_pressure"], "fish_pressure_readings.csv", "fish_pressure"),
        (["accelerometer"], "accelerometer_readings.csv", "accelerometer"),
        (["crank"], "crank_readings.csv", "crank"),
    ],
)
def test_calibration_from_readings_becomes_part_of_a_new_rig(tmp_path, procedure, readings, sensor):
    """What the examples' heads say they were made of, in the rig that refers to the record."""
    new = tmp_path / "mine.yaml"
    found = json_of(
        "calibrate", *procedure, *WHO, "--readings", EXAMPLES / readings,
        "--out", tmp_path / "calibrations", "--new-rig", new,
    )  # fmt: skip
    calibration = getattr(load_rig(new).calibrations, sensor)
    assert calibration.id == found["id"]
    assert (tmp_path / "calibrations" / f"{found['id']}.yaml").is_file()
    assert Path(found["plot"]).read_text().startswith("<?xml")
    intervals = {f["name"]: f for f in found["findings"]}
    made_of = {
        "fish_pressure": {"span": 39.62e-3, "offset": 0.21e-3},
        "accelerometer": {
            "x: sensitivity": 66.8e-3,
            "x: zero": 1.662,
            "y: zero": 1.641,
            "z: zero": 1.655,
        },
        "crank": {"counts per turn": -4096.0, "angle at mark 0": 0.05236, "crank radius": 0.06},
    }[sensor]
    told = {  # by docs/laboratory.md: value, interval, half a unit of the last digit
        "fish_pressure": {"span": (39.626e-3, 0.061e-3, 0.5e-6)},
        "accelerometer": {
            "x: sensitivity": (66.80e-3, 0.11e-3, 5e-6),
            "x: zero": (1.6619, 0.0035, 5e-5),
        },
        "crank": {"angle at mark 0": (0.050, 0.012, 0.5e-3)},
    }
    for name, (value, u95, digit) in told[sensor].items():
        assert intervals[name]["value"] == pytest.approx(value, abs=digit)
        assert intervals[name]["u95"] == pytest.approx(u95, abs=digit)
    for name, truth in made_of.items():
        assert abs(intervals[name]["value"] - truth) <= intervals[name]["u95"], name


def test_rig_without_calibrations_gets_its_first(tmp_path):
    new = tmp_path / "first.yaml"
    json_of(
        "calibrate", "crank", "--rig", "wu_chwang_2001", "--by", "A", "--reference", "disc",
        "--readings", EXAMPLES / "crank_readings.csv", "--out", tmp_path / "c", "--new-rig", new,
    )  # fmt: skip
    calibrations = load_rig(new).calibrations
    assert calibrations.crank.direction == -1 and calibrations.fish_pressure is None


def test_second_calibration_of_a_rig_tells_its_drift(tmp_path):
    first = tmp_path / "first.yaml"
    common = ["calibrate", "pressure", "fish_pressure", "--by", "A", "--reference", "tape"]
    readings = EXAMPLES / "fish_pressure_readings.csv"
    json_of(*common, "--rig", "nit_calicut_2012", "--readings", readings,
            "--out", tmp_path / "a", "--new-rig", first)  # fmt: skip
    again = json_of(*common, "--rig", first, "--readings", readings, "--out", tmp_path / "b")
    assert again["drift"]["against"].startswith("fish_pressure-20")
    assert again["drift"]["normalised"] == pytest.approx(0.0, abs=1e-9)
    drifted = tmp_path / "drifted.csv"
    lines = ["depth_m,volts"]
    lines += [f"{d},{2e-4 + 0.0400 * d * 9747.8 / 5e4}" for d in (0, 0.5, 1, 1.5, 2, 1, 0)]
    drifted.write_text("\n".join(lines))
    later = json_of(*common, "--rig", first, "--readings", drifted, "--out", tmp_path / "c")
    assert later["drift"]["span_relative"] == pytest.approx(0.0400 / 0.039626 - 1, abs=1e-4)
    assert later["drift"]["normalised"] > 1.0 and "find out why" in later["notes"][0]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("depth_m,mV\n0,1\n", "no column volts"),
        ("depth_m,volts\n0,x\n", ":2: volts is 'x': write a number"),
        ("depth_m,volts\n0\n", ":2: 1 values for 2 columns"),
        ("# nothing\n", "there are no readings"),
        ("depth_m,volts\n0,0\n1,1\n", "2 immersions at 2 depths"),
    ],
)
def test_readings_that_do_not_serve_are_refused_in_one_line(tmp_path, text, words):
    path = tmp_path / "readings.csv"
    path.write_text(text)
    result = run(
        "calibrate", "pressure", "fish_pressure", *WHO, "--readings", path, "--out", tmp_path / "o"
    )
    assert result.exit_code == 1
    (line,) = result.output.strip().splitlines()
    assert words in line
    assert not (tmp_path / "o").exists()


def test_one_source_of_readings_is_wanted(tmp_path):
    assert "give one of --port, --virtual" in run("calibrate", "crank", *WHO).output
    for option, text in (("--angles", "0,nan"), ("--mark-limit", "-1")):
        bad = run("calibrate", "crank", *WHO, "--virtual", option, text)
        assert bad.exit_code == 2 and option in bad.output
    missing = run("calibrate", "crank", *WHO, "--port", tmp_path / "ttyACM9")
    assert missing.exit_code == 1 and "does not exist" in missing.output


def test_rig_check_tells_of_calibrations():
    found = json_of("rig", "check", "nit_calicut_2012")
    told = [w for w in found["warnings"] if w.startswith("calibrations.")]
    assert len(told) == 4 and all("towtank calibrate" in line for line in told)


@pytest.mark.real_time
def test_crank_is_calibrated_at_the_virtual_board_from_the_terminal(tmp_path, monkeypatch):
    """First given up after two marks, then done; mark 0 after a whole turn and back."""
    monkeypatch.chdir(tmp_path)
    command = [
        "calibrate", "crank", *WHO, "--virtual", "--seconds", "1", "--angles", "0,90,180,270,360",
        "--out", str(tmp_path / "records"), "--json",
    ]  # fmt: skip
    given_up = CliRunner().invoke(towtank, command, input="\n\n")
    assert given_up.exit_code == 1 and "the 2 readings so far are in" in given_up.stderr
    (left,) = tmp_path.glob("readings-*.csv")
    assert left.read_text().splitlines()[0] == "angle_deg,counts"
    assert not (tmp_path / "records").exists()

    done = CliRunner().invoke(towtank, command, input="\n" * 5)
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["calibration"]["counts_per_revolution"] == 4096
    assert found["calibration"]["direction"] == 1
    record = Path(found["record"]).read_text()
    assert "virtual_board_seed: 1" in record and "schema_hash:" in record


def test_uncertainty_of_a_rig():
    found = json_of("uncertainty", "nit_calicut_2012", "--depth", 2.2, "--draws", 2000)
    assert found["conditions"]["depth"] == 2.2
    by_practice = {(s["unit"], s["practice"]): s for s in found["statements"]}
    # As docs/laboratory.md has them: m, rad and the ratio's own
    for unit, practice, u95 in (
        ("m", "data sheet", 0.171),
        ("m", "data sheet, zeroed", 0.0832),
        ("m", "as calibrated, zeroed, towed at 1 m/s", 0.0129),
        ("rad", "as calibrated, at rest", math.radians(0.632)),
        ("rad", "as calibrated, crank turning", math.radians(0.771)),
        ("1", "as calibrated, towed", 0.0214),
    ):
        assert by_practice[unit, practice]["u95"] == pytest.approx(u95, rel=5e-3), practice
    angle, heave = (budget["u95"] for budget in found["crank"])
    assert math.degrees(angle) == pytest.approx(2.7, abs=0.05)
    assert heave == pytest.approx(2.85e-3, abs=5e-6)
    drawn = by_practice["m", "data sheet, zeroed"]["monte_carlo"]
    assert drawn["low"] < 0 < drawn["high"]
    assumed = {assumption["path"] for assumption in found["assumptions"]}
    assert "calibrations.fish_pressure.span_error" in assumed
    assert found["appendix_iii"]["span_tolerance"] == pytest.approx(0.0275, abs=1e-5)
    table = run("uncertainty", "nit_calicut_2012", "--depth", 2.2, "--draws", 2000).stdout
    assert "as calibrated, zeroed" in table and "± 27.5 mm" in table
    assert "at the ends of what is assumed" in table and "heave of the tow point" in table


def test_uncertainty_takes_the_front_ends_from_the_board():
    """The bridge's: white noise and steps of 2·2.5 V/2²⁴ behind its gain; a pole far above the
    crank's 0.5 Hz, so that lag and attenuation are x and x²/2 to their third and fourth power."""
    found = json_of("uncertainty", "nit_calicut_2012", "--draws", 1000)["front_ends"]
    bridge = found["fish_pressure"]
    channel = load_description(installed_description()).channels[0]
    noise = math.hypot(channel.noise_volts, 5 / 2**24 / math.sqrt(12)) / channel.gain
    assert bridge["noise_volts"] == pytest.approx(noise, rel=1e-9)
    assert bridge["lag"] == pytest.approx(0.5 / channel.pole_hz, rel=1e-3)
    assert bridge["attenuation"] == pytest.approx((0.5 / channel.pole_hz) ** 2 / 2, rel=1e-3)
    assert found["accelerometer"]["gain"] == 1.0


def test_uncertainty_of_a_rig_that_does_not_heave(tmp_path):
    still = tmp_path / "still.yaml"
    rig = load_rig(Path(__file__).parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml")
    changes = {"name": "still", "tow_point.motion.crank_radius": "0 m"}
    still.write_text(replaced(rig, changes).text)
    refused = run("uncertainty", still)
    assert refused.exit_code == 1 and "does not move: give --amplitude" in refused.output
    assert run("uncertainty", still, "--amplitude", 0.05, "--draws", 1000).exit_code == 0


def test_uncertainty_beyond_the_sensors_is_refused():
    """50 kPa are 5.13 m of the tank's water."""
    refused = run("uncertainty", "nit_calicut_2012", "--depth", 6)
    assert refused.exit_code == 1
    assert "--depth 6 m is beyond the 5.13 m where the sensors end: give less" in refused.output
