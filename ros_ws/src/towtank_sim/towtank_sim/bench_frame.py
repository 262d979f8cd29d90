# SPDX-License-Identifier: Apache-2.0
"""What the board's terminals see at one instant, as the bytes that its bench socket takes."""

from __future__ import annotations

from collections.abc import Iterable

from towtank_sim.protocol_records import BENCH_MAGIC, BenchFrame


def bench_frame(
    sequence: int,
    time_ns: int,
    terminal_volts: Iterable[float],
    crank_angle: float,
    carriage_angle: float,
) -> bytes:
    """Return the frame's bytes.

    sequence: number of the frame, modulo 2^32; time_ns: CLOCK_MONOTONIC, or time since the
    start of a deterministic board; terminal_volts: V, in channel order; angles: rad.
    Raises RecordError for another number of volts than the board has channels.
    """
    return BenchFrame(
        magic=BENCH_MAGIC,
        sequence=sequence & 0xFFFFFFFF,
        time_ns=time_ns,
        terminal_volts=tuple(terminal_volts),
        crank_angle_rad=crank_angle,
        carriage_angle_rad=carriage_angle,
    ).pack()
