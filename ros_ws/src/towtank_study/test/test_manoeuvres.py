# SPDX-License-Identifier: Apache-2.0
"""Manoeuvre studies: known answers, cases, and what they leave."""

import json
import math

import pyarrow.parquet as pq
import pytest
from towtank_rig.document import Document
from towtank_study.errors import StudyError
from towtank_study.manoeuvre_run import case_of, pass_through
from towtank_study.manoeuvre_study import plan_manoeuvre
from towtank_study.results import unit_of
from towtank_study.running import JOURNAL, run_study

TEXT = """\
name: small
description: A short cable with a heavy body.
water: {density: 1000 kg/m^3, gravity: 9.81 m/s^2}
cable:
  length: 50 m
  diameter: 0.01 m
  mass_per_length: 0.4 kg/m
  weight_in_water_per_length: 3.0 N/m
  axial_stiffness: 5.0e6 N
  normal_drag: 1.2
  tangential_drag: 0.01
  added_mass: 1.0
  segments: 10
body: {mass: 100 kg, apparent_mass_in_water: 80 kg, drag_area: 0.05 m^2, added_mass: 10 kg}
manoeuvre:
  {kind: turn, speed: 2 m/s, start: 5 s, angle: 6.283185307179586 rad, circle_time: 150 s,
   entry_time: 10 s, end: 260 s}
step: 0.1 s
"""
STOP = TEXT.replace(
    "kind: turn, speed: 2 m/s, start: 5 s, angle: 6.283185307179586 rad, circle_time: 150 s,\n   "
    "entry_time: 10 s, end: 260 s",
    "kind: stop, speed: 2 m/s, start: 5 s, stopping_time: 4 s, end: 200 s",
)


def planned(text: str = TEXT):
    return plan_manoeuvre(Document(text, "small.yaml"))


def test_a_heavy_body_on_a_short_cable_turns_a_little_inside():
    """Drag holds the cable back, so that on a circle it points inward: the body's radius is below
    the ship's, and as it goes slower it hangs deeper."""
    figures = pass_through(0, planned().study).figures
    assert figures["ship_radius"] == pytest.approx(2 * 150 / (2 * math.pi))
    assert 0.5 * figures["ship_radius"] < figures["body_radius"] < figures["ship_radius"]
    assert figures["depth_in_turn"] > figures["depth_before"]
    # Straight again, it takes a few cable lengths at 2 m/s to recover.
    assert 0 < figures["recovery_time"] < 60
    assert figures["depth_at_end"] == pytest.approx(figures["depth_before"], rel=1e-3)


def test_after_a_stop_the_tow_hangs_straight_down():
    figures = pass_through(0, planned(STOP).study).figures
    # It hangs at rest: 50 m and the stretch of (80 g + half of 150 N) over EA, 9 mm.
    assert figures["depth_at_end"] == pytest.approx(50.009, abs=0.01)
    assert figures["depth_before"] < 49
    assert 5 < figures["time_to_rest"] < 190
    # Along a steadily towed cable the tension rises by w dz and by skin friction, at most
    # ½ρ Ct π d U² L = 31 N here; the uppermost segment feels half of its own weight, 7.5 N.
    body = math.hypot(80 * 9.81, 0.5 * 1000 * 0.05 * 2**2)
    least = body + 3.0 * figures["depth_before"] - 7.5
    assert least < figures["top_tension_before"] < least + 31


def test_cases_change_the_study():
    document = Document(TEXT, "small.yaml")
    assert case_of(document, {"cable.length": "70 m"}).cable.length.value == 70.0
    with pytest.raises(StudyError, match=r"case 'light': .*apparent_mass_in_water"):
        planned(TEXT + "cases:\n  light: {body.mass: 50 kg}\n")


def test_what_it_leaves(one_thread, tmp_path):
    text = STOP.replace("end: 200 s", "end: 20 s").replace(
        "description", "statement: It <takes> time.\ndescription"
    )
    study = planned(text + "cases:\n  slower: {manoeuvre.speed: 1 m/s}\n")
    summary = run_study(study, tmp_path / "o", one_thread, 1)
    assert summary == json.loads((tmp_path / "o" / "summary.json").read_text())
    assert summary["cases"]["slower"]["changes"] == {"manoeuvre.speed": "1 m/s"}
    assert summary["cases"]["as given"]["figures"]["time_to_rest"] is None  # not within 20 s
    table = pq.read_table(tmp_path / "o" / "histories.parquet")
    assert table.num_rows == 2 * 21
    assert unit_of(table, "body_velocity_x") == "m/s"
    assert table.schema.metadata[b"study"].decode() == study.document.text
    html = (tmp_path / "o" / "report.html").read_text()
    assert "It &lt;takes&gt; time." in html
    assert 'id="chart-2"' in html
    results = pq.read_table(tmp_path / "o" / "results.parquet")
    assert results["case"].to_pylist() == ["as given", "slower"]
    assert results["greatest_depth"][1].as_py() > results["greatest_depth"][0].as_py()
    assert unit_of(results, "greatest_depth") == "m"


class Interrupted(Exception):
    pass


def test_a_stopped_manoeuvre_study_goes_on_and_mixes_with_no_other(one_thread, tmp_path):
    """A case that is in the journal is not simulated again, and the rest comes out alike."""
    short = STOP.replace("end: 200 s", "end: 20 s")
    text = short + "cases:\n  slower: {manoeuvre.speed: 1 m/s}\n"

    def stop_after_first(done: int, total: int) -> None:
        if done:
            raise Interrupted

    with pytest.raises(Interrupted):
        run_study(planned(text), tmp_path / "o", one_thread, 1, stop_after_first)
    journal = tmp_path / "o" / JOURNAL
    header, first = journal.read_text().splitlines()
    entry = json.loads(first)
    assert entry["figures"]["time_to_rest"] is None
    entry["figures"]["time_to_rest"] = 7.0  # to be known again
    journal.write_text(f'{header}\n{json.dumps(entry)}\n{{"sample": 1, "ti')  # cut short by a kill
    resumed = run_study(planned(text), tmp_path / "o", one_thread, 1)
    whole = run_study(planned(text), tmp_path / "whole", one_thread, 1)
    assert resumed["cases"]["as given"]["figures"].pop("time_to_rest") == 7.0
    assert whole["cases"]["as given"]["figures"].pop("time_to_rest") is None
    assert resumed == whole
    histories = [pq.read_table(tmp_path / name / "histories.parquet") for name in ("o", "whole")]
    assert histories[0].equals(histories[1])
    assert not journal.exists()
    with pytest.raises(StudyError, match=r"another study.*--out"):
        run_study(planned(short), tmp_path / "o", one_thread, 1)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("end: 260 s", "end: 3 s", ["manoeuvre.end", "ends before it starts"]),
        ("kind: turn", "kind: loop", ["no such kind", "turn", "stop"]),
        ("2 m/s", "2 kn", ["manoeuvre.speed", "'kn' is not accepted"]),
        (
            "apparent_mass_in_water: 80",
            "apparent_mass_in_water: 120",
            ["more in water than in air"],
        ),
    ],
)
def test_faults(old, new, words):
    with pytest.raises(StudyError) as caught:
        planned(TEXT.replace(old, new))
    for word in words:
        assert word in str(caught.value)
