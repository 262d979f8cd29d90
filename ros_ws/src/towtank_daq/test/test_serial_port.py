# SPDX-License-Identifier: Apache-2.0
"""The serial port on a pseudo terminal: who may open it, who has it open, and its settings."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
import termios
from collections.abc import Iterator
from pathlib import Path

import pytest
from towtank_daq.port_users import port_users
from towtank_daq.serial_port import SerialPort, SerialPortError

BAUD = 250_000


class Terminal:
    """A pseudo terminal: the far end, and the path of what stands for the port."""

    def __init__(self) -> None:
        self.far, self._kept = pty.openpty()  # kept: else its settings go with the last to close it
        self.path = Path(os.ttyname(self._kept))
        self.path.chmod(0o666)

    def close(self) -> None:
        os.close(self.far)
        os.close(self._kept)

    @property
    def hangs_up(self) -> bool:
        """Whether DTR goes down with the last who closes the port."""
        return bool(termios.tcgetattr(self._kept)[2] & termios.HUPCL)


@pytest.fixture
def terminal() -> Iterator[Terminal]:
    made = Terminal()
    yield made
    made.close()


@pytest.fixture
def port(terminal) -> Iterator[SerialPort]:
    opened = SerialPort(str(terminal.path), BAUD)
    yield opened
    opened.close()


def open_as_another_user(path: Path) -> str:
    """What is said to a program that opens the port for itself. Root is let in by the kernel."""
    done = subprocess.run(
        ["/bin/sh", "-c", f"exec 3<>{path}"],
        user="nobody" if os.geteuid() == 0 else None,
        capture_output=True,
        text=True,
        env={"LC_ALL": "C"},
        check=False,
    )
    return done.stderr


def test_nobody_else_opens_the_port(terminal, port):
    assert port.is_exclusive
    assert "resource busy" in open_as_another_user(terminal.path)
    port.reopen(1.0, reset=False)
    assert "resource busy" in open_as_another_user(terminal.path)
    port.close()
    assert open_as_another_user(terminal.path) == ""


def test_a_closed_port_takes_nothing_from_the_file_that_has_its_number_now(port):
    """As after a reopening in vain; the number is free for the next file of the process."""
    number = port._file
    port.close()
    ours, far = os.pipe()
    os.write(far, b"another's")
    os.dup2(ours, number)
    try:
        with pytest.raises(SerialPortError, match="is gone"):
            port.read(0.0)
        with pytest.raises(SerialPortError, match="is gone"):
            port.look_after()
        assert os.read(number, 100) == b"another's"
    finally:
        for file in {ours, far, number}:
            os.close(file)


def test_a_second_driver_is_refused_with_the_name_of_the_first(terminal):
    """Also as root: by the other lock. The first is a process of its own."""
    code = (
        "import sys; from towtank_daq.serial_port import SerialPort;"
        f"p = SerialPort('{terminal.path}', {BAUD}); print('open', flush=True); sys.stdin.read()"
    )
    first = subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    try:
        assert first.stdout.readline() == "open\n"
        with pytest.raises(SerialPortError, match=rf"is in use by .* \(pid {first.pid}\): stop"):
            SerialPort(str(terminal.path), BAUD)
    finally:
        first.communicate("")


def test_who_has_the_port_open_is_found(terminal):
    """Not who serves its other end, as a virtual board does, nor this process."""
    with terminal.path.open() as before:  # later, none but root could open it
        port = SerialPort(str(terminal.path), BAUD)
        assert port_users(terminal.path) == []
        other = subprocess.Popen(["sleep", "60"], stdin=before)
    server = subprocess.Popen(["sleep", "60"], stdin=terminal.far, stdout=terminal._kept)
    try:
        assert port_users(terminal.path) == [f"sleep (pid {other.pid})"]
        assert port.suspects() == f"sleep (pid {other.pid})"
    finally:
        for process in (other, server):
            process.kill()
            process.wait()
    assert port_users(terminal.path) == []
    port.close()


def test_a_program_that_had_it_open_before_is_told_once(terminal):
    other = subprocess.Popen(["sleep", "60"], stdin=terminal.path.open())
    try:
        port = SerialPort(str(terminal.path), BAUD)
        assert port.look_after() == (
            f"sleep (pid {other.pid}) has port {terminal.path} open as well, and may take bytes: "
            "stop it"
        )
        assert port.look_after() == ""
        port.close()
    finally:
        other.kill()
        other.wait()


@pytest.mark.parametrize(
    ("stty", "words"),
    [
        (["9600"], "(9600 baud)"),
        (["115200", "cooked"], "(115200 baud)"),
        (["istrip"], "(its line discipline)"),
        (["hupcl"], "(its line discipline)"),
    ],
    ids=" ".join,
)
def test_changed_settings_are_made_anew(terminal, port, stty, words):
    assert port.look_after() == ""
    subprocess.run(["stty", *stty], stdin=terminal._kept, check=True)
    told = port.look_after()
    assert words in told and "\n" not in told
    assert told.endswith("mask ModemManager, and close whatever monitors the port")
    assert port.look_after() == ""
    raw = bytes(range(256))
    os.write(terminal.far, raw)
    assert port.read(1.0) == raw


def test_dtr_is_left_up_unless_a_reset_is_wanted(terminal, port):
    """A pseudo terminal has no DTR; what the kernel will do with it at the close is seen."""
    assert not terminal.hangs_up
    port._lower_dtr()
    assert terminal.hangs_up
    port.reopen(1.0, reset=True)
    assert not terminal.hangs_up
    port.close()
    assert not terminal.hangs_up


def test_a_port_that_has_gone_says_so(terminal, port):
    os.close(terminal.far)
    terminal.far = os.open("/dev/null", os.O_RDONLY)
    with pytest.raises(SerialPortError, match="is gone: plug the board in"):
        while True:
            port.read(1.0)
