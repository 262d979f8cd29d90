# SPDX-License-Identifier: Apache-2.0
"""Messages out of their bytes, by the definition that a bag holds of their type."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from rosbags.serde import SerdeError
from rosbags.typesys import (
    Stores,
    TypesysError,
    get_types_from_idl,
    get_types_from_msg,
    get_typestore,
)
from rosbags.typesys.store import Typestore

from towtank_bag.cdr import LayoutError, layout_of
from towtank_bag.definitions import DefinitionError, message_definition
from towtank_bag.layout import BagError

_SEPARATOR = "=" * 80
_NO_MESSAGE = (
    AssertionError,
    AttributeError,
    IndexError,
    KeyError,
    MemoryError,
    OverflowError,
    RecursionError,
    SerdeError,
    TypeError,
    TypesysError,
    ValueError,
    struct.error,
)
"""What rosbags raises on bytes that are no message, or on text that is no definition."""


@dataclass(frozen=True)
class MessageForm:
    """How the messages of a topic are written.

    where: bag and topic, for errors. type_name: `package/msg/Name`. encoding: of the messages;
    `cdr` is read. definition: text of the type's definition, in the form that schema_encoding
    names; empty where the bag holds none. type_hash: RIHS01 hash, empty if unknown.
    """

    where: str
    type_name: str
    encoding: str
    definition: bytes
    schema_encoding: str
    type_hash: str


class MessageReader:
    """Decodes the messages of one topic. Raises BagError, also when made, where that cannot be."""

    def __init__(self, form: MessageForm) -> None:
        self._form = form
        if form.encoding != "cdr":
            raise BagError(
                f"{form.where}: its messages are in {form.encoding or 'no encoding that is named'},"
                " which is not read; give the bag as ROS 2 recorded it"
            )
        typestore = _typestore(
            form.type_name, form.definition, form.schema_encoding, form.type_hash
        )
        if typestore is None:
            raise BagError(
                f"{form.where}: the bag holds no definition of {form.type_name} that is understood,"
                " and none with its hash is installed; record it again where the type is installed"
            )
        self._typestore = typestore
        self._definition = typestore.get_msgdef(form.type_name)

    @property
    def fields(self) -> list[str]:
        """Names of the fields of a message."""
        return [name for name, _ in self._typestore.fielddefs[self._form.type_name][1]]

    def decode(self, payload: bytes) -> Any:
        """One message; fields are attributes as in ROS."""
        # Not Typestore.deserialize_cdr: it refuses the bytes that Fast CDR leaves behind a message
        # that ends in an empty sequence of doubles, as a JointState without efforts does.
        little_endian = payload[1:2] == b"\1"
        definition = self._definition
        decode = definition.deserialize_cdr_le if little_endian else definition.deserialize_cdr_be
        try:
            message, _ = decode(payload[4:], 0, definition.cls, self._typestore)
        except _NO_MESSAGE as error:
            raise self._misfit() from error
        return message

    def columns(self, payloads: list[bytes], fields: Sequence[str]) -> dict[str, np.ndarray]:
        """Fields of all messages as arrays, by dotted path; shape (n,), or (n, k) for an array."""
        form = self._form
        try:
            table = layout_of(payloads[0], form.type_name, self._typestore.fielddefs).table(
                payloads
            )
            return {name: table.column(name) for name in fields}
        except LayoutError:
            messages = [self.decode(payload) for payload in payloads]
        except KeyError as error:
            raise BagError(f"{form.where}: {form.type_name} has no field {error}") from error
        try:
            return {name: _stack([_attribute(m, name) for m in messages]) for name in fields}
        except AttributeError as error:
            raise BagError(f"{form.where}: {form.type_name} has no field '{error.name}'") from error
        except IndexError:
            raise BagError(f"{form.where}: not every message has all of {fields}") from None

    def _misfit(self) -> BagError:
        return BagError(
            f"{self._form.where}: a message does not fit the bag's definition of "
            f"{self._form.type_name}; it was written by another program, leave it out"
        )


@lru_cache(maxsize=64)
def _typestore(
    type_name: str, definition: bytes, schema_encoding: str, type_hash: str
) -> Typestore | None:
    """The types of a definition; where that is missing or not understood, those of the installed
    one if its hash is the recorded one. None where neither can be."""
    store = _registered(type_name, definition, schema_encoding)
    if store is None and (installed := _installed(type_name, type_hash)) is not None:
        store = _registered(type_name, installed, "ros2msg")
    return store


def _registered(type_name: str, definition: bytes, schema_encoding: str) -> Typestore | None:
    store = get_typestore(Stores.EMPTY)
    try:
        if schema_encoding == "ros2msg":
            store.register(get_types_from_msg(definition.decode(), type_name))
        elif schema_encoding == "ros2idl":
            for section in definition.decode().split(_SEPARATOR):
                text = section.strip()
                if text.startswith("IDL:"):
                    text = text.partition("\n")[2]
                store.register(get_types_from_idl(text))
        store.get_msgdef(type_name)
    except _NO_MESSAGE:
        return None
    return store


def _installed(type_name: str, type_hash: str) -> bytes | None:
    """Text of the installed definition with this hash; None where there is none."""
    try:
        installed = message_definition(type_name)
    except (DefinitionError, OSError):
        return None
    return installed.text.encode() if installed.type_hash == type_hash else None


def _attribute(message: Any, path: str) -> Any:
    for name in path.replace("]", "").replace("[", ".").split("."):
        message = message[int(name)] if name.isdigit() else getattr(message, name)
    return message


def _stack(values: list[Any]) -> np.ndarray:
    """One array of all values; of objects where arrays differ in length."""
    if isinstance(values[0], (int, float, bool)):
        return np.array(values)
    return np.fromiter(values, dtype=object, count=len(values))
