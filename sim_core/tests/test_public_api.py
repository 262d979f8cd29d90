# SPDX-License-Identifier: Apache-2.0
"""What the package offers: listed, described in docstrings, and spoken of in its pages."""

import re
from pathlib import Path
from types import ModuleType

import sim_core as sc

ROOT = Path(__file__).parents[1]


def test_all_public_names_are_listed():
    public = {
        name
        for name, value in vars(sc).items()
        if not name.startswith("_") and not isinstance(value, ModuleType)
    }
    assert set(sc.__all__) == public
    assert len(sc.__all__) == len(public)


def test_all_public_names_have_a_docstring():
    for name in sc.__all__:
        assert getattr(sc, name).__doc__, name


def test_compiled_methods_have_a_docstring():
    for cls in (sc.Model, sc.ModelBuilder, sc.Simulator, sc.State):
        for name, member in vars(cls).items():
            if name.startswith("_") or name == "model":
                continue
            function = member.fget if isinstance(member, property) else member
            for _, docstring, _ in function.__nb_signature__:
                assert docstring, f"{cls.__name__}.{name}"


def test_the_pages_speak_of_everything_public():
    pages = [ROOT / "README.md", ROOT / "docs" / "guide.md", ROOT / "docs" / "theory.md"]
    words = set(re.findall(r"\w+", " ".join(page.read_text(encoding="utf-8") for page in pages)))
    assert sorted(set(sc.__all__) - words) == []
