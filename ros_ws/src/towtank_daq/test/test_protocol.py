# SPDX-License-Identifier: Apache-2.0
"""Records and requests, byte by byte, and what is refused."""

import struct
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from ruamel.yaml import YAML
from towtank_daq.configuration import configuration_at
from towtank_daq.framing import FrameReader
from towtank_daq.protocol import Protocol, ProtocolError, Response
from towtank_daq.protocol_records import (
    COMMANDS,
    IDENTIFY,
    START,
    SYNC,
    BootFrame,
    DataFrame,
    HealthFrame,
    IdentifyResponse,
    RecordError,
    StartResponse,
    StreamFrame,
    SyncResponse,
    configure,
)

BOARD_YAML = Path(__file__).parents[1] / "protocol" / "board.yaml"


def test_data_record_byte_by_byte(protocol):
    payload = (
        b"\x10\x2c"
        + struct.pack("<HI", 65535, 0xFFFFFFFE)
        + b"\x3f"
        + bytes.fromhex("010000 ffffff 000080 563412 000000 feffff")
        + struct.pack("<iiB", -1, 2**31 - 1, 0x0F)
    )
    assert protocol.decode(payload) == DataFrame(
        schema=0x2C,
        sequence=65535,
        ticks=0xFFFFFFFE,
        valid_mask=0x3F,
        codes=(1, 0xFFFFFF, 0x800000, 0x123456, 0, 0xFFFFFE),
        crank=-1,
        carriage=2**31 - 1,
        flags=0x0F,
    )


def test_errors_of_the_adc_have_names(protocol):
    assert protocol.adc_errors(0x800002) == "register_checksum + power_on"
    assert protocol.adc_errors(0x000800) == "0x000800"
    assert protocol.adc_errors(0) == "none"


def test_health_record_byte_by_byte(protocol):
    payload = b"\x11" + struct.pack("<10IBHH", *range(1, 14))
    payload += b"\x0e\x00\x00\x0f\x00\x01\x02\x00\x80" + struct.pack("<IBB", 16, 1, 3)
    assert protocol.decode(payload) == HealthFrame(*range(1, 15), 0x01000F, 0x800002, 16, 1, 3)


def test_boot_record_byte_by_byte(protocol):
    assert protocol.decode(b"\x12\x08\x02\x01\x78\x56\x34\x12\x04") == BootFrame(
        8, 0x102, 0x12345678, 4
    )


def test_answers_byte_by_byte(protocol):
    identify = protocol.decode(
        b"\x81\x07\x00\x01\x78\x56\x34\x12\x00\x01\x02\x17"
        + struct.pack("<III", 2_000_000, 0xFFFFFFFF, 42)
    )
    assert (identify.command, identify.request_id, identify.status) == ("identify", 7, 0)
    assert protocol.answer(IDENTIFY, identify) == IdentifyResponse(
        1, 0x12345678, (0, 1, 2), 0x17, 2_000_000, 0xFFFFFFFF, 42
    )
    sync = protocol.decode(b"\x86\x01\x00" + struct.pack("<QQ", 2**63, 2**63 + 5))
    assert protocol.answer(SYNC, sync) == SyncResponse(2**63, 2**63 + 5)
    start = protocol.decode(b"\x83\x01\x00" + struct.pack("<QI", 123456789012, 20000))
    assert protocol.answer(START, start) == StartResponse(123456789012, 20000)


def test_requests_byte_by_byte(protocol):
    reader = FrameReader(protocol.board.wire.maximum_payload)
    assert reader.feed(protocol.request(SYNC, 255)) == [b"\x06\xff"]
    arguments = configuration_at(protocol.board, 100).arguments(protocol.board)
    assert reader.feed(protocol.request(configure(arguments), 3)) == [
        b"\x02\x03\x64\x00\x02\x06\x00\x01\x01\x01\x01\x01\x01\x00\x01\x02\x03\x04\x05"
    ]


@pytest.mark.parametrize(
    ("change", "why"),
    [({"rate_hz": 70000}, "rate_hz=70000"), ({"gains": (1,) * 7}, "7 values in place of 6")],
)
def test_arguments_that_do_not_fit(protocol, change, why):
    arguments = configuration_at(protocol.board, 100).arguments(protocol.board)
    with pytest.raises(RecordError, match=f"ConfigureArguments.*{why}"):
        configure(replace(arguments, **change))


def test_answer_of_another_size(protocol):
    with pytest.raises(ProtocolError, match=r"answer to 'sync': .*: 3 bytes in place of 16"):
        protocol.answer(SYNC, Response("sync", 1, 0, bytes(3)))


def test_refused_response_has_no_data(protocol):
    response = protocol.decode(b"\x83\x01\x05")
    assert response == Response("start", 1, 5, b"")
    assert not protocol.is_ok(response.status)
    assert protocol.status_name(response.status) == "adc_fault"


@given(st.binary(min_size=1, max_size=70))
def test_any_payload_is_a_record_or_a_protocol_error(protocol, payload):
    try:
        record = protocol.decode(payload)
    except ProtocolError:
        return
    assert isinstance(record, StreamFrame | Response)


@pytest.mark.parametrize("payload", [b"\x10\x00", b"\x77\x00\x00", b"\x81\x00", b"\x12" + bytes(9)])
def test_what_the_board_never_sends(protocol, payload):
    with pytest.raises(ProtocolError):
        protocol.decode(payload)


def test_wire_times(protocol):
    """A byte takes ten bits of 4 us; COBS, CRC and the closing zero make four bytes more."""
    assert protocol.request_wire_ns(SYNC) == 40_000 * (2 + 4)
    assert protocol.answer_wire_ns(SYNC) == 40_000 * (3 + 16 + 4)


def test_names_for_people(protocol):
    assert protocol.reset_causes(0x08) == "watchdog"
    assert protocol.reset_causes(0x05) == "power_on + brown_out"
    assert protocol.reset_causes(0) == "unknown cause (a bootloader hides it)"


def test_description_that_the_records_are_not_of_is_refused(description):
    changed = description.model_copy(deep=True)
    changed._hash = description.schema_hash ^ 1
    with pytest.raises(ProtocolError, match=r"built for 0x[0-9a-f]{8}: build firmware"):
        Protocol(changed)


def test_requests_are_known_by_the_files_numbers():
    """board.yaml read here, by another reader than the generator's."""
    commands = YAML(typ="safe").load(BOARD_YAML.read_text())["commands"]
    assert {command["type"]: name for name, command in commands.items()} == COMMANDS
