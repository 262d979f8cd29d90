# SPDX-License-Identifier: GPL-3.0-or-later
"""towtank-vboard in real time: pseudo terminal, socket, signals, and refusals in one line."""

from __future__ import annotations

import fcntl
import json
import math
import os
import signal
import socket
import subprocess
import termios
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from pathlib import Path

import pytest
import serial
from board_link import ALL_CHANNELS, BOOT, IDENTIFY, RESPONSE, START, STOP, Frames, request
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
    running = start(
        *("--crank-cpr", "2400", "--carriage-cpr", "1200", "--noise", "0"),
        *("--bootloader", "none", "--no-dtr-reset"),
    )
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
    running = start("--bootloader", "none")
    running.process.send_signal(signal.SIGUSR2)
    time.sleep(0.1)
    running.process.send_signal(signal.SIGUSR1)
    assert running.process.stderr is not None
    assert json.loads(running.process.stderr.readline())["resets"] == 1
    status, statistics = running.end()
    assert status == 0
    assert statistics["bytes_to_host"] > 10  # two boot frames


def open_port(running: Running) -> serial.Serial:
    return serial.Serial(str(running.link), 250_000, timeout=0.05)


def frames_until(port: serial.Serial, wanted: int) -> Frames:
    """All until a frame of a type is there; the test's time limit ends what never comes."""
    frames = Frames()
    while not frames.of_type(wanted):
        frames.take(port.read(port.in_waiting or 1))
    return frames


def resets(running: Running) -> int:
    """So far; the program looks who has opened and closed the port before it answers."""
    running.process.send_signal(signal.SIGUSR1)
    assert running.process.stderr is not None
    return int(json.loads(running.process.stderr.readline())["resets"])


@pytest.mark.timeout(60)
def test_the_first_to_open_the_port_resets_the_board_and_no_other(start):
    """DTR goes up with the first and down with the last."""
    running = start("--bootloader", "none")
    with closing(open_port(running)):
        assert resets(running) == 1
        with closing(open_port(running)):
            assert resets(running) == 1
        assert resets(running) == 1
    assert resets(running) == 1
    with closing(open_port(running)):
        assert resets(running) == 2


@pytest.mark.timeout(60)
def test_dtr_stays_up_where_the_host_says_so(start):
    """Without HUPCL a port that is opened again is that of a board that runs on."""
    running = start("--bootloader", "none")
    with closing(open_port(running)) as port:
        settings = termios.tcgetattr(port.fileno())
        settings[2] &= ~termios.HUPCL
        termios.tcsetattr(port.fileno(), termios.TCSANOW, settings)
    assert resets(running) == 1
    with closing(open_port(running)):
        assert resets(running) == 1


@pytest.mark.timeout(60)
def test_a_board_whose_dtr_does_nothing(start):
    running = start("--bootloader", "none", "--no-dtr-reset")
    with closing(open_port(running)):
        assert resets(running) == 0


@pytest.mark.real_time
@pytest.mark.timeout(60)
def test_the_program_has_the_bootloader_of_a_shipped_board(start):
    running = start()
    with closing(open_port(running)) as port:
        frames = frames_until(port, BOOT)
    assert frames.of_type(BOOT)[0][1] == 0  # the cause is lost in it
    assert resets(running) == 1


@pytest.mark.timeout(60)
def test_at_a_wrong_speed_nobody_is_understood(start):
    running = start("--bootloader", "none", "--no-dtr-reset")
    with closing(open_port(running)) as port:
        port.baudrate = 115_200
        heard = Frames()
        while heard.bad < 2:
            port.write(request(IDENTIFY, 1))
            heard.take(port.read(port.in_waiting or 1))
        assert heard.payloads == []
        port.baudrate = 250_000
        port.write(b"\0" + request(IDENTIFY, 2))
        assert frames_until(port, IDENTIFY | RESPONSE).of_type(IDENTIFY | RESPONSE)[0][1] == 2


@pytest.mark.timeout(60)
def test_exclusive_use_ends_with_the_last_close_as_of_a_real_port(start):
    """Also that of a host that was killed. Who is root opens it in any case: the mark is asked."""
    running = start()
    with closing(open_port(running)) as port:
        fcntl.ioctl(port.fileno(), termios.TIOCEXCL)
        assert is_exclusive(port)
    resets(running)  # it has seen the close
    with closing(open_port(running)) as port:
        assert not is_exclusive(port)


def is_exclusive(port: serial.Serial) -> bool:
    gexcl = 0x80045440  # TIOCGEXCL of <asm-generic/ioctls.h>
    return fcntl.ioctl(port.fileno(), gexcl, bytes(4)) != bytes(4)


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
        (("--bootloader", "new"), "--bootloader new: give shipped, old or none"),
        (("stray",), "stray: an argument without an option"),
    ],
)
def test_wrong_arguments_are_refused(refusal, arguments, complaint):
    assert complaint in refusal(*arguments)
