# SPDX-License-Identifier: Apache-2.0
"""Contradictions in the board file are refused, and the schema hash means its contents."""

from __future__ import annotations

import copy
import hashlib
import sys
import tempfile
import types
import unittest
from collections.abc import Callable
from pathlib import Path
from typing import Any

from generate import (
    BOARD_YAML,
    Inconsistent,
    channel_register,
    check_consistency,
    config_register,
    header,
    layouts,
    records,
)
from schema_hash import load_board, schema_hash

Board = dict[str, Any]


def reference_outside_the_amplifiers_swing(board: Board) -> None:
    board["channels"][0]["output_reference_volts"] = 1.25


def shared_type(board: Board) -> None:
    board["commands"]["sync"]["type"] = board["commands"]["stop"]["type"]


def response_of_a_command(board: Board) -> None:
    board["stream"]["data"]["type"] = board["commands"]["stop"]["type"] | 0x80


def missing_channel(board: Board) -> None:
    board["channels"].pop()


def doubled_channel(board: Board) -> None:
    board["channels"][1]["name"] = board["channels"][0]["name"]


def unknown_setup(board: Board) -> None:
    board["channels"][2]["setup"] = "differential"


def unknown_input(board: Board) -> None:
    board["housekeeping"][0]["positive"] = "AIN16"


def buffer_on_ground(board: Board) -> None:
    board["adc"]["setups"]["single_ended"]["buffer_negative"] = True


def reference_buffer_on_ground(board: Board) -> None:
    board["adc"]["setups"]["bridge"]["reference_buffer_negative"] = True


def unknown_field_type(board: Board) -> None:
    board["stream"]["data"]["fields"][0][1] = "u12"


def doubled_pin(board: Board) -> None:
    board["pins"]["led"]["pin"] = board["pins"]["adc_cs"]["pin"]


def payload_too_long(board: Board) -> None:
    board["stream"]["data"]["fields"].append(["more", "u32[16]"])


def unknown_filter(board: Board) -> None:
    board["adc"]["filter"]["type"] = "sinc5"


def overlapping_slots(board: Board) -> None:
    board["eeprom"]["configuration"]["slots"] = [64, 84]


def gains_of_other_channels(board: Board) -> None:
    board["commands"]["configure"]["arguments"][3][1] = "u8[7]"


def fractional_prescaler(board: Board) -> None:
    board["microcontroller"]["tick_hz"] = 3_000_000


class Generation(unittest.TestCase):
    def setUp(self) -> None:
        self.board = load_board(BOARD_YAML)

    def test_the_file_is_consistent(self) -> None:
        check_consistency(self.board)

    def test_contradictions_are_refused(self) -> None:
        spoilers: list[tuple[Callable[[Board], None], str]] = [
            (reference_outside_the_amplifiers_swing, "output_limits_volts"),
            (shared_type, "frame types"),
            (response_of_a_command, "frame types"),
            (missing_channel, "data.codes"),
            (doubled_channel, "channels"),
            (unknown_setup, "accel_x"),
            (unknown_input, "adc_temperature"),
            (buffer_on_ground, "excitation: its negative input is AVSS"),
            (reference_buffer_on_ground, "setup bridge: REFIN1− is AVSS"),
            (unknown_field_type, "schema"),
            (doubled_pin, "pins"),
            (payload_too_long, "data_frame"),
            (unknown_filter, "adc.filter.type"),
            (overlapping_slots, "eeprom"),
            (gains_of_other_channels, "configure.gains"),
            (fractional_prescaler, "tick_hz"),
        ]
        for spoil, named in spoilers:
            with self.subTest(spoil.__name__):
                board = copy.deepcopy(self.board)
                spoil(board)
                with self.assertRaisesRegex(Inconsistent, named):
                    check_consistency(board)

    def test_sizes_on_the_wire(self) -> None:
        sizes = {name: sum(field.size for field in fields) for name, fields in layouts(self.board)}
        self.assertEqual(sizes["data_frame"], 35)
        self.assertEqual(sizes["bench_frame"], 80)
        self.assertEqual(sizes["identify_response"], 21)

    def test_arrays_have_as_many_elements_as_the_list_that_they_name(self) -> None:
        """A board with a channel less in the file itself: every record follows, nothing clashes."""
        before, _, rest = BOARD_YAML.read_text(encoding="utf-8").partition("  - name: excitation")
        after = rest[rest.index("\n# One more slot") :]
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "board.yaml"
            path.write_text(before + after, encoding="utf-8")
            board = load_board(path)
        check_consistency(board)
        counts = {
            (name, field.name): field.count
            for name, fields in layouts(board)
            for field in fields
            if field.count
        }
        self.assertEqual(
            counts,
            {
                ("data_frame", "codes"): 5,
                ("identify_response", "firmware_version"): 3,
                ("configure_arguments", "gains"): 5,
                ("configure_arguments", "order"): 5,
                ("self_test_response", "rest_codes"): 3,
                ("self_test_response", "deflected_codes"): 3,
                ("bench_frame", "terminal_volts"): 5,
            },
        )

    def test_register_words_of_the_data_sheet(self) -> None:
        setups = self.board["adc"]["setups"]
        self.assertEqual(config_register(setups["bridge"]), 0x0960)
        self.assertEqual(config_register(setups["supply_on_refin1"]), 0x0900)
        self.assertEqual(channel_register(self.board["channels"][5], 1), 0x90F1)

    def test_header_carries_the_hash(self) -> None:
        self.assertIn(f"UINT32_C({schema_hash(self.board)})", header(self.board))


class Records(unittest.TestCase):
    """The generated module, imported, against bytes that are made here by hand."""

    def setUp(self) -> None:
        board = load_board(BOARD_YAML)
        self.module = types.ModuleType("protocol_records")
        sys.modules["protocol_records"] = self.module  # where its dataclasses look for their types
        self.addCleanup(sys.modules.pop, "protocol_records")
        exec(records(board), self.module.__dict__)

    def test_fields_in_the_order_of_the_file_and_little_endian(self) -> None:
        arguments = self.module.ConfigureArguments(
            0x0102, 3, 0x0405, (1,) * 6, (0, 1, 2, 3, 4, 255)
        )
        bytes_by_hand = b"\x02\x01\x03\x05\x04" + b"\x01" * 6 + b"\x00\x01\x02\x03\x04\xff"
        self.assertEqual(arguments.pack(), bytes_by_hand)
        self.assertEqual(self.module.ConfigureArguments.unpack(bytes_by_hand), arguments)

    def test_numbers_of_24_bits(self) -> None:
        codes = bytes.fromhex("010000 ffffff 000080 563412 000000 feffff")
        payload = b"\x2c\x02\x00\x03\x00\x00\x00\x3f" + codes + bytes(9)
        frame = self.module.DataFrame.unpack(payload)
        self.assertEqual(frame.codes, (1, 0xFFFFFF, 0x800000, 0x123456, 0, 0xFFFFFE))
        self.assertEqual(frame.pack(), payload)
        with self.assertRaisesRegex(self.module.RecordError, "34 bytes in place of 35"):
            self.module.DataFrame.unpack(payload[1:])

    def test_a_request_knows_its_answer(self) -> None:
        self.assertIs(self.module.SYNC.answer, self.module.SyncResponse)
        self.assertIs(self.module.COUNTERS.answer, self.module.HealthFrame)
        identity = self.module.SetIdentityArguments(1, 2)
        request = self.module.set_identity(identity)
        self.assertEqual((request.frame_type, request.arguments), (0x0C, identity.pack()))
        self.assertIs(request.answer, self.module.Empty)


class SchemaHash(unittest.TestCase):
    def test_is_the_sha_256_of_the_canonical_json(self) -> None:
        digest = hashlib.sha256(b'{"a":[1,2],"b":0.5}').digest()
        self.assertEqual(schema_hash({"b": 0.5, "a": [1, 2]}), int.from_bytes(digest[:4], "little"))

    def test_comments_do_not_count_and_values_do(self) -> None:
        text = BOARD_YAML.read_text(encoding="utf-8")
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "board.yaml"
            path.write_text(text + "# one more comment\n", encoding="utf-8")
            same = schema_hash(load_board(path))
            path.write_text(text.replace("gain: 35.96", "gain: 35.97"), encoding="utf-8")
            other = schema_hash(load_board(path))
        self.assertEqual(same, schema_hash(load_board(BOARD_YAML)))
        self.assertNotEqual(other, same)


if __name__ == "__main__":
    unittest.main()
