# SPDX-License-Identifier: Apache-2.0
"""Whole studies: results, what fails, going on after a stop, keeping studies apart."""

import json
import math

import pyarrow.parquet as pq
import pytest
from small_study import SMALL
from towtank_study.designs import samples
from towtank_study.errors import StudyError
from towtank_study.evaluation import Outcome, TowEvaluation, changed
from towtank_study.journal import Journal
from towtank_study.results import unit_of
from towtank_study.running import JOURNAL, run_study
from towtank_study.summary import by_reason


def test_results_hold_units_and_texts(plan, one_thread, tmp_path):
    planned = plan()
    summary = run_study(planned, tmp_path / "o", one_thread, 1)
    table = pq.read_table(tmp_path / "o" / "results.parquet")
    assert table.column_names == [
        "sample", "lines.secondary.length", "heave_ratio_nose", "depressor_heave", "top_tension",
        "error",
    ]  # fmt: skip
    assert table["lines.secondary.length"].to_pylist() == [1.0, 1.5, 2.0]
    assert [unit_of(table, name) for name in table.column_names[1:5]] == ["m", "1", "m", "N"]
    assert table.schema.metadata[b"study"].decode() == planned.file.text
    assert table.schema.metadata[b"rig"].decode() == planned.rig.text
    assert summary["failed"] == 0
    assert summary == json.loads((tmp_path / "o" / "summary.json").read_text())
    ratios = table["heave_ratio_nose"].to_pylist()
    assert summary["outputs"]["heave_ratio_nose"]["greatest"]["value"] == max(ratios)
    assert summary["curves"][0]["y"] == "heave_ratio_nose"
    assert summary["curves"][0]["last"] == {"at": 2.0, "value": ratios[-1]}


def test_the_report_needs_nothing_else(plan, one_thread, tmp_path):
    text = "statement: Longer is <better>.\nreferences:\n"
    text += "  - {output: heave_ratio_nose, label: experiments, band: [0.22, 0.24]}\n"
    run_study(plan(SMALL + text), tmp_path / "o", one_thread, 1)
    html = (tmp_path / "o" / "report.html").read_text()
    assert "Longer is &lt;better&gt;." in html
    assert 'id="chart-0"' in html
    assert "experiments" in html
    assert "src=" not in html.split("</script>")[-1]
    assert '<script src="http' not in html


def test_histories_of_chosen_samples(plan, one_thread, tmp_path):
    """What they show is what was measured."""
    run_study(plan(SMALL + "histories: [1]\n"), tmp_path / "o", one_thread, 1)
    history = pq.read_table(tmp_path / "o" / "histories.parquet")
    assert set(history["sample"].to_pylist()) == {1}
    assert set(history["stretch"].to_pylist()) == {"measured"}  # it settles for less than 40 s
    assert history.num_rows == 2 * 64 + 1
    assert unit_of(history, "fish_pitch") == "deg"
    tension = history["top_tension"].to_numpy()[:-1].mean()
    results = pq.read_table(tmp_path / "o" / "results.parquet")
    assert tension == pytest.approx(results["top_tension"][1].as_py(), rel=1e-12)
    assert "Over time: sample 1" in (tmp_path / "o" / "report.html").read_text()


def test_what_cannot_be_solved_says_why(plan, one_thread, tmp_path):
    text = SMALL.replace("values: [1.0, 1.5, 2.0]", "values: [1.0, -1.0]").replace(
        "parameters:\n",
        "parameters:\n  - {path: simulation.integrator, values: [Box, HHT(alpha=0.1)]}\n",
    )
    summary = run_study(plan(text), tmp_path / "o", one_thread, 1)
    errors = pq.read_table(tmp_path / "o" / "results.parquet")["error"].to_pylist()
    assert errors[0] is None
    assert "lines.secondary.length: -1 is impossible" in errors[1]
    assert "alpha" in errors[2]
    assert errors[3] is not None
    assert (summary["samples"], summary["failed"]) == (4, 3)


def test_errors_are_counted_by_reason():
    texts = [
        "no tow: 1.5 N at t = 2 s",
        "alpha too high",
        "alpha too high",
        "no tow: 3e-05 N at t = 7 s",
    ]
    assert by_reason([*texts, "no tow: 2 N at t = 9 s"]) == {texts[0]: 3, texts[1]: 2}


def test_linked_paths_and_values_beyond_the_rigs_range(plan):
    also = "    also: [{path: depressor.mass, factor: 2, offset: 3}]\n"
    planned = plan(SMALL.replace("design:", f"{also}design:"))
    rig, _ = changed(planned.file.study, planned.rig, {"lines.secondary.length": 7.5})
    assert rig.lines.secondary.length.value == 7.5
    assert rig.depressor.mass.value == 18.0
    assert rig.lines.primary == planned.rig.lines.primary


def test_a_changed_simulation(plan):
    text = SMALL.replace("lines.secondary.length", "simulation.step").replace("1.0, ", "0.001, ")
    planned = plan(text)
    assert planned.variables[0].unit == "s"
    _, simulation = changed(planned.file.study, planned.rig, {"simulation.step": 0.001})
    assert simulation.step.value == 0.001


class Interrupted(Exception):
    pass


def test_a_stopped_study_goes_on(plan, one_thread, tmp_path):
    """The samples that are in the journal are not evaluated again, and the rest comes out alike."""
    planned = plan()

    def stop_after_first(done: int, total: int) -> None:
        if done:
            raise Interrupted

    with pytest.raises(Interrupted):
        run_study(planned, tmp_path / "o", one_thread, 1, stop_after_first)
    journal = tmp_path / "o" / JOURNAL
    assert len(journal.read_bytes().splitlines()) == 2
    marked = journal.read_text().replace('"error": null', '"error": "from the journal"')
    journal.write_text(marked + '{"sample": 1, "outp')  # cut short by a kill
    run_study(planned, tmp_path / "o", one_thread, 1)
    run_study(planned, tmp_path / "whole", one_thread, 1)
    resumed, whole = (
        pq.read_table(tmp_path / name / "results.parquet").to_pydict() for name in ("o", "whole")
    )
    assert resumed.pop("error") == ["from the journal", None, None]
    assert whole.pop("error") == [None, None, None]
    assert resumed == whole
    assert not journal.exists()


def test_studies_do_not_mix(plan, one_thread, tmp_path):
    run_study(plan(), tmp_path / "o", one_thread, 1)
    other = plan(SMALL.replace("2.0]", "2.5]"))
    with pytest.raises(StudyError, match=r"another study.*--out"):
        run_study(other, tmp_path / "o", one_thread, 1)


def test_a_running_study_is_left_alone(plan, one_thread, tmp_path):
    planned = plan()
    (tmp_path / "o").mkdir()
    with (
        Journal(tmp_path / "o" / JOURNAL, planned.fingerprint, Outcome),
        pytest.raises(StudyError, match="another process"),
    ):
        run_study(planned, tmp_path / "o", one_thread, 1)


def test_a_directory_of_other_things_is_left_alone(plan, one_thread, tmp_path):
    (tmp_path / "o").mkdir()
    (tmp_path / "o" / "precious").write_text("data")
    with pytest.raises(StudyError, match="holds no study"):
        run_study(plan(), tmp_path / "o", one_thread, 1)
    assert [path.name for path in (tmp_path / "o").iterdir()] == ["precious"]


def test_the_journal_gives_back_what_it_took(tmp_path):
    outcomes = [Outcome(3, {"a": 0.1 + 0.2, "b": math.nan}, "why"), Outcome(0, {"a": 1e-300}, None)]
    with Journal(tmp_path / "j", "f", Outcome) as journal:
        journal.append(outcomes)
    with Journal(tmp_path / "j", "f", Outcome) as journal:
        assert journal.findings[0] == outcomes[1]
        assert journal.findings[3].outputs["a"] == 0.1 + 0.2
        assert math.isnan(journal.findings[3].outputs["b"])
    with pytest.raises(StudyError):
        Journal(tmp_path / "j", "other", Outcome)


def test_evaluation_is_repeatable(plan):
    planned = plan()
    evaluation = TowEvaluation(planned.file.text, planned.rig.text)
    values = samples(planned.file.study.design, planned.variables)[1]
    assert evaluation(1, values) == evaluation(1, values)
