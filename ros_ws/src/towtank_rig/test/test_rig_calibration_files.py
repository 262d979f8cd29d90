# SPDX-License-Identifier: Apache-2.0
"""Calibrations in files of their own: a rig that refers to them, and its text that does without."""

from __future__ import annotations

import datetime
from pathlib import Path

import pytest
from towtank_rig import RigError, load_rig, parse_rig
from towtank_rig.calibration_files import parse_calibration_file
from towtank_rig.check import calibration_warnings, check_rig
from towtank_rig.conversion import pressure_conversion
from towtank_rig.loading import replaced

RIG = Path(__file__).parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml"
ID = "fish_pressure-20261124T101500Z"
RECORD = f"""\
id: {ID}
sensor: fish_pressure
made_at: 2026-11-24T10:15:00Z
made_by: A. Experimenter
software: towtank 0.1.0
rig: nit_calicut_2012
reference: steel tape no. 7, certificate 2026-031
board: {{serial: 0000002a, firmware: 0.1.0, schema_hash: 0badcafe}}
due: 2027-05-24
readings:
  - {{depth_m: 0.0, volts: 1.0e-5}}
  - {{depth_m: 2.0, volts: 0.0155}}
fit: {{scatter: 1.0e-6}}
calibration:
  span: 0.0396 V
  offset: 1.0e-5 V
  fitted_range: 19500 Pa
  span_error: {{value: 0.004, distribution: normal}}
"""


@pytest.fixture
def rig_file(tmp_path):
    """A copy of the rig whose fish pressure refers to a file beside it."""
    (tmp_path / "calibrations").mkdir()
    (tmp_path / "calibrations" / f"{ID}.yaml").write_text(RECORD)
    reference = {"file": f"calibrations/{ID}.yaml", "id": ID}
    path = tmp_path / "referring.yaml"
    document = load_rig(RIG)._document
    changes = {"calibrations.fish_pressure": reference, "name": "referring"}
    path.write_text(document.replaced(changes))
    return path


def test_the_file_is_in_force(rig_file):
    rig = load_rig(rig_file)
    calibration = rig.calibrations.fish_pressure
    assert (calibration.id, calibration.span.value) == (ID, 0.0396)
    assert calibration.date == datetime.date(2026, 11, 24)
    assert calibration.file == f"calibrations/{ID}.yaml"
    assert pressure_conversion(rig, "fish_pressure").span == 0.0396
    assert rig.calibrations.depressor_pressure.id == "depressor-pressure-assumed"


def test_the_text_explains_itself_without_the_file(rig_file):
    """It is what a recorder stores: read anywhere, it is the same rig; the record comes along."""
    rig = load_rig(rig_file)
    again = parse_rig(rig.text)
    assert dict(again.quantities()) == dict(rig.quantities())
    assert again.calibrations == rig.calibrations
    assert rig.calibration_records == {f"calibrations/{ID}.yaml": RECORD}
    assert replaced(rig, {"run.ramp_time": 5.0}).calibration_records == rig.calibration_records
    assert rig.text.count("# ") == rig_file.read_text().count("# ")  # comments stay


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (f"id: {ID}", "id: another", "holds another of fish_pressure; refer to the file"),
        ("sensor: fish", "sensor: depressor", "holds .* of depressor_pressure"),
        ("span: 0.0396 V", "span: 39.6 mV", "span: unit 'mV' is not accepted"),
        ("made_by: A. Experimenter\n", "", "made_by: Field required"),
        ("  offset: 1.0e-5 V\n", "", "offset: Field required"),
    ],
)  # fmt: skip
def test_faults_of_the_file_are_told_in_one_line(rig_file, old, new, words):
    file = rig_file.parent / "calibrations" / f"{ID}.yaml"
    assert old in RECORD
    file.write_text(RECORD.replace(old, new))
    with pytest.raises(RigError, match=words) as fault:
        load_rig(rig_file)
    assert "\n" not in str(fault.value)
    assert [str(f) for f in check_rig(rig_file)] == [str(fault.value)]


def test_missing_file_and_missing_place_are_told(rig_file):
    with pytest.raises(RigError, match=r"fish_pressure: refers to a file.*load the rig's own file"):
        parse_rig(rig_file.read_text())
    (rig_file.parent / "calibrations" / f"{ID}.yaml").unlink()
    with pytest.raises(RigError, match=rf"calibrations.fish_pressure: .*{ID}.yaml cannot be read"):
        load_rig(rig_file)


def test_what_is_missing_or_out_of_date_is_told(rig_file):
    rig = load_rig(rig_file)
    on_the_day = calibration_warnings(rig, datetime.date(2027, 5, 24))
    assert [line.partition(":")[0] for line in on_the_day] == [
        "calibrations.depressor_pressure",
        "calibrations.accelerometer",
        "calibrations.crank",
    ]  # the first two are assumed and have no record, the last is not there
    after = calibration_warnings(rig, datetime.date(2027, 5, 25))
    assert after[0].startswith(f"calibrations.fish_pressure: {ID} was due on 2027-05-24")
    bare = calibration_warnings(replaced(rig, {"calibrations": {}}), datetime.date(2027, 1, 1))
    assert len(bare) == 4 and all("there is none" in line for line in bare)


def test_a_record_is_read_whole():
    record = parse_calibration_file(RECORD, "record.yaml")
    assert record.board.serial == "0000002a"
    assert record.readings[1] == {"depth_m": 2.0, "volts": 0.0155}
