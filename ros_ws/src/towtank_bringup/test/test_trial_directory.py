# SPDX-License-Identifier: Apache-2.0
"""A trial's directory is marked until the trial is whole, and the progress line is readable."""

from __future__ import annotations

import errno
import io
import os
import shutil

import pytest
from towtank_bringup.closing import IncompleteTrial, marked
from towtank_bringup.conductor import TrialError
from towtank_bringup.progress import ProgressLine
from towtank_bringup.trial_directory import TrialDirectory, TrialDirectoryError


@pytest.fixture
def directory(tmp_path):
    directory = TrialDirectory(tmp_path / "trial")
    directory.create()
    return directory


def marks(directory):
    return sorted(path.name for path in directory.path.iterdir())


def test_existing_directory_is_never_used(directory):
    with pytest.raises(TrialDirectoryError, match=f"output directory {directory.path} exists"):
        directory.create()


def test_mark_goes_when_the_trial_is_whole(directory):
    with marked(directory):
        assert marks(directory) == ["IN_PROGRESS"]
    assert marks(directory) == []


def test_mark_goes_once_the_result_is_on_the_disk(directory, monkeypatch):
    """A power cut must not leave an empty result in a directory that looks whole."""
    calls = []
    sync, unlink = os.fsync, os.unlink
    monkeypatch.setattr(os, "fsync", lambda fd: calls.append(os.fstat(fd).st_ino) or sync(fd))
    monkeypatch.setattr(os, "unlink", lambda name, **k: calls.append(name) or unlink(name, **k))
    with marked(directory):
        directory.result.write_text("{}")
        directory.report.write_text("<html>")
    files = [directory.result.stat().st_ino, directory.report.stat().st_ino]
    assert calls[:3] == [*files, "IN_PROGRESS"]


def test_a_disk_that_fails_at_the_end_is_one_line(directory, monkeypatch):
    def failing(descriptor):
        raise OSError(errno.EIO, "Input/output error")

    with pytest.raises(IncompleteTrial, match="Input/output error"), marked(directory):
        directory.result.write_text("{}")
        monkeypatch.setattr(os, "fsync", failing)
    assert "INCOMPLETE" in marks(directory)


@pytest.mark.parametrize(
    "fault",
    [
        TrialError("/recorder: no room"),
        OSError(errno.ENOSPC, "No space left on device", "result.json"),
    ],
)
def test_fault_marks_the_trial_and_is_one_line(directory, fault):
    with pytest.raises(IncompleteTrial) as told, marked(directory):
        raise fault
    assert marks(directory) == ["INCOMPLETE"]
    assert "\n" not in str(told.value)
    assert "marked incomplete" in str(told.value)


def test_a_trial_that_is_renamed_is_marked_and_closed_where_it_is(directory, tmp_path):
    old, new = directory.path, tmp_path / "run 7"
    assert not directory.renamed
    old.rename(new)
    old.mkdir()  # something else, by its name
    directory.check()
    assert directory.renamed
    assert directory.bag == new / "bag"
    assert directory.result == new / "result.json"
    with pytest.raises(IncompleteTrial), marked(directory):
        raise TrialError("any")
    assert [path.name for path in new.iterdir()] == ["INCOMPLETE"]
    assert not list(old.iterdir())


def test_a_trial_that_is_removed_ends_with_one_line(directory, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.rmtree(directory.path)
    with pytest.raises(IncompleteTrial) as told, marked(directory):
        directory.check()
    assert str(told.value) == (
        f"{directory.path}: somebody has removed the trial's directory: leave it alone and start "
        f"again (its directory cannot be marked incomplete: No such file or directory; see "
        f"{tmp_path}/trial.INCOMPLETE)"
    )
    assert str(directory.path) in (tmp_path / "trial.INCOMPLETE").read_text()


@pytest.mark.parametrize("parent_fails", [False, True])
def test_a_disk_that_fails_is_marked_beside_it(directory, tmp_path, monkeypatch, parent_fails):
    """On the disk above, or where the command was started."""
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)

    def failing(*_, **__):
        raise OSError(errno.EIO, "Input/output error")

    opened = os.open

    def failing_open(path, *arguments, **keywords):
        if os.path.dirname(path) == str(tmp_path):
            failing()
        return opened(path, *arguments, **keywords)

    monkeypatch.setattr("os.replace", failing)
    if parent_fails:
        monkeypatch.setattr("os.open", failing_open)
    with pytest.raises(IncompleteTrial) as told, marked(directory):
        raise TrialError("/recorder: cannot write")
    mark = (elsewhere if parent_fails else tmp_path) / "trial.INCOMPLETE"
    assert str(told.value).endswith(
        f"(its directory cannot be marked incomplete: Input/output error; see {mark})"
    )
    assert mark.exists()
    assert marks(directory) == ["IN_PROGRESS"]


def test_abandoned_trial_is_marked_and_one_that_has_ended_keeps_its_mark(directory):
    directory.abandon()
    assert marks(directory) == ["INCOMPLETE"]
    directory.abandon()
    assert marks(directory) == ["INCOMPLETE"]


def test_whole_trial_is_not_abandoned(directory):
    directory.complete()
    directory.abandon()
    assert marks(directory) == []


def test_interrupt_marks_the_trial_and_passes(directory):
    with pytest.raises(KeyboardInterrupt), marked(directory):
        raise KeyboardInterrupt
    assert marks(directory) == ["INCOMPLETE"]


def test_progress_in_a_log_prints_each_stage_once():
    stream = io.StringIO()
    say = ProgressLine(stream)
    for line in ("starting the graph", "logging 0.1 of 40 s", "logging 0.2 of 40 s", "stopping"):
        say(line)
    assert stream.getvalue().splitlines() == [
        "starting the graph",
        "logging 0.1 of 40 s",
        "stopping",
    ]


class _Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("kind", [io.StringIO, _Terminal])
def test_every_warning_stands(kind):
    """Two at once, and progress behind them."""
    stream = kind()
    say = ProgressLine(stream)
    for line in ("logging 0.1 of 40 s", "warning: one", "warning: two", "logging 0.2 of 40 s"):
        say(line)
    shown = [line.rpartition("\033[K")[2] for line in stream.getvalue().split("\n")]
    assert shown[-3:-1] == ["warning: one", "warning: two"]
