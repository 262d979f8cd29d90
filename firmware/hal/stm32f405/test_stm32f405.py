# SPDX-License-Identifier: Apache-2.0
"""The second port in QEMU's STM32F405: the same core answers over its USART.

QEMU has no ADC, no clock tree, no flash to write and no watchdog there, and its timers have another
clock; what is shown is that start-up, vectors, timer, USART and core work together on another
processor.
"""

from __future__ import annotations

import re
import select
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from towtank_daq.board import AdcBoard, BoardError, Transport
from towtank_daq.description import load_description
from towtank_daq.protocol import Protocol
from towtank_daq.protocol_records import DriveAction, DriveArguments, drive

ROOT = Path(__file__).resolve().parents[3]
ELF = ROOT / "build" / "firmware" / "towtank_stm32f405.elf"
PROTOCOL = Protocol(load_description(ROOT / "firmware" / "protocol" / "board.yaml"))


class Line(Transport):
    """The USART as a transport."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection

    def read(self, timeout_s: float) -> bytes:
        ready, _, _ = select.select([self._connection], [], [], timeout_s)
        return self._connection.recv(4096) if ready else b""

    def write(self, data: bytes) -> None:
        self._connection.sendall(data)

    def reopen(self, timeout_s: float, reset: bool) -> None:
        """The emulated USART has no DTR; a busy computer may be slow to start the firmware."""


class Debugger:
    """Stops the processor and meddles with it, in the protocol of GDB.

    QEMU lets the processor stand as soon as it is connected to, until `go`.
    """

    def __init__(self, path: Path) -> None:
        self._connection = socket.socket(socket.AF_UNIX)
        self._connection.settimeout(20.0)
        self._connection.connect(str(path))
        self._ask("qXfer:features:read:target.xml:0,fff")  # registers have no numbers before that

    def close(self) -> None:
        self._connection.close()

    def set_register(self, number: int, value: int) -> None:
        assert self._ask(f"P{number:x}={value.to_bytes(4, 'little').hex()}") == "OK"

    def write(self, address: int, value: int) -> None:
        assert self._ask(f"M{address:x},4:{value.to_bytes(4, 'little').hex()}") == "OK"

    def register(self, number: int) -> int:
        return int.from_bytes(bytes.fromhex(self._ask(f"p{number:x}")), "little")

    def run_to(self, address: int) -> None:
        """Let it run until it comes there."""
        address &= ~1  # which only says that it is Thumb code
        assert self._ask(f"Z0,{address:x},2") == "OK"
        self.go()
        while b"$T" not in self._connection.recv(4096):
            pass
        assert self._ask(f"z0,{address:x},2") == "OK"

    def go(self) -> None:
        self._send("c")

    def _send(self, packet: str) -> None:
        checksum = sum(packet.encode()) % 256
        self._connection.sendall(f"${packet}#{checksum:02x}".encode())

    def _ask(self, packet: str) -> str:
        self._send(packet)
        received = b""
        while not (answers := re.findall(rb"\$((?!T)[^#]*)#..", received)):  # T: it has stopped
            more = self._connection.recv(4096)
            assert more, "QEMU has ended"
            received += more
        return answers[0].decode()


@pytest.fixture
def line(tmp_path) -> Iterator[Line]:
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
                *("-chardev", f"socket,id=gdb,path={tmp_path / 'gdb'},server=on,wait=off"),
                *("-gdb", "chardev:gdb", "-d", "unimp", "-D", str(tmp_path / "log")),
            ]
        )
        try:
            listener.settimeout(20.0)
            connection, _ = listener.accept()
            with connection:
                yield Line(connection)
        finally:
            qemu.kill()
            qemu.wait()


@pytest.fixture
def driver(line) -> AdcBoard:
    return AdcBoard(line, PROTOCOL, lambda scan: None, print)


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


# QEMU has no ports there: what is written to them is in its log.
PORT_WRITE = re.compile(
    r"(GPIO[BC]): unimplemented device write \(size 4, offset 0x(\w+), value 0x(\w+)\)"
)
SET_OR_CLEAR = 0x18  # BSRR
ENABLE, PWM = ("GPIOB", 5), ("GPIOC", 6)
SP, LR, PC = 13, 14, 15
NVIC_ISER0, NVIC_ISPR0 = 0xE000E100, 0xE000E200


def levels(log: Path) -> dict[tuple[str, int], bool]:
    """The pins as the last writes to their ports have left them."""
    pins = {}
    for port, offset, value in PORT_WRITE.findall(log.read_text()):
        for pin in range(16) if int(offset, 16) == SET_OR_CLEAR else ():
            if int(value, 16) >> (pin + 16) & 1:
                pins[port, pin] = False
            elif int(value, 16) >> pin & 1:
                pins[port, pin] = True
    return pins


def address_of(function: str) -> int:
    names = subprocess.run(
        ["arm-none-eabi-nm", str(ELF)], capture_output=True, text=True, check=True
    ).stdout
    return int(re.search(rf"^(\w+) T {function}$", names, re.MULTILINE)[1], 16)


def lose_the_program(debugger: Debugger) -> None:
    debugger.set_register(PC, 0x60000000)  # there is nothing


def overflow_the_stack(debugger: Debugger) -> None:
    debugger.set_register(SP, 0x1FFFFFF0)  # nor here, where the handler's frame would go


def stray_interrupt(debugger: Debugger) -> None:
    """The window watchdog's, as if a program run wild had enabled it: str, str, and a loop."""
    program = 0x20010000  # of RAM, unused
    debugger.write(program, 0x6011_6001)
    debugger.write(program + 4, 0xE7FE_E7FE)
    for register, value in enumerate((NVIC_ISER0, 1, NVIC_ISPR0)):
        debugger.set_register(register, value)
    debugger.set_register(PC, program)


@pytest.mark.parametrize("fault", [lose_the_program, overflow_the_stack, stray_interrupt])
def test_a_fault_takes_the_motors_power(
    driver: AdcBoard, line: Line, tmp_path: Path, fault: Callable[[Debugger], None]
) -> None:
    """No interrupt comes through a fault, the one that looks at the emergency stop neither."""
    driver.connect(timeout_s=20.0)
    log = tmp_path / "log"
    debugger = Debugger(tmp_path / "gdb")
    run = DriveArguments(DriveAction.RUN, speed=3000, counts_per_revolution=4096)
    line.write(PROTOCOL.request(drive(run), 7))
    debugger.run_to(address_of("hal_drive_on"))
    debugger.run_to(debugger.register(LR))
    assert levels(log)[ENABLE]
    written = len(PORT_WRITE.findall(log.read_text()))
    fault(debugger)
    debugger.go()
    end_s = time.monotonic() + 20.0
    while levels(log)[ENABLE] or levels(log)[PWM]:
        assert time.monotonic() < end_s, "the motor still has its power"
        time.sleep(0.01)
    assert len(PORT_WRITE.findall(log.read_text())) < written + 10  # and nothing goes on
    debugger.close()
