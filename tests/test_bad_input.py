# SPDX-License-Identifier: Apache-2.0
"""Bad input ends a command with one clear line, a non-zero status and nothing unmarked."""

from __future__ import annotations

import contextlib
import os
import pty
import select
import subprocess
import threading
import tty

import pytest
from towtank_bringup.rigs import rig_path
from towtank_command import processes_of, run_towtank
from towtank_daq.framing import FrameReader, encode_frame
from towtank_node import names


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


@contextlib.contextmanager
def serial_port(answer, heard=True):
    """A serial port with somebody on it who answers each request by `answer(payload)`, or not.

    heard: it also says something by itself.
    """
    master, slave = pty.openpty()
    tty.setraw(slave)
    done = threading.Event()

    def serve():
        reader = FrameReader(64)
        while not done.is_set():
            if heard:
                os.write(master, encode_frame(b"\x11"))
            if select.select([master], [], [], 0.1)[0]:
                for request in reader.feed(os.read(master, 4096)):
                    if (response := answer(request)) is not None:
                        os.write(master, encode_frame(response))

    server = threading.Thread(target=serve)
    server.start()
    try:
        yield os.ttyname(slave)
    finally:
        done.set()
        server.join()
        os.close(slave)
        os.close(master)


@pytest.mark.real_time
def test_board_that_never_answers(tmp_path):
    with serial_port(lambda request: None, heard=False) as port:
        run = run_towtank("trial", "--port", port, "--out", tmp_path / "o")
    assert_one_clear_line(run, names.BOARD_NODE, "answer")
    assert (tmp_path / "o" / "INCOMPLETE").exists()
    assert processes_of(tmp_path / "o") == []


@pytest.mark.real_time
def test_board_of_another_version(tmp_path):
    """It answers `identify` (protocol, schema hash, then 16 more bytes) with a foreign hash."""

    def identify(request):
        return bytes((request[0] | 0x80, request[1], 0, 1)) + b"\xde\xad\xbe\xef" + bytes(16)

    with serial_port(identify) as port:
        run = run_towtank("trial", "--port", port, "--out", tmp_path / "o")
    assert_one_clear_line(run, names.BOARD_NODE, "schema 0xefbeadde", "flash the firmware")
    assert (tmp_path / "o" / "INCOMPLETE").exists()


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


@pytest.mark.real_time
def test_full_disk(small_disk):
    out = small_disk / "trial"
    run = run_towtank("trial", "--out", out)
    assert_one_clear_line(run, "No space left on device")
    assert (out / "INCOMPLETE").exists()
    assert not (out / "result.json").exists()
    assert processes_of(out) == []
