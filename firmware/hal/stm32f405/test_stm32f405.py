# SPDX-License-Identifier: Apache-2.0
"""The second port in QEMU's STM32F405: the same core answers over its USART.

QEMU has no ADC, no clock tree, no flash to write and no watchdog there, and its timers have another
clock; what is shown is that start-up, vectors, timer, USART and core work together on another
processor.
"""

from __future__ import annotations

import select
import socket
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from towtank_daq.board import AdcBoard, BoardError
from towtank_daq.description import load_description
from towtank_daq.protocol import Protocol

ROOT = Path(__file__).resolve().parents[3]
ELF = ROOT / "build" / "firmware" / "towtank_stm32f405.elf"
PROTOCOL = Protocol(load_description(ROOT / "firmware" / "protocol" / "board.yaml"))


class Line:
    """The USART as a transport."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection

    def read(self, timeout_s: float) -> bytes:
        ready, _, _ = select.select([self._connection], [], [], timeout_s)
        return self._connection.recv(4096) if ready else b""

    def write(self, data: bytes) -> None:
        self._connection.sendall(data)

    def reopen(self, timeout_s: float) -> None:
        raise OSError("QEMU has ended")


@pytest.fixture
def driver(tmp_path) -> Iterator[AdcBoard]:
    assert ELF.exists(), "the second port is not built: make -C firmware stm32f405"
    path = tmp_path / "usart1"
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(path))
        listener.listen(1)
        qemu = subprocess.Popen(
            [
                *("qemu-system-arm", "-machine", "netduinoplus2", "-kernel", str(ELF)),
                *("-display", "none", "-monitor", "none"),
                *("-chardev", f"socket,id=usart1,path={path}", "-serial", "chardev:usart1"),
            ]
        )
        try:
            listener.settimeout(20.0)
            connection, _ = listener.accept()
            with connection:
                yield AdcBoard(Line(connection), PROTOCOL, lambda scan: None, print)
        finally:
            qemu.kill()
            qemu.wait()


def test_the_port_answers_as_the_board_does(driver):
    identity = driver.connect(timeout_s=20.0)
    assert identity.protocol == PROTOCOL.board.protocol
    assert identity.schema_hash == PROTOCOL.board.schema_hash
    assert identity.clock_hz == PROTOCOL.board.microcontroller.tick_hz
    assert identity.adc_id == 0  # there is none
    health = driver.counters()
    assert health.state == PROTOCOL.board.board_state["idle"]
    assert health.boot_count == 1
    assert health.stack_low_water > 6000
    first = driver.board_time()
    time.sleep(0.2)
    assert driver.board_time().board_received > first.board_received
    # Drive and ramp run on the board's time, which is another in QEMU
    driver.drive("run", 30.0, 4096)
    end_s = time.monotonic() + 20.0
    while driver.drive_state is None or driver.drive_state.state != "tripped":
        assert time.monotonic() < end_s, driver.drive_state
        driver.poll(0.05)
    assert driver.drive_state.trip == "host_silence"
    with pytest.raises(BoardError, match=r"stopped \(host silence\)"):
        driver.drive("run", 30.0, 4096)
