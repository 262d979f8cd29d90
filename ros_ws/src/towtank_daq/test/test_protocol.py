# SPDX-License-Identifier: Apache-2.0
"""Records and requests, byte by byte, and what is refused."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from towtank_daq.configuration import configuration_at
from towtank_daq.framing import FrameReader
from towtank_daq.protocol import (
    BoardTime,
    BootRecord,
    DataRecord,
    HealthRecord,
    Identity,
    Protocol,
    ProtocolError,
    Response,
    Started,
)


def test_data_record_byte_by_byte(protocol):
    payload = (
        b"\x10\x2c"
        + struct.pack("<HI", 65535, 0xFFFFFFFE)
        + b"\x3f"
        + bytes.fromhex("010000 ffffff 000080 563412 000000 feffff")
        + struct.pack("<iiB", -1, 2**31 - 1, 0x0F)
    )
    assert protocol.decode(payload) == DataRecord(
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
    assert protocol.decode(payload) == HealthRecord(*range(1, 15), 0x01000F, 0x800002, 16, 1, 3)


def test_boot_record_byte_by_byte(protocol):
    assert protocol.decode(b"\x12\x08\x02\x01\x78\x56\x34\x12\x04") == BootRecord(
        8, 0x102, 0x12345678, 4
    )


def test_answers_byte_by_byte(protocol):
    identify = protocol.decode(
        b"\x81\x07\x00\x01\x78\x56\x34\x12\x00\x01\x02\x17"
        + struct.pack("<III", 2_000_000, 0xFFFFFFFF, 42)
    )
    assert (identify.command, identify.request_id, identify.status) == ("identify", 7, 0)
    assert protocol.answer(identify) == Identity(
        1, 0x12345678, (0, 1, 2), 0x17, 2_000_000, 0xFFFFFFFF, 42
    )
    sync = protocol.decode(b"\x86\x01\x00" + struct.pack("<QQ", 2**63, 2**63 + 5))
    assert protocol.answer(sync) == BoardTime(2**63, 2**63 + 5)
    start = protocol.decode(b"\x83\x01\x00" + struct.pack("<QI", 123456789012, 20000))
    assert protocol.answer(start) == Started(123456789012, 20000)


def test_requests_byte_by_byte(protocol):
    reader = FrameReader(protocol.board.wire.maximum_payload)
    assert reader.feed(protocol.request("sync", 255)) == [b"\x06\xff"]
    arguments = configuration_at(protocol.board, 100).arguments(protocol.board)
    assert reader.feed(protocol.request("configure", 3, **arguments)) == [
        b"\x02\x03\x64\x00\x02\x06\x00\x01\x01\x01\x01\x01\x01\x00\x01\x02\x03\x04\x05"
    ]


def test_request_with_wrong_arguments(protocol):
    with pytest.raises(ProtocolError, match="rate_hz"):
        protocol.request("configure", 1, rate_hz=100)
    with pytest.raises(ProtocolError, match="request configure"):
        arguments = configuration_at(protocol.board, 100).arguments(protocol.board)
        protocol.request("configure", 1, **arguments | {"rate_hz": 70000})


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
    assert isinstance(record, DataRecord | HealthRecord | BootRecord | Response)


@pytest.mark.parametrize("payload", [b"\x10\x00", b"\x77\x00\x00", b"\x81\x00", b"\x12" + bytes(9)])
def test_what_the_board_never_sends(protocol, payload):
    with pytest.raises(ProtocolError):
        protocol.decode(payload)


def test_wire_times(protocol):
    """A byte takes ten bits of 4 us; COBS, CRC and the closing zero make four bytes more."""
    assert protocol.request_wire_ns("sync") == 40_000 * (2 + 4)
    assert protocol.answer_wire_ns("sync") == 40_000 * (3 + 16 + 4)


def test_names_for_people(protocol):
    assert protocol.reset_causes(0x08) == "watchdog"
    assert protocol.reset_causes(0x05) == "power_on + brown_out"
    assert protocol.reset_causes(0) == "unknown cause (a bootloader hides it)"


def test_description_with_other_fields_is_refused(description):
    changed = description.model_copy(deep=True)
    changed.stream["data"].fields[1] = ("number", "u16")
    with pytest.raises(ProtocolError, match=r"frame data has the fields .*'number'"):
        Protocol(changed)


def test_description_with_unknown_type_is_refused(description):
    changed = description.model_copy(deep=True)
    changed.stream["data"].fields[1] = ("sequence", "u12")
    with pytest.raises(ProtocolError, match=r"frame data.sequence: unknown type 'u12'"):
        Protocol(changed)
