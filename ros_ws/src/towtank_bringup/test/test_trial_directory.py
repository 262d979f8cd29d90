# SPDX-License-Identifier: Apache-2.0
"""A trial's directory is marked until the trial is whole, and the progress line is readable."""

from __future__ import annotations

import errno
import io

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
