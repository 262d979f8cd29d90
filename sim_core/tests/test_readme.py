# SPDX-License-Identifier: Apache-2.0
"""The examples of the README and of the user guide run as they stand."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def names_after(page: Path) -> dict[str, object]:
    """Run the examples of a page one after the other; return what they defined."""
    names: dict[str, object] = {}
    text = page.read_text(encoding="utf-8")
    for match in re.finditer(r"^```python\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE):
        line = text.count("\n", 0, match.start(1))
        exec(compile("\n" * line + match[1], page, "exec"), names)
    return names


@pytest.fixture(autouse=True)
def in_an_empty_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_examples_of_the_readme_run():
    names = names_after(ROOT / "README.md")
    assert names["simulator"].time == 0.02
    assert names["result"].lines["cable"].start_tension.min() > 0


def test_examples_of_the_guide_run(tmp_path):
    names = names_after(ROOT / "docs" / "guide.md")
    made = {file.name for file in tmp_path.iterdir()}
    assert made == {"shape.png", "tow.gif", "tow.nc", "tow_vtk", "tow.txt"}
    assert names["heavier"].build().points == names["model"].points
    assert names["simulator"].time == 1.0
    assert names["deck"].warnings == ()
