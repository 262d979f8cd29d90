# SPDX-License-Identifier: Apache-2.0
"""What passes over the ADC board's wires: requests out, records in.

The records themselves, what they hold and by which numbers they are known, are generated from
board.yaml (protocol_records); the names of numbers come from the board's description.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from towtank_daq.description import BoardDescription
from towtank_daq.framing import encode_frame, encoded_size
from towtank_daq.protocol_records import (
    COMMANDS,
    RESPONSE_BIT,
    SCHEMA_HASH,
    STREAM,
    AnswerT,
    HealthFrame,
    RecordError,
    Request,
    StreamFrame,
)


class ProtocolError(Exception):
    """A payload, or the description itself, does not fit the protocol."""


@dataclass(frozen=True, slots=True)
class Response:
    """Answer to a request; the data is decoded by the one who asked (`Protocol.answer`)."""

    command: str
    request_id: int
    status: int
    data: bytes


_TROUBLES = (
    "missed_ticks",
    "scan_overruns",
    "spi_crc_errors",
    "adc_sequence_errors",
    "adc_errors",
    "adc_restarts",
    "illegal_steps",
    "rx_overflows",
    "rx_bad_frames",
    "dropped_frames",
)


def troubles(health: HealthFrame) -> dict[str, int]:
    """The board's counters of what went wrong, by name: all 0 on a board that is well."""
    return {name: getattr(health, name) for name in _TROUBLES}


class Protocol:
    """Encodes requests, decodes what the board sends, and knows what its numbers mean.

    Raises ProtocolError for a description that the records were not generated from.
    """

    def __init__(self, board: BoardDescription) -> None:
        if board.schema_hash != SCHEMA_HASH:
            raise ProtocolError(
                f"board.yaml has schema 0x{board.schema_hash:08x}, but the driver was built for "
                f"0x{SCHEMA_HASH:08x}: build firmware and workspace again"
            )
        self.board = board

    def request_wire_ns(self, request: Request[Any]) -> int:
        """Time that the bytes of a request take on the line, ns."""
        return self._wire_ns(2 + len(request.arguments))

    def answer_wire_ns(self, request: Request[Any]) -> int:
        """Time that the bytes of a good answer take on the line, ns."""
        return self._wire_ns(3 + request.answer.LAYOUT.size)

    def reset_causes(self, bits: int) -> str:
        """Names of the bits in `reset_cause`, for people."""
        causes = self.board.reset_cause
        known = " + ".join(name for name, bit in causes.items() if bits & bit)
        return known or "unknown cause (a bootloader hides it)"

    def adc_errors(self, bits: int) -> str:
        """Names of the bits in `adc_error_bits`, for people."""
        names = [name for name, bit in self.board.adc_error.items() if bits & bit]
        other = bits & ~sum(self.board.adc_error.values())
        return " + ".join([*names, *([f"0x{other:06x}"] if other else [])]) or "none"

    def configuration_origin(self, number: int) -> str:
        """Name of where the board has its configuration from, for people."""
        names = {value: name for name, value in self.board.configuration_origin.items()}
        return names.get(number, f"origin {number}")

    def status_name(self, status: int) -> str:
        """Name of a response's status."""
        names = {number: name for name, number in self.board.status.items()}
        return names.get(status, f"status {status}")

    def is_ok(self, status: int) -> bool:
        """Whether a response's status says that the request was carried out."""
        return status == self.board.status["ok"]

    # -- coding

    def request(self, request: Request[Any], request_id: int) -> bytes:
        """The frame of a request."""
        return encode_frame(bytes((request.frame_type, request_id)) + request.arguments)

    def decode(self, payload: bytes) -> StreamFrame | Response:
        """What a good frame's payload says. Raises ProtocolError for what the board never sends."""
        kind = payload[0]
        if kind in STREAM:
            try:
                return STREAM[kind].unpack(payload[1:])
            except RecordError as error:
                raise ProtocolError(str(error)) from error
        if kind & RESPONSE_BIT and kind ^ RESPONSE_BIT in COMMANDS:
            if len(payload) < 3:
                raise ProtocolError(f"response of {len(payload)} bytes")
            return Response(COMMANDS[kind ^ RESPONSE_BIT], payload[1], payload[2], payload[3:])
        raise ProtocolError(f"unknown frame type 0x{kind:02x}")

    def answer(self, request: Request[AnswerT], response: Response) -> AnswerT:
        """The data of a response whose status is ok. Raises ProtocolError."""
        try:
            return request.answer.unpack(response.data)
        except RecordError as error:
            raise ProtocolError(f"answer to '{request.command}': {error}") from error

    def _wire_ns(self, payload_size: int) -> int:
        bits_per_byte = 10  # start, eight, stop
        return round(1e9 * bits_per_byte * encoded_size(payload_size) / self.board.wire.baud)
