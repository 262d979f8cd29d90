# SPDX-License-Identifier: Apache-2.0
"""A study knows by what it was computed, the project's own Python included."""

import shutil
import subprocess
import sys

import pytest
import towtank_study.software
from towtank_study.errors import StudyError
from towtank_study.running import JOURNAL, run_study
from towtank_study.software import PACKAGES, digest, folders

IMPORTED = """
import sys
import towtank_study.evaluation, towtank_study.histories, towtank_study.running
ours = {name.partition(".")[0] for name in sys.modules}
print(*sorted(name for name in ours if name.startswith("towtank_") or name == "sim_core"))
"""


class Interrupted(Exception):
    pass


def interrupt(done: int, total: int) -> None:
    if done:
        raise Interrupted


def test_an_edit_of_a_source_makes_another_study(plan, one_thread, tmp_path, monkeypatch):
    """Neither a study that was stopped nor one that is finished takes results of both."""
    with pytest.raises(Interrupted):
        run_study(plan(), tmp_path / "stopped", one_thread, 1, interrupt)
    assert (tmp_path / "stopped" / JOURNAL).exists()
    run_study(plan(), tmp_path / "finished", one_thread, 1)
    before = folders()
    for package in PACKAGES:
        edited = tmp_path / package
        shutil.copytree(before[package], edited)
        with monkeypatch.context() as patch:
            patch.setattr(
                towtank_study.software,
                "folders",
                lambda changed=before | {package: edited}: changed,
            )
            run_study(plan(), tmp_path / "finished", one_thread, 1)  # a copy is the same software
            with (edited / "__init__.py").open("a") as file:
                file.write("EDITED = True\n")
            for name in ("stopped", "finished"):
                with pytest.raises(StudyError, match="another study, rig or version of towtank"):
                    run_study(plan(), tmp_path / name, one_thread, 1)


def test_the_digest_tells_a_moved_text_from_the_same_place(tmp_path):
    (tmp_path / "a.py").write_text("x = 1\n")
    before = digest({"one": tmp_path})
    (tmp_path / "__pycache__").mkdir()
    (tmp_path / "__pycache__" / "a.pyc").write_bytes(b"1")
    assert digest({"one": tmp_path}) == before
    (tmp_path / "a.py").rename(tmp_path / "b.py")
    assert digest({"one": tmp_path}) != before


def test_all_packages_of_the_project_that_take_part_are_known():
    run = subprocess.run(
        [sys.executable, "-c", IMPORTED], capture_output=True, text=True, check=True
    )
    assert run.stdout.split() == sorted(PACKAGES)
