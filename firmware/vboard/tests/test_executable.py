# SPDX-License-Identifier: GPL-3.0-or-later
"""towtank-vboard in real time: pseudo terminal, socket, signals, and refusals in one line."""

from __future__ import annotations

import json
import math
import os
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
import serial
from board_link import ALL_CHANNELS, IDENTIFY, RESPONSE, START, STOP, Frames, request
from vboard import BenchFrame

MILLISECOND = 1_000_000
SECOND = 1_000_000_000
VOLTS = (0.012, -0.003, 1.40, 1.75, 2.20, 10.2)


class Running:
    def __init__(self, program: Path, elf: Path, directory: Path, *options: str) -> None:
        self.link = directory / "tty"
        self.socket_path = directory / "bench"
        self.process = subprocess.Popen(
            [
                *(program, "--elf", elf, "--pty-link", self.link),
                *("--bench-socket", self.socket_path, *options),
            ],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout is not None
        self.ready = self.process.stdout.readline()

    def bench(self) -> socket.socket:
        client = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        client.connect(str(self.socket_path))
        return client

    def end(self, with_signal: int = signal.SIGTERM) -> tuple[int, dict[str, float]]:
        """Exit status and the statistics printed last."""
        self.process.send_signal(with_signal)
        _, errors = self.process.communicate(timeout=20)
        return self.process.returncode, json.loads(errors.splitlines()[-1])


@pytest.fixture
def start(program: Path, board_elf: Path, tmp_path: Path) -> Iterator[Callable[..., Running]]:
    with ExitStack() as stack:

        def start_one(*options: str) -> Running:
            running = Running(program, board_elf, tmp_path, *options)
            stack.callback(running.process.wait)
            stack.callback(running.process.kill)
            return running

        yield start_one


def feed(
    client: socket.socket, port: serial.Serial, frames: Frames, seconds: float, rate: float
) -> list[float]:
    """A bench with a lead of 50 ms and a host that listens: the crank angles sent."""
    angles = []
    begin = time.monotonic_ns()
    for i in range(round(seconds * 100)):
        instant = begin + i * 10 * MILLISECOND
        while time.monotonic_ns() < instant:
            frames.take(port.read(port.in_waiting or 1))
        angles.append(rate * i * 0.01)
        frame = BenchFrame(instant + 50 * MILLISECOND, VOLTS, angles[-1], -angles[-1], i)
        client.send(frame.pack())
    return angles


@pytest.mark.real_time
def test_a_trial_in_real_time(start):
    running = start("--crank-cpr", "2400", "--carriage-cpr", "1200", "--noise", "0")
    assert running.ready == f"ready pty={os.readlink(running.link)}\n"
    frames = Frames()
    with (
        serial.Serial(str(running.link), 250_000, timeout=0.005) as port,
        running.bench() as client,
    ):
        feed(client, port, frames, 0.3, 0.0)
        port.write(request(IDENTIFY, 1))
        port.write(request(START, 2))
        rate = 5000 * 2 * math.pi / 2400
        angles = feed(client, port, frames, 2.0, rate)
        # Once more with a long lead: the end is reached even if this machine has stalled.
        end = BenchFrame(time.monotonic_ns() + 200 * MILLISECOND, VOLTS, angles[-1], -angles[-1])
        client.send(end.pack())
        deadline = time.monotonic() + 20
        time.sleep(0.3)
        port.write(request(STOP, 3))
        while not frames.of_type(STOP | RESPONSE) and time.monotonic() < deadline:
            frames.take(port.read(port.in_waiting or 1))
    status, statistics = running.end()
    assert status == 0
    assert not running.link.exists() and not running.socket_path.exists()

    (identity,) = frames.of_type(IDENTIFY | RESPONSE)
    assert identity[11] == 0x14
    scans = frames.scans()
    (stopped,) = frames.of_type(STOP | RESPONSE)
    assert [s.sequence for s in scans] == list(range(int.from_bytes(stopped[3:7], "little")))
    assert frames.bad == 0
    crank = math.floor(angles[-1] * 2400 / (2 * math.pi))
    carriage = math.floor(-angles[-1] * 1200 / (2 * math.pi))
    assert (scans[-1].crank, scans[-1].carriage) == (crank, carriage)
    assert all(s.valid_mask == ALL_CHANNELS for s in scans)
    assert (statistics["crank_counts"], statistics["carriage_counts"]) == (crank, carriage)
    assert statistics["bench_frames"] + statistics["bench_frames_late"] == 231
    assert statistics["bench_frames_malformed"] == 0
    assert statistics["spi_misuse"] == 0


def test_a_bench_may_come_again_and_bad_frames_are_counted(start):
    running = start()
    for _ in range(3):
        with running.bench() as client:
            client.send(b"nonsense")
            client.send(BenchFrame(time.monotonic_ns() + SECOND, VOLTS, 0.0, 0.0).pack() + b"+")
            instant = time.monotonic_ns() + SECOND
            client.send(BenchFrame(instant, VOLTS, math.nan, 0.0).pack())
            client.send(BenchFrame(instant, VOLTS, 0.0, 0.0).pack())
        time.sleep(0.05)
    _, statistics = running.end(signal.SIGINT)
    assert statistics["bench_frames_malformed"] == 9
    assert statistics["bench_frames"] == 3


def test_statistics_on_request_and_reset_by_signal(start):
    running = start()
    running.process.send_signal(signal.SIGUSR2)
    time.sleep(0.1)
    running.process.send_signal(signal.SIGUSR1)
    assert running.process.stderr is not None
    assert json.loads(running.process.stderr.readline())["resets"] == 1
    status, statistics = running.end()
    assert status == 0
    assert statistics["bytes_to_host"] > 10  # two boot frames


def test_what_a_killed_board_left_is_replaced(start):
    first = start()
    first.process.kill()
    first.process.wait()
    assert first.link.is_symlink() and first.socket_path.exists()
    second = start()
    assert second.ready.startswith("ready pty=/dev/pts/")
    assert second.end()[0] == 0


@pytest.fixture
def refusal(program: Path) -> Callable[..., str]:
    """Runs the program with arguments that it must refuse: its one line."""

    def run(*arguments: str | Path) -> str:
        done = subprocess.run(
            [program, *arguments], capture_output=True, text=True, timeout=20, check=False
        )
        assert done.returncode != 0
        assert done.stdout == ""
        assert done.stderr.count("\n") == 1
        return done.stderr

    return run


def test_an_unusable_elf_is_refused(refusal, tmp_path):
    line = refusal("--elf", tmp_path / "none.elf", "--bench-socket", tmp_path / "bench")
    assert "none.elf: No such file or directory" in line
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_no_eeprom_is_refused(refusal, tmp_path, board_elf):
    other = tmp_path / "precious"
    other.write_text("precious")
    line = refusal("--elf", board_elf, "--bench-socket", tmp_path / "bench", "--eeprom", other)
    assert "is no EEPROM of an ATmega2560 (4096 bytes); name another file" in line
    assert other.read_text() == "precious"


def test_a_file_in_place_of_the_link_is_refused(refusal, tmp_path, board_elf):
    link = tmp_path / "tty"
    link.write_text("precious")
    line = refusal("--elf", board_elf, "--bench-socket", tmp_path / "bench", "--pty-link", link)
    assert "is not a link to a pseudo terminal" in line
    assert link.read_text() == "precious"
    assert not (tmp_path / "bench").exists()


def test_a_link_to_something_else_is_refused(refusal, tmp_path, board_elf):
    link = tmp_path / "tty"
    link.symlink_to("/dev/null")
    refusal("--elf", board_elf, "--bench-socket", tmp_path / "bench", "--pty-link", link)
    assert os.readlink(link) == "/dev/null"


def test_a_link_in_a_directory_that_is_not_there_is_refused(refusal, tmp_path, board_elf):
    link = tmp_path / "nowhere/tty"
    line = refusal("--elf", board_elf, "--bench-socket", tmp_path / "bench", "--pty-link", link)
    assert "No such file or directory" in line


def test_an_unusable_socket_path_is_refused(refusal, tmp_path, board_elf):
    taken = tmp_path / "bench"
    taken.write_text("precious")
    assert "is not a socket" in refusal("--elf", board_elf, "--bench-socket", taken)
    assert taken.read_text() == "precious"
    too_long = tmp_path / ("b" * 120)
    assert "longer than" in refusal("--elf", board_elf, "--bench-socket", too_long)


def test_a_socket_in_use_is_refused(start, refusal, board_elf):
    running = start()
    line = refusal("--elf", board_elf, "--bench-socket", running.socket_path)
    assert "is in use" in line
    assert running.end()[0] == 0


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ((), "--elf is missing"),
        (("--elf", "x"), "--bench-socket is missing"),
        (("--crank-cpr", "-3"), "--crank-cpr -3: give a whole number"),
        (("--clock-ppm", "fast"), "--clock-ppm fast: give a number"),
        (("--noise", "0.1,0.2,0.3"), "give one value or 6"),
        (("stray",), "stray: an argument without an option"),
    ],
)
def test_wrong_arguments_are_refused(refusal, arguments, complaint):
    assert complaint in refusal(*arguments)
