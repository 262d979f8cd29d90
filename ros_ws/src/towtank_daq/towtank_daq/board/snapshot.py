# SPDX-License-Identifier: Apache-2.0
"""How driver and board are at an instant."""

from __future__ import annotations

from dataclasses import dataclass

from towtank_daq.board.drive import DriveState
from towtank_daq.board.recovery import State
from towtank_daq.board.stream import Statistics
from towtank_daq.configuration import Configuration
from towtank_daq.protocol_records import HealthFrame, IdentifyResponse


@dataclass(frozen=True, slots=True)
class Snapshot:
    """How driver and board are at an instant."""

    state: State
    why: str
    """Why the stream must be started again, if it must."""
    streaming: bool
    silence_s: float
    """How long has been waited for a good frame since the last one."""
    count_epoch: int
    boot_count: int | None
    configuration: Configuration
    """In force, or to be set when the board is started again."""
    statistics: Statistics
    identity: IdentifyResponse | None
    health: HealthFrame | None
    drive: DriveState | None
