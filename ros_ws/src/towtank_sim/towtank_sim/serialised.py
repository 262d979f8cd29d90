# SPDX-License-Identifier: Apache-2.0
"""The few numbers that the bench needs, read from serialised messages.

Making a whole Odometry in Python, covariances and all, costs more than everything that the bench
does with it. Messages come in CDR (OMG, Common Data Representation, version 1): after four bytes of
encapsulation each number stands at a multiple of its own size; a string is its length with the
closing zero (u32), then its bytes.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

from towtank_sim.axes import Quaternion, Vector

_HEADER = 4  # bytes of encapsulation; alignment counts from behind them
_LITTLE_ENDIAN = 1
_STAMP = struct.Struct("<iI")
_LENGTH = struct.Struct("<I")
_COVARIANCE_6 = 36 * 8  # bytes
_COVARIANCE_3 = 9 * 8


class SerialisedError(ValueError):
    """A message that is not serialised as this module reads it."""


class OdometryFields(NamedTuple):
    """Pose and twist of a nav_msgs/Odometry, without covariances; stamp in ns."""

    stamp: int
    position: Vector
    quaternion: Quaternion
    linear: Vector
    angular: Vector


class ImuFields(NamedTuple):
    """Linear acceleration of a sensor_msgs/Imu; stamp in ns."""

    stamp: int
    linear_acceleration: Vector


class JointFields(NamedTuple):
    """Positions of a sensor_msgs/JointState by joint; stamp in ns."""

    stamp: int
    position: dict[str, float]


def read_odometry(data: bytes) -> OdometryFields:
    reader = _Reader(data)
    stamp = reader.header()
    reader.string()  # child_frame_id
    x, y, z, qx, qy, qz, qw = reader.doubles(7)
    reader.skip(_COVARIANCE_6)
    twist = reader.doubles(6)
    return OdometryFields(stamp, (x, y, z), (qw, qx, qy, qz), twist[:3], twist[3:])


def read_imu(data: bytes) -> ImuFields:
    reader = _Reader(data)
    stamp = reader.header()
    reader.doubles(4)  # orientation
    reader.skip(_COVARIANCE_3)
    reader.doubles(3)  # angular velocity
    reader.skip(_COVARIANCE_3)
    return ImuFields(stamp, reader.doubles(3))


def read_joints(data: bytes) -> JointFields:
    reader = _Reader(data)
    stamp = reader.header()
    names = [reader.string() for _ in range(reader.length())]
    positions = reader.doubles(reader.length())
    return JointFields(stamp, dict(zip(names, positions, strict=False)))


class _Reader:
    def __init__(self, data: bytes) -> None:
        if len(data) < _HEADER or data[1] != _LITTLE_ENDIAN:
            raise SerialisedError("a message is not in little-endian CDR: use the same middleware")
        self._data = data
        self._at = _HEADER

    def _align(self, size: int) -> None:
        self._at += -(self._at - _HEADER) % size

    def header(self) -> int:
        """Read a std_msgs/Header; returns its stamp in ns."""
        seconds, nanoseconds = _STAMP.unpack_from(self._data, self._at)
        self._at += _STAMP.size
        self.string()  # frame_id
        return seconds * 1_000_000_000 + nanoseconds

    def length(self) -> int:
        self._align(_LENGTH.size)
        (length,) = _LENGTH.unpack_from(self._data, self._at)
        self._at += _LENGTH.size
        return length

    def string(self) -> str:
        length = self.length()
        text = self._data[self._at : self._at + length - 1]
        self._at += length
        return text.decode()

    def doubles(self, count: int) -> tuple[float, ...]:
        if count == 0:
            return ()  # an empty sequence is not even aligned
        self._align(8)
        values = struct.unpack_from(f"<{count}d", self._data, self._at)
        self._at += 8 * count
        return values

    def skip(self, size: int) -> None:
        """Pass over so many bytes of doubles."""
        self._at += size
