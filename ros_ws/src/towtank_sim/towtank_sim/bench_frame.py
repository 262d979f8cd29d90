# SPDX-License-Identifier: Apache-2.0
"""Bytes of a bench frame, laid out by the board's description (board.yaml)."""

from __future__ import annotations

import re
import struct
from collections.abc import Sequence

from towtank_sim.board_file import board_file

_CODES = {"u8": "B", "u16": "H", "u32": "I", "i32": "i", "u64": "Q", "i64": "q", "f64": "d"}


class BenchFrameError(ValueError):
    """The board's description has another bench frame or channel map than this package knows."""


class BenchFrameLayout:
    """Packs what the board's terminals see at one instant.

    channels: names of the board's channels in the order of terminal_volts.
    """

    _FIELDS = (
        "magic",
        "sequence",
        "time_ns",
        "terminal_volts",
        "crank_angle_rad",
        "carriage_angle_rad",
    )

    def __init__(self) -> None:
        description = board_file()
        bench = description["bench"]
        names = tuple(name for name, _ in bench["fields"])
        if names != self._FIELDS:
            raise BenchFrameError(
                f"board.yaml: bench.fields are {', '.join(names)}: "
                f"adapt towtank_sim.bench_frame, which packs {', '.join(self._FIELDS)}"
            )
        self.channels: tuple[str, ...] = tuple(c["name"] for c in description["channels"])
        self._magic: int = bench["magic"]
        self._struct = struct.Struct("<" + "".join(_format(kind) for _, kind in bench["fields"]))

    def pack(
        self,
        sequence: int,
        time_ns: int,
        terminal_volts: Sequence[float],
        crank_angle: float,
        carriage_angle: float,
    ) -> bytes:
        """Return the frame's bytes.

        sequence: number of the frame, modulo 2^32; time_ns: CLOCK_MONOTONIC, or time since the
        start of a deterministic board; terminal_volts: V, in channel order; angles: rad.
        """
        return self._struct.pack(
            self._magic,
            sequence & 0xFFFFFFFF,
            time_ns,
            *terminal_volts,
            crank_angle,
            carriage_angle,
        )


def _format(kind: str) -> str:
    """struct's code for a field type such as `u32` or `f64[6]`."""
    scalar, count = re.fullmatch(r"(\w+)(?:\[(\d+)\])?", kind).groups(default="")
    return count + _CODES[scalar]
