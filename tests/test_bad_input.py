# SPDX-License-Identifier: Apache-2.0
"""Bad input ends a command with one clear line, a non-zero status and nothing unmarked."""

from __future__ import annotations

import os
import pty
import subprocess
import threading
import tty

import pytest
from towtank_bringup.rigs import rig_path
from towtank_command import processes_of, run_towtank


def assert_one_clear_line(run, *words):
    assert run.returncode != 0
    *_, last = run.stderr.strip().splitlines()
    assert last.startswith("towtank: error: ")
    assert "Traceback" not in run.stderr
    for word in words:
        assert word in last, last


@pytest.fixture
def broken_rig(tmp_path):
    text = rig_path("nit_calicut_2012").read_text()

    def write(old, new):
        assert text.count(old) >= 1
        path = tmp_path / "broken.yaml"
        path.write_text(text.replace(old, new, 1))
        return path

    return write


BAD_RIGS = pytest.mark.parametrize(
    ("old", "new", "where"),
    [
        ("  carriage_speed:", "  carriage_sped:", "run.carriage_speed"),
        ("{value: 1.30 m", "{value: 1300 mm", "fish.length"),
        ("{value: 1.30 m", "{value: -1.30 m", "fish.length"),
    ],
    ids=["missing key", "wrong unit", "impossible value"],
)


@BAD_RIGS
def test_trial_refuses_a_bad_rig_before_it_begins(broken_rig, tmp_path, old, new, where):
    path = broken_rig(old, new)
    run = run_towtank("trial", "--rig", path, "--out", tmp_path / "o")
    assert_one_clear_line(run, f"{path}:", where)
    assert not (tmp_path / "o").exists()


@BAD_RIGS
def test_rig_check_names_every_fault_in_a_line(broken_rig, old, new, where):
    path = broken_rig(old, new)
    run = run_towtank("rig", "check", path)
    assert run.returncode == 1
    lines = run.stderr.strip().splitlines()
    assert all(line.startswith(f"towtank: error: {path}:") for line in lines)
    assert any(f" {where}: " in line for line in lines)


def test_port_that_does_not_exist(tmp_path):
    run = run_towtank("trial", "--port", tmp_path / "ttyACM7", "--out", tmp_path / "o")
    assert_one_clear_line(run, "ttyACM7", "does not exist")
    assert not (tmp_path / "o").exists()


def test_existing_output_directory_is_left_alone(tmp_path):
    out = tmp_path / "o"
    out.mkdir()
    (out / "precious").write_text("data")
    run = run_towtank("trial", "--out", out)
    assert_one_clear_line(run, str(out), "exists", "--out")
    assert [path.name for path in out.iterdir()] == ["precious"]


@pytest.fixture
def silent_port():
    """A serial port whose board never answers."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    drain = threading.Thread(target=_drain, args=(master,), daemon=True)
    drain.start()
    yield os.ttyname(slave)
    os.close(slave)
    os.close(master)


def _drain(master):
    try:
        while os.read(master, 4096):
            pass
    except OSError:
        return


@pytest.mark.trial
def test_board_that_never_answers(silent_port, tmp_path):
    run = run_towtank("trial", "--port", silent_port, "--out", tmp_path / "o")
    assert_one_clear_line(run, "/measured/adc_board", "answer")
    assert (tmp_path / "o" / "INCOMPLETE").exists()
    assert processes_of(tmp_path / "o") == []


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 2 MiB."""
    if os.geteuid() != 0:
        pytest.skip("only root can mount a small file system")
    place = tmp_path / "disk"
    place.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=2M", "tmpfs", place], check=True)
    yield place
    subprocess.run(["umount", place], check=True)


@pytest.mark.trial
def test_full_disk(small_disk):
    out = small_disk / "trial"
    run = run_towtank("trial", "--out", out)
    assert_one_clear_line(run, "No space left on device")
    assert (out / "INCOMPLETE").exists()
    assert not (out / "result.json").exists()
    assert processes_of(out) == []
