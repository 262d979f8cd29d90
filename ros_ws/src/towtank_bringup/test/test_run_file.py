# SPDX-License-Identifier: Apache-2.0
"""Run files: found, chosen, cleared away, and not believed where another could have made them."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from towtank_bringup import run_file
from towtank_bringup.run_file import (
    RunFileError,
    RunningTrial,
    announced,
    choose_trial,
    running_trials,
)


@pytest.fixture(autouse=True)
def runtime(monkeypatch, tmp_path) -> Path:
    """The user's runtime folder, alone on this machine."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setattr(run_file, "listens", lambda domain: False)  # not other tests' nodes
    places = run_file._places
    monkeypatch.setattr(
        run_file, "_places", lambda: [p for p in places() if p.is_relative_to(tmp_path)]
    )
    return tmp_path / "towtank"


def put(folder: Path, trial: RunningTrial) -> Path:
    """A run file as `trial` would have written it."""
    folder.mkdir(mode=0o700, exist_ok=True)
    path = folder / trial.file_name
    path.write_text(trial.text())
    return path


def here(directory="/trials/a", domain=7) -> RunningTrial:
    return RunningTrial.of_this_process(Path(directory), domain, True)


@pytest.fixture
def child():
    """A process beside this one."""
    process = subprocess.Popen(["sleep", "60"])
    yield process
    process.kill()
    process.wait()


def led_by(process, directory="/trials/b", domain=8) -> RunningTrial:
    start = run_file._process_start(process.pid)
    return replace(here(directory, domain), pid=process.pid, process_start=start)


def test_a_trial_is_found_while_it_runs(runtime):
    directory = Path(os.fsdecode(b"/trials/\xff\xf0\x9f\x9a\xa2 )"))
    with announced(directory, 42, False) as announced_trial:
        assert running_trials() == [announced_trial]
        (path,) = runtime.iterdir()
        assert path.stat().st_mode & 0o777 == 0o600
        assert runtime.stat().st_mode & 0o777 == 0o700
        trial = announced_trial
    assert (trial.directory, trial.domain, trial.on_virtual_tank) == (directory, 42, False)
    assert running_trials() == []
    assert list(runtime.iterdir()) == []


def test_it_goes_when_the_trial_fails(runtime):
    with pytest.raises(OSError, match="disk"), announced(Path("/trials/a"), 1, True):
        raise OSError("disk")
    assert list(runtime.iterdir()) == []


def test_a_dead_trial_is_passed_over_and_cleared_away(runtime, child):
    path = put(runtime, led_by(child))
    assert [trial.pid for trial in running_trials()] == [child.pid]
    child.kill()  # not waited for: a zombie is dead, too
    os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)
    assert running_trials() == []
    assert not path.exists()


def test_a_trial_whose_process_was_killed_but_not_its_nodes_is_still_there(
    runtime, child, monkeypatch
):
    """As under a launch file: its crank may turn, and the verbs must reach it."""
    path = put(runtime, led_by(child))
    child.kill()
    child.wait()
    listening = {8}
    monkeypatch.setattr(run_file, "listens", lambda domain: domain in listening)
    assert [trial.domain for trial in running_trials()] == [8]
    assert path.exists()
    with announced(Path("/trials/c"), 8, True) as later:  # whose nodes they are then
        assert running_trials() == [later]
    listening.clear()
    assert running_trials() == []
    assert not path.exists()


def test_a_halted_trial_is_still_there(runtime, child):
    """One that hangs is the very one whose crank wants stopping."""
    put(runtime, led_by(child))
    child.send_signal(signal.SIGSTOP)
    assert [trial.pid for trial in running_trials()] == [child.pid]


def test_a_process_that_was_given_the_same_number_is_not_the_trial(runtime, child):
    trial = led_by(child)
    path = put(runtime, replace(trial, process_start=trial.process_start - 1))
    assert running_trials() == []
    assert not path.exists()


def test_a_trial_of_another_boot_is_dead(runtime):
    put(runtime, replace(here(), boot="0d9b4a5e-0000-4000-8000-000000000000"))
    assert running_trials() == []


@pytest.mark.parametrize("change", [{"uid": 4_000_000}, {"pid": 1}])
def test_what_a_file_says_against_its_own_name_or_owner_does_not_count(runtime, change):
    trial = here()
    path = put(runtime, trial)
    path.write_text(replace(trial, **change).text())
    assert running_trials() == []


needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")


@needs_root
def test_a_file_of_another_user_does_not_count(runtime):
    path = put(runtime, here())
    os.chown(path, 4_000_000, -1)
    assert running_trials() == []
    assert path.exists()


@needs_root
def test_a_folder_of_another_user_is_neither_read_nor_written(runtime):
    put(runtime, here())
    os.chown(runtime, 4_000_000, -1)
    assert running_trials() == []
    with (
        pytest.raises(RunFileError, match="belongs to another user"),
        announced(Path("/"), 1, True),
    ):
        pass


@needs_root
def test_a_runtime_folder_of_another_user_is_none(runtime):
    """As `sudo -E` inherits it: what root made in it, its owner could not use any more."""
    os.chown(runtime.parent, 4_000_000, -1)
    with pytest.raises(RunFileError, match="set XDG_RUNTIME_DIR"), announced(Path("/"), 1, True):
        pass
    assert not runtime.exists()


def test_a_folder_that_others_can_write_in_does_not_count(runtime):
    put(runtime, here())
    runtime.chmod(0o777)
    assert running_trials() == []
    with pytest.raises(RunFileError, match="written by others"), announced(Path("/"), 1, True):
        pass


def test_links_are_not_followed(runtime, tmp_path):
    elsewhere = tmp_path / "elsewhere"
    path = put(elsewhere, here())
    runtime.symlink_to(elsewhere)
    assert running_trials() == []
    with pytest.raises(RunFileError, match=str(runtime)), announced(Path("/"), 1, True):
        pass
    assert list(elsewhere.iterdir()) == [path]
    runtime.unlink()
    runtime.mkdir(mode=0o700)
    (runtime / path.name).symlink_to(path)
    assert running_trials() == []
    # A link where the file is to be written must not have its target overwritten
    (runtime / path.name).unlink()
    target = tmp_path / "precious"
    target.write_text("data")
    (runtime / f".{path.name}").symlink_to(target)
    with pytest.raises(RunFileError), announced(Path("/trials/a"), 1, True):
        pass
    assert target.read_text() == "data"


def test_a_pipe_in_the_folder_holds_nobody_up(runtime):
    runtime.mkdir(mode=0o700)
    os.mkfifo(runtime / here().file_name)
    assert running_trials() == []


def test_a_folder_that_cannot_be_made_is_named(runtime, monkeypatch):
    runtime.write_text("a file in its place")
    with (
        pytest.raises(RunFileError, match=f"{runtime}: Not a directory"),
        announced(Path("/"), 1, True),
    ):
        pass


def test_it_is_found_from_a_terminal_with_another_environment(tmp_path, monkeypatch):
    """And where systemd has removed the runtime folder at the last logout."""
    shared = tmp_path / "shared"
    places = run_file._places
    monkeypatch.setattr(run_file, "_places", lambda: [shared, *places()])
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    with announced(Path("/trials/a"), 3, True) as trial:
        written = [place / trial.file_name for place in run_file._places()]
        assert len(written) == 3
        assert all(path.is_file() for path in written)
        assert running_trials() == [trial]  # once
        shutil.rmtree(tmp_path / "towtank")
        for name in ("TMPDIR", "XDG_RUNTIME_DIR"):
            monkeypatch.setenv(name, "/nowhere")
        assert running_trials() == [trial]
    assert not any(path.exists() for path in written)


def test_what_every_terminal_has_is_among_the_places(monkeypatch):
    """Whatever the environment names besides."""
    monkeypatch.undo()
    monkeypatch.setenv("TMPDIR", "/elsewhere")
    assert Path(f"/tmp/towtank-{os.geteuid()}") in run_file._places()


def test_the_next_place_is_taken_and_all_are_looked_at(runtime, monkeypatch, tmp_path):
    runtime.write_text("a file in its place")
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    with announced(Path("/trials/a"), 3, True):
        assert (tmp_path / f"towtank-{os.geteuid()}").is_dir()
        assert [trial.domain for trial in running_trials()] == [3]


def test_a_relative_runtime_folder_is_none(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_RUNTIME_DIR", ".")
    assert all(place.is_absolute() for place in run_file._places())


@settings(max_examples=30)
@given(
    st.one_of(
        st.binary(max_size=200),
        st.recursive(
            st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
            lambda inner: (
                st.lists(inner, max_size=3)
                | st.dictionaries(
                    st.sampled_from(["directory", "domain", "pid", "uid"]), inner, max_size=4
                )
            ),
            max_leaves=10,
        ).map(lambda value: json.dumps(value).encode()),
    )
)
def test_nonsense_is_no_trial(contents):
    with pytest.raises(ValueError):
        RunningTrial.from_text(contents)


def test_what_is_written_is_read():
    trial = here("/trials/ü", 232)
    assert RunningTrial.from_text(trial.text()) == trial
    for wrong in ({"domain": 233}, {"domain": True}, {"directory": "trials"}, {"pid": "1"}):
        text = json.dumps({**json.loads(trial.text()), **wrong})
        with pytest.raises(ValueError):
            RunningTrial.from_text(text)


def test_which_is_meant(tmp_path):
    first, second = here(str(tmp_path / "a"), 1), here(str(tmp_path / "b"), 2)
    assert choose_trial([first]) is first
    assert choose_trial([first, second], domain=2) is second
    (tmp_path / "a").mkdir()
    (tmp_path / "link").symlink_to("a")
    assert choose_trial([first, second], tmp_path / "link") is first
    (tmp_path / "loop").symlink_to("loop")
    assert choose_trial([here(str(tmp_path / "loop"), 3), second], tmp_path / "b") is second
    with pytest.raises(RunFileError, match=r"no trial runs in .*/loop"):
        choose_trial([second], tmp_path / "loop")
    with pytest.raises(RunFileError, match="start one with `towtank trial`"):
        choose_trial([])
    with pytest.raises(RunFileError, match=r"2 trials run: .*--trial DIR: .*/a .*; .*/b "):
        choose_trial([first, second])
    with pytest.raises(RunFileError, match=r"no trial runs in .*/c; these do: .*/a"):
        choose_trial([first], tmp_path / "c")
