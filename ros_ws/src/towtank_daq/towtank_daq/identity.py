# SPDX-License-Identifier: Apache-2.0
"""Which board it is: serial number and calibration id, as its EEPROM has them under a checksum.

The amplifiers of two boards differ by up to their gain's tolerance: what was calibrated with one
board does not hold for another. A rig that names a calibration id is therefore for that board only.
"""

from __future__ import annotations

import struct
from binascii import crc_hqx
from dataclasses import dataclass

from towtank_daq.description import BoardDescription

NO_NUMBER = 2**32 - 1
"""What an EEPROM reads where nothing was written: no number of a board."""


def number_text(number: int) -> str:
    """A serial number or calibration id for people."""
    return "unset" if number == NO_NUMBER else str(number)


@dataclass(frozen=True, slots=True)
class StoredIdentity:
    """What a board's EEPROM says of it. `state`: board.yaml's identity_state, by name."""

    state: str
    board_serial: int
    calibration_id: int

    @property
    def trouble(self) -> str:
        """Why it cannot be believed, with the mend; empty if it can."""
        return _IDENTITY_TROUBLES.get(self.state, "")


_WRITE_IT = "write it with `towtank identity`"
_IDENTITY_TROUBLES = {
    "unset": f"the board has no serial number and calibration id: {_WRITE_IT}",
    "without_checksum": "the board's serial number and calibration id are of an older firmware, "
    f"without a checksum: {_WRITE_IT}",
    "damaged": f"the board's serial number and calibration id are damaged: {_WRITE_IT}",
}


def calibration_mismatch(stored: StoredIdentity, calibration_id: int | None) -> str:
    """Why a board is not that of a rig's calibrations, with the mend; empty if it is, or if the rig
    (`calibration_id` None) takes any."""
    if calibration_id is None:
        return ""
    if stored.trouble:
        return f"the rig is for a board of calibration {calibration_id}; {stored.trouble}"
    if stored.calibration_id == calibration_id:
        return ""
    return (
        f"the board has calibration {stored.calibration_id}, the rig's calibrations are for "
        f"{calibration_id}: use that board, or calibrate this one and put its number into "
        "board.calibration_id"
    )


def eeprom_image(board: BoardDescription, board_serial: int, calibration_id: int) -> bytes:
    """An EEPROM that holds an identity and nothing else, as a programmer may write it."""
    layout = board.eeprom
    numbers = struct.pack("<II", board_serial, calibration_id)
    checksum = struct.pack("<H", crc_hqx(numbers, board.wire.crc16.initial))
    if (layout.board_serial, layout.calibration_id, layout.identity_checksum) != (0, 4, 8):
        raise ValueError("board.yaml has the identity elsewhere than this driver knows")
    return numbers + checksum
