# SPDX-License-Identifier: Apache-2.0
"""The laboratory's verbs on the worked examples of docs/laboratory.md, and on bad input."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner
from towtank_bringup.cli import towtank
from towtank_rig import load_rig

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
