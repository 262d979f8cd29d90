# SPDX-License-Identifier: Apache-2.0
"""Messages out of a subscription's queue, with the publisher that each of them came from.

rclpy keeps the publisher's identifier to itself, so that a subscriber cannot tell whose message it
has got. rcl has it: this calls rcl as rclpy does, through its C interface, which is the same for
the whole life of a ROS distribution (rcl/subscription.h, rmw/types.h, rcutils/types/uint8_array.h).
"""

from __future__ import annotations

import ctypes
import time
from dataclasses import dataclass
from typing import Any

GID_BYTES = 16
"""RMW_GID_STORAGE_SIZE; TopicEndpointInfo.endpoint_gid has as many."""

_OK, _NOTHING_THERE = 0, 401  # RCL_RET_OK, RCL_RET_SUBSCRIPTION_TAKE_FAILED
_FIRST_CAPACITY = 4096
_NO_NUMBER = 2**64 - 1  # RMW_MESSAGE_INFO_SEQUENCE_NUMBER_UNSUPPORTED


class _Allocator(ctypes.Structure):
    """rcutils_allocator_t."""

    _fields_ = (
        ("allocate", ctypes.c_void_p),
        ("deallocate", ctypes.c_void_p),
        ("reallocate", ctypes.c_void_p),
        ("zero_allocate", ctypes.c_void_p),
        ("state", ctypes.c_void_p),
    )


class _Buffer(ctypes.Structure):
    """rcutils_uint8_array_t."""

    _fields_ = (
        ("buffer", ctypes.c_void_p),
        ("length", ctypes.c_size_t),
        ("capacity", ctypes.c_size_t),
        ("allocator", _Allocator),
    )


class _Information(ctypes.Structure):
    """rmw_message_info_t, with rmw_gid_t in it."""

    _fields_ = (
        ("source_timestamp", ctypes.c_int64),
        ("received_timestamp", ctypes.c_int64),
        ("publication_sequence_number", ctypes.c_uint64),
        ("reception_sequence_number", ctypes.c_uint64),
        ("implementation", ctypes.c_char_p),
        ("publisher_gid", ctypes.c_uint8 * GID_BYTES),
        ("from_intra_process", ctypes.c_bool),
    )


@dataclass(frozen=True, slots=True)
class Taken:
    """A serialised message. Times by the system's clock, ns since the epoch; number: the
    publisher's count, None where the middleware has none; publisher: its identifier."""

    data: bytes
    received_ns: int
    published_ns: int
    number: int | None
    publisher: bytes


class Taker:
    """Takes the messages of one rclpy subscription."""

    def __init__(self, subscription: Any) -> None:
        self._subscription = subscription
        self._rcl = ctypes.CDLL("librcl.so")
        self._take = self._rcl.rcl_take_serialized_message
        self._take.argtypes = [ctypes.c_void_p] * 4
        self._rcutils = ctypes.CDLL("librcutils.so")
        self._rcutils.rcutils_get_default_allocator.restype = _Allocator
        self._information = _Information()
        self._buffer = _Buffer()
        allocator = self._rcutils.rcutils_get_default_allocator()
        status = self._rcutils.rcutils_uint8_array_init(
            ctypes.byref(self._buffer), ctypes.c_size_t(_FIRST_CAPACITY), ctypes.byref(allocator)
        )
        if status != _OK:
            raise MemoryError(f"rcutils_uint8_array_init: status {status}")

    def __del__(self) -> None:
        if self._buffer.buffer:
            self._rcutils.rcutils_uint8_array_fini(ctypes.byref(self._buffer))

    def take(self) -> Taken | None:
        """The oldest message that is waiting, or None."""
        information = self._information
        handle = self._subscription.handle
        with handle:  # keeps it alive meanwhile
            status = self._take(
                handle.pointer, ctypes.byref(self._buffer), ctypes.byref(information), None
            )
        if status == _NOTHING_THERE:
            self._rcutils.rcutils_reset_error()
            return None
        if status != _OK:
            self._rcutils.rcutils_reset_error()
            raise RuntimeError(
                f"{self._subscription.topic}: rcl_take_serialized_message: status {status}"
            )
        received_ns = information.received_timestamp or time.time_ns()
        number = information.publication_sequence_number
        return Taken(
            ctypes.string_at(self._buffer.buffer, self._buffer.length),
            received_ns,
            information.source_timestamp or received_ns,
            None if number == _NO_NUMBER else number,
            bytes(information.publisher_gid),
        )
