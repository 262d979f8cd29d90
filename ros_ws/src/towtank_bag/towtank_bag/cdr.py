# SPDX-License-Identifier: Apache-2.0
"""Columns out of serialised messages without decoding them one by one.

Most topics send messages whose CDR form has the same layout every time: strings and sequences keep
their length. For them the place of every number is worked out once, on the first message, and the
column is cut out of all messages at once.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype

_ENCAPSULATION = 4  # bytes before the body; alignment counts from their end
_LITTLE_ENDIAN = b"\x00\x01"
_NUMBERS = {
    "bool": "?",
    "byte": "u1",
    "char": "u1",
    "int8": "i1",
    "uint8": "u1",
    "int16": "<i2",
    "uint16": "<u2",
    "int32": "<i4",
    "uint32": "<u4",
    "int64": "<i8",
    "uint64": "<u8",
    "float32": "<f4",
    "float64": "<f8",
}


class LayoutError(ValueError):
    """The messages have no common layout, or one that is not understood here."""


@dataclass(frozen=True)
class Column:
    """Place of one field in a payload: bytes from its start, numpy type, number of values
    (None for a single value)."""

    offset: int
    dtype: np.dtype[Any]
    count: int | None


@dataclass
class Layout:
    """Places of the fields of one message type, valid for payloads that agree in the guards.

    columns: by dotted path, as `pose.pose.position.z`; elements of arrays of messages are
    `status[0].level`.
    texts: constant strings, and lists of them, by dotted path.
    guards: (offset, bytes) that hold lengths and strings.
    """

    size: int = 0
    columns: dict[str, Column] = field(default_factory=dict)
    texts: dict[str, str | list[str]] = field(default_factory=dict)
    guards: list[tuple[int, bytes]] = field(default_factory=list)

    def table(self, payloads: Sequence[bytes]) -> Table:
        """All payloads as one array; raises LayoutError when one is laid out otherwise."""
        if any(len(payload) != self.size for payload in payloads):
            raise LayoutError("messages differ in length")
        rows = np.frombuffer(b"".join(payloads), np.uint8).reshape(len(payloads), self.size)
        for offset, expected in self.guards:
            guarded = rows[:, offset : offset + len(expected)]
            if (guarded != np.frombuffer(expected, np.uint8)).any():
                raise LayoutError("strings or sequences change from message to message")
        return Table(self, rows)


@dataclass(frozen=True)
class Table:
    """Payloads of one layout; rows: uint8, shape (n, layout.size)."""

    layout: Layout
    rows: np.ndarray

    def column(self, path: str) -> np.ndarray:
        """Values of one field: shape (n,) or (n, count). Raises KeyError for an unknown path."""
        text = self.layout.texts.get(path)
        if text is not None:
            values = np.array(text, dtype=object)
            return np.broadcast_to(values, (len(self.rows), *values.shape))
        column = self.layout.columns[path]
        width = column.dtype.itemsize * (1 if column.count is None else column.count)
        cut = np.ascontiguousarray(self.rows[:, column.offset : column.offset + width])
        if column.count is None:
            return cut.view(column.dtype)[:, 0]
        if column.count == 0:
            return np.empty((len(self.rows), 0), column.dtype)
        return cut.view(column.dtype)


def layout_of(payload: bytes, type_name: str, fields: Mapping[str, Any]) -> Layout:
    """Layout of one message of type `package/msg/Name`.

    fields: field definitions by type name, as in a rosbags typestore (`fielddefs`). Raises
    LayoutError for an encoding other than little-endian CDR, for wide strings, and for a payload
    that ends too early.
    """
    if payload[:2] != _LITTLE_ENDIAN:
        raise LayoutError("not little-endian CDR")
    walk = _Walk(payload, fields)
    walk.message(type_name, "")
    walk.layout.size = len(payload)
    return walk.layout


class _Walk:
    """Goes through one payload field by field and notes where everything is."""

    def __init__(self, payload: bytes, fields: Mapping[str, Any]) -> None:
        self.payload = payload
        self.fields = fields
        self.position = _ENCAPSULATION
        self.layout = Layout()

    def message(self, type_name: str, prefix: str) -> None:
        for name, (kind, detail) in self.fields[type_name][1]:
            self.value(kind, detail, f"{prefix}{name}")

    def value(self, kind: Nodetype, detail: Any, path: str) -> None:
        if kind == Nodetype.BASE:
            self.base(detail[0], path)
        elif kind == Nodetype.NAME:
            self.message(detail, f"{path}.")
        elif kind == Nodetype.ARRAY:
            self.elements(*detail[0], detail[1], path)
        else:
            self.elements(*detail[0], self.length(), path)

    def base(self, type_name: str, path: str) -> None:
        if type_name == "string":
            self.layout.texts[path] = self.string()
        else:
            dtype = _number(type_name)
            self.align(dtype.itemsize)
            self.layout.columns[path] = Column(self.position, dtype, None)
            self.advance(dtype.itemsize)

    def elements(self, kind: Nodetype, detail: Any, count: int, path: str) -> None:
        if kind != Nodetype.BASE:
            self.require(count)  # an element takes a byte at least
            for index in range(count):
                self.value(kind, detail, f"{path}[{index}]")
        elif detail[0] == "string":
            self.require(count)
            self.layout.texts[path] = [self.string() for _ in range(count)]
        else:
            dtype = _number(detail[0])
            if count:
                self.align(dtype.itemsize)
            self.layout.columns[path] = Column(self.position, dtype, count)
            self.advance(count * dtype.itemsize)

    def string(self) -> str:
        length = self.length()  # with the closing zero
        text = self.payload[self.position : self.position + length]
        self.guard(length)
        try:
            return text.rstrip(b"\0").decode()
        except UnicodeDecodeError as error:
            raise LayoutError("a string is no UTF-8") from error

    def length(self) -> int:
        self.align(4)
        self.require(4)
        (length,) = struct.unpack_from("<I", self.payload, self.position)
        self.guard(4)
        return int(length)

    def guard(self, length: int) -> None:
        start = self.position
        self.advance(length)
        self.layout.guards.append((start, self.payload[start : self.position]))

    def advance(self, length: int) -> None:
        self.require(length)
        self.position += length

    def require(self, length: int) -> None:
        if self.position + length > len(self.payload):
            raise LayoutError("a message ends before its fields do")

    def align(self, size: int) -> None:
        self.position += -(self.position - _ENCAPSULATION) % size


def _number(type_name: str) -> np.dtype[Any]:
    try:
        return np.dtype(_NUMBERS[type_name])
    except KeyError:
        raise LayoutError(f"{type_name} fields are not gathered") from None
