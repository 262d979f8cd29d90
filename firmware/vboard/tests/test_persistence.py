# SPDX-License-Identifier: GPL-3.0-or-later
"""The EEPROM's file, and variables of the firmware set from outside."""

from __future__ import annotations

import binascii
import struct
from pathlib import Path

import pytest
from board_link import BOOT, IDENTIFY, RESPONSE, SYNC, Frames, request
from vboard import ResetCause, VirtualBoard, VirtualBoardError, records

MILLISECOND = 1_000_000


def ask(board: VirtualBoard, command: int) -> bytes:
    """The data of one response."""
    frames = Frames()
    board.run_until(board.now_ns + 50 * MILLISECOND)
    board.read()
    board.write(request(command, 1))
    board.run_until(board.now_ns + 20 * MILLISECOND)
    frames.take(board.read())
    (answer,) = frames.of_type(command | RESPONSE)
    return answer[3:]


def test_the_file_is_the_eeprom(board_elf: Path, tmp_path: Path) -> None:
    eeprom = tmp_path / "eeprom"
    with VirtualBoard(board_elf, eeprom=eeprom) as board:
        assert ask(board, IDENTIFY)[-4:] == b"\xff\xff\xff\xff"
    assert eeprom.read_bytes() == bytes([0xFF]) * 4096
    identity = struct.pack("<II", 1234, 0xFFFFFFFF)
    checksum = struct.pack("<H", binascii.crc_hqx(identity, 0xFFFF))
    eeprom.write_bytes((identity + checksum).ljust(4096, b"\xff"))  # as avrdude would
    with VirtualBoard(board_elf, eeprom=eeprom) as board:
        assert records.IdentifyResponse.unpack(ask(board, IDENTIFY)).board_serial == 1234


def test_what_is_no_eeprom_is_refused(board_elf: Path, tmp_path: Path) -> None:
    short = tmp_path / "short"
    short.write_bytes(b"abc")
    with pytest.raises(VirtualBoardError, match=r"short: is no EEPROM of an ATmega2560 .*name ano"):
        VirtualBoard(board_elf, eeprom=short)
    assert short.read_bytes() == b"abc"
    with pytest.raises(VirtualBoardError, match="No such file or directory"):
        VirtualBoard(board_elf, eeprom=tmp_path / "nowhere" / "eeprom")


def test_preset_time(board_elf: Path) -> None:
    """The upper bits of the firmware's clock, which counts 65 536 ticks each."""
    with VirtualBoard(board_elf) as board:
        board.run_until(50 * MILLISECOND)
        board.preset("overflows", struct.pack("<I", 65535))
        ticks = records.SyncResponse.unpack(ask(board, SYNC)).received_ticks
        assert 65535 << 16 <= ticks < (65535 << 16) + 400_000  # 0.2 s


def test_the_boot_count_passes_its_end(board_elf: Path) -> None:
    """Three times: the complement beside it shows that the RAM kept it over the reset."""
    frames = Frames()
    with VirtualBoard(board_elf) as board:
        for _ in range(3):
            board.run_until(board.now_ns + 50 * MILLISECOND)
            board.preset("boots", b"\xff\xff")
            board.preset("boots_complement", b"\x00\x00")
            for _ in range(2):
                board.reset(ResetCause.WATCHDOG)
                board.run_until(board.now_ns + 50 * MILLISECOND)
        frames.take(board.read())
    counts = [records.BootFrame.unpack(boot[1:]).boot_count for boot in frames.of_type(BOOT)]
    assert counts == [1, 0, 1, 0, 1, 0, 1]


def test_preset_of_what_is_not_there(board_elf: Path) -> None:
    with VirtualBoard(board_elf) as board:
        for variable, data, offset in [
            ("no_such_variable", b"1", 0),
            ("overflows", b"12345", 0),
            ("overflows", b"1", 4),
        ]:
            with pytest.raises(ValueError, match=variable):
                board.preset(variable, data, offset)
