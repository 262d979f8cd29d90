# SPDX-License-Identifier: Apache-2.0
"""Faults of a study file are one line with the place, the cause and the mend."""

from pathlib import Path

import pytest
from small_study import SMALL
from towtank_study.designs import samples
from towtank_study.errors import StudyError
from towtank_study.loading import read_document


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ("name: small", "nmae: small", 1, ["nmae", "unknown key"]),
        ("    values: [1.0, 1.5, 2.0]", "    vales: [1.0]", 6, ["parameters.0.vales"]),
        ("values: [1.0, 1.5, 2.0]", "values: 1.0", 6, ["parameters.0.values", "list"]),
        ("    values: [1.0, 1.5, 2.0]", "    mode: 1.0", 6, ["mode", "triangular"]),
        ("    values: [1.0, 1.5, 2.0]", "    levels: 3", 5, ["parameters.0", "range"]),
        ("lines.secondary.length", "lines.tertiary.length", 5, ["no lines.tertiary.length"]),
        ("lines.secondary.length", "lines.secondary", 5, ["section"]),
        ("values: [1.0, 1.5, 2.0]", "range: assumed", 5, ["no range", "give a range"]),
        ("values: [1.0, 1.5, 2.0]", "range: [2, 1]", 5, ["[2, 1]", "lower first"]),
        ("{kind: full_factorial}", "{kind: grid}", 7, ["design", "latin_hypercube"]),
        ("{kind: full_factorial}", "{kind: sobol, samples: 6}", 7, ["power of two", "take 8"]),
        ("{kind: full_factorial}", "{kind: latin_hypercube, samples: x}", 7, ["samples", "'x'"]),
        ("5 s,", "5,", 8, ["simulation.settling_time", "no unit"]),
        ("periods: 2", "integrator: RK4", 8, ["'RK4' is no integrator", "Newmark"]),
        ("periods: 2", "integrator: HHT(-0.1)", 8, ["HHT(alpha=-0.1)"]),
        ("heave_ratio_nose", "heave_ratio_tail", 9, ["heave_ratio_tail", "heave_ratio_nose"]),
        ("outputs:", "histories: [3]\noutputs:", 9, ["no sample 3", "0 to 2"]),
        ("[heave", "[heave: [", 10, ["not valid YAML"]),
    ],
)
def test_faults(plan, old, new, line, words):
    assert SMALL.count(old) >= 1
    with pytest.raises(StudyError) as caught:
        plan(SMALL.replace(old, new, 1))
    text = str(caught.value)
    assert f"study.yaml:{line}:" in text
    assert "\n" not in text
    for word in words:
        assert word in text


def test_a_path_cannot_be_changed_twice(plan):
    also = "    also: [{path: lines.secondary.length}]\n"
    with pytest.raises(StudyError, match=r"lines.secondary.length is changed twice"):
        plan(SMALL.replace("design:", f"{also}design:"))


def test_a_plot_needs_columns_that_are_there(plan):
    with pytest.raises(StudyError, match=r"fish_depth.*outputs"):
        plan(SMALL + "plots:\n  - {x: fish_depth, y: [top_tension]}\n")


def test_no_such_file(tmp_path):
    with pytest.raises(StudyError, match=r"none.yaml: No such file.*check the path"):
        read_document(tmp_path / "none.yaml")


def test_the_readmes_study(plan):
    readme = (Path(__file__).parents[1] / "README.md").read_text()
    planned = plan(readme.split("```yaml\n")[1].split("```")[0])
    taken = samples(planned.file.study.design, planned.variables)
    assert len(taken) == planned.most_samples == 128 * (2 + 2)
    drags = [sample["fish.axial_drag"] for sample in taken]
    assert 0.3 <= min(drags) < max(drags) <= 2.5  # the rig's assumed range
