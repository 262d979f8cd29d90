# SPDX-License-Identifier: Apache-2.0
"""Whether a board is the one that a rig was calibrated with."""

import pytest
from towtank_daq.identity import (
    NO_NUMBER,
    StoredIdentity,
    calibration_mismatch,
    eeprom_image,
    number_text,
)

VALID = StoredIdentity("valid", 17, 3)


@pytest.mark.parametrize("state", ["valid", "unset", "without_checksum", "damaged"])
def test_a_rig_that_names_no_board_takes_any(state):
    assert calibration_mismatch(StoredIdentity(state, 17, 3), None) == ""


def test_the_rigs_board_is_taken_and_another_is_not():
    assert calibration_mismatch(VALID, 3) == ""
    assert calibration_mismatch(VALID, 4).startswith(
        "the board has calibration 3, the rig's calibrations are for 4: use that board"
    )


@pytest.mark.parametrize("state", ["unset", "without_checksum", "damaged"])
def test_numbers_that_cannot_be_believed_are_those_of_no_board(state):
    mismatch = calibration_mismatch(StoredIdentity(state, 17, 3), 3)
    assert "write it with `towtank identity`" in mismatch and "\n" not in mismatch


def test_the_image_is_what_the_firmware_reads(protocol):
    """By hand: CRC-16/CCITT-FALSE of the eight bytes, by long division."""
    image = eeprom_image(protocol.board, 17, 3)
    assert image[:8] == b"\x11\0\0\0\x03\0\0\0"
    remainder = int.from_bytes(image[:8]) << 16
    remainder ^= 0xFFFF << 64  # the initial value, over the first two bytes
    for bit in range(79, 15, -1):
        if remainder >> bit & 1:
            remainder ^= 0x11021 << (bit - 16)
    assert int.from_bytes(image[8:], "little") == remainder


def test_numbers_for_people():
    assert (number_text(17), number_text(NO_NUMBER)) == ("17", "unset")
