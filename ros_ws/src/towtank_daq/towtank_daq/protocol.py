# SPDX-License-Identifier: Apache-2.0
"""What passes over the ADC board's wires, as typed records.

Types, layouts and numbers come from the board's description. This module adds the names: each
record class below has the fields that the description gives the frame of that name, which is
checked when a Protocol is made.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, fields
from typing import Any

from towtank_daq.description import BoardDescription
from towtank_daq.framing import encode_frame, encoded_size


class ProtocolError(Exception):
    """A payload, or the description itself, does not fit the protocol."""


# ---------------------------------------------------------------------------------- records


@dataclass(frozen=True, slots=True)
class DataRecord:
    """One scan as sent: sequence modulo 2^16, ticks modulo 2^32, 24-bit codes."""

    schema: int
    sequence: int
    ticks: int
    valid_mask: int
    codes: tuple[int, ...]
    crank: int
    carriage: int
    flags: int


@dataclass(frozen=True, slots=True)
class HealthRecord:
    """The board's counters since its reset, and its state."""

    missed_ticks: int
    scan_overruns: int
    spi_crc_errors: int
    adc_sequence_errors: int
    adc_errors: int
    adc_restarts: int
    illegal_steps: int
    rx_overflows: int
    rx_bad_frames: int
    dropped_frames: int
    reset_cause: int
    boot_count: int
    stack_low_water: int
    adc_temperature_code: int
    supply_code: int
    adc_error_bits: int
    scans_scheduled: int
    state: int
    configuration_origin: int

    @property
    def troubles(self) -> dict[str, int]:
        """Counters of what went wrong, by name: all 0 on a board that is well."""
        return {name: getattr(self, name) for name in _TROUBLES}


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


@dataclass(frozen=True, slots=True)
class BootRecord:
    """Sent once after a reset."""

    reset_cause: int
    boot_count: int
    schema_hash: int
    configuration_origin: int


@dataclass(frozen=True, slots=True)
class DriveRecord:
    """How the crank's drive is; speeds in 0.01 rpm, duty in 0.01 %."""

    ticks: int
    state: int
    trip: int
    target: int
    setpoint: int
    speed: int
    duty: int
    emergency_stop_closed: int


@dataclass(frozen=True, slots=True)
class DriveAnswer:
    """Answer to `drive`."""

    state: int
    trip: int


@dataclass(frozen=True, slots=True)
class Identity:
    """Who the board is: answer to `identify`."""

    protocol: int
    schema_hash: int
    firmware_version: tuple[int, ...]
    adc_id: int
    clock_hz: int
    calibration_id: int
    board_serial: int


@dataclass(frozen=True, slots=True)
class IdentityRecord:
    """Answer to `identity`: what is stored, whatever it is worth."""

    state: int
    board_serial: int
    calibration_id: int


@dataclass(frozen=True, slots=True)
class IdentityStored:
    """Answer to `set_identity`."""


@dataclass(frozen=True, slots=True)
class Configured:
    """Answer to `configure`."""

    period_ticks: int


@dataclass(frozen=True, slots=True)
class ConfigurationRecord:
    """Answer to `configuration`, in the board's numbers (see towtank_daq.configuration)."""

    rate_hz: int
    filter_type: int
    filter_fs: int
    gains: tuple[int, ...]
    order: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Started:
    """Answer to `start`: instant of scan 0, unwrapped ticks."""

    first_tick: int
    period_ticks: int


@dataclass(frozen=True, slots=True)
class Stopped:
    """Answer to `stop`."""

    scans_scheduled: int


@dataclass(frozen=True, slots=True)
class SelfTestRecord:
    """Answer to `self_test`: mean codes (see towtank_daq.self_test for what they mean)."""

    adc_id: int
    spi_errors: int
    conversions_missing: int
    short_code: int
    short_spread: int
    known_voltage_code: int
    supply_code: int
    supply_on_refin1_code: int
    rest_codes: tuple[int, ...]
    deflected_codes: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class ResetTaken:
    """Answer to `reset`: the board is about to reset itself."""


@dataclass(frozen=True, slots=True)
class BoardTime:
    """Answer to `sync`, unwrapped ticks."""

    received_ticks: int
    sent_ticks: int


@dataclass(frozen=True, slots=True)
class Response:
    """Answer to a request; the data is decoded by the one who asked (`Protocol.answer`)."""

    command: str
    request_id: int
    status: int
    data: bytes


StreamRecord = DataRecord | HealthRecord | BootRecord | DriveRecord
Answer = (
    Identity
    | IdentityRecord
    | IdentityStored
    | Configured
    | ConfigurationRecord
    | Started
    | Stopped
    | SelfTestRecord
    | ResetTaken
    | BoardTime
    | HealthRecord
    | DriveAnswer
)

_STREAM_RECORDS: dict[str, type] = {
    "data": DataRecord,
    "health": HealthRecord,
    "boot": BootRecord,
    "drive": DriveRecord,
}
_ANSWERS: dict[str, type] = {
    "identify": Identity,
    "identity": IdentityRecord,
    "set_identity": IdentityStored,
    "configure": Configured,
    "start": Started,
    "stop": Stopped,
    "sync": BoardTime,
    "counters": HealthRecord,
    "configuration": ConfigurationRecord,
    "self_test": SelfTestRecord,
    "reset": ResetTaken,
    "drive": DriveAnswer,
}


# --------------------------------------------------------------------------------- layouts


_INTEGERS = {"u8": "B", "u16": "H", "u32": "I", "u64": "Q", "i16": "h", "i32": "i", "i64": "q"}
_BYTES = {"u8": 1, "u24": 3}
"""Elements that are handled as bytes, where `struct` has no such type or no such array."""


class _Layout:
    """Fields of fixed size one after another, little-endian."""

    def __init__(self, where: str, specification: list[tuple[str, str]]) -> None:
        self.where = where
        self.names = [name for name, _ in specification]
        code = "<"
        self._numbers: list[tuple[int, int]] = []  # (place, bytes) of single u24
        self._arrays: list[tuple[int, int]] = []  # (place, bytes of an element)
        for place, (name, kind) in enumerate(specification):
            element, _, count = kind.removesuffix("]").partition("[")
            if count and element in _BYTES:
                self._arrays.append((place, _BYTES[element]))
                code += f"{int(count) * _BYTES[element]}s"
            elif not count and element in _INTEGERS:
                code += _INTEGERS[element]
            elif not count and element in _BYTES:
                self._numbers.append((place, _BYTES[element]))
                code += f"{_BYTES[element]}s"
            else:
                raise ProtocolError(f"{where}.{name}: unknown type '{kind}'")
        self._struct = struct.Struct(code)

    @property
    def size(self) -> int:
        return self._struct.size

    def unpack(self, data: bytes) -> list[Any]:
        """The values in the order of the fields."""
        if len(data) != self.size:
            raise ProtocolError(f"{self.where} holds {len(data)} bytes instead of {self.size}")
        values: list[Any] = list(self._struct.unpack(data))
        for place, _ in self._numbers:
            values[place] = int.from_bytes(values[place], "little")
        for place, size in self._arrays:
            raw = values[place]
            values[place] = tuple(
                int.from_bytes(raw[k : k + size], "little") for k in range(0, len(raw), size)
            )
        return values

    def pack(self, values: dict[str, Any]) -> bytes:
        """The bytes of one value per field."""
        if values.keys() != set(self.names):
            raise ProtocolError(f"{self.where} takes {self.names}, not {sorted(values)}")
        items = [values[name] for name in self.names]
        try:
            for place, size in self._numbers:
                items[place] = items[place].to_bytes(size, "little")
            for place, size in self._arrays:
                items[place] = b"".join(item.to_bytes(size, "little") for item in items[place])
            return self._struct.pack(*items)
        except (struct.error, OverflowError) as error:
            raise ProtocolError(f"{self.where}: {values}: {error}") from error


# --------------------------------------------------------------------------------- protocol


class Protocol:
    """Encodes requests and decodes what the board sends, after the board's description."""

    def __init__(self, board: BoardDescription) -> None:
        self.board = board
        self._stream: dict[int, tuple[type, _Layout]] = {}
        for name, record in _STREAM_RECORDS.items():
            frame = board.stream[name]
            layout = _Layout(f"frame {name}", frame.fields)
            self._stream[frame.type] = (record, _checked(layout, record))
        self._arguments: dict[str, _Layout] = {}
        self._answers: dict[str, tuple[type, _Layout]] = {}
        self._responses: dict[int, str] = {}
        for name, record in _ANSWERS.items():
            command = board.commands[name]
            layout = _Layout(f"answer to {name}", command.response)
            self._answers[name] = (record, _checked(layout, record))
            self._arguments[name] = _Layout(f"request {name}", command.arguments)
            self._responses[command.type | board.wire.response_bit] = name

    def request_wire_ns(self, command: str) -> int:
        """Time that the bytes of a request take on the line, ns."""
        return self._wire_ns(2 + self._arguments[command].size)

    def answer_wire_ns(self, command: str) -> int:
        """Time that the bytes of a good answer take on the line, ns."""
        return self._wire_ns(3 + self._answers[command][1].size)

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

    def request(self, command: str, request_id: int, **arguments: Any) -> bytes:
        """The frame of a request."""
        head = bytes((self.board.commands[command].type, request_id))
        return encode_frame(head + self._arguments[command].pack(arguments))

    def decode(self, payload: bytes) -> StreamRecord | Response:
        """What a good frame's payload says. Raises ProtocolError for what the board never sends."""
        kind = payload[0]
        if kind in self._stream:
            record, layout = self._stream[kind]
            return record(*layout.unpack(payload[1:]))
        if kind in self._responses:
            if len(payload) < 3:
                raise ProtocolError(f"response of {len(payload)} bytes")
            return Response(self._responses[kind], payload[1], payload[2], payload[3:])
        raise ProtocolError(f"unknown frame type 0x{kind:02x}")

    def answer(self, response: Response) -> Answer:
        """The data of a response whose status is ok."""
        record, layout = self._answers[response.command]
        return record(*layout.unpack(response.data))

    def _wire_ns(self, payload_size: int) -> int:
        bits_per_byte = 10  # start, eight, stop
        return round(1e9 * bits_per_byte * encoded_size(payload_size) / self.board.wire.baud)


def _checked(layout: _Layout, record: type) -> _Layout:
    """`layout`, if it has the fields of `record` in their order."""
    expected = [field.name for field in fields(record)]
    if layout.names != expected:
        raise ProtocolError(
            f"board.yaml: {layout.where} has the fields {layout.names}; this driver "
            f"knows {expected}"
        )
    return layout
