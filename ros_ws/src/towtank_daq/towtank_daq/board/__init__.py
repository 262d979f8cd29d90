# SPDX-License-Identifier: Apache-2.0
"""The driver of the ADC board; `board.AdcBoard` says what it does."""

from towtank_daq.board.advice import TRIP_ADVICE
from towtank_daq.board.board import AdcBoard
from towtank_daq.board.drive import DriveState
from towtank_daq.board.errors import BoardError, NoAnswer, Refused
from towtank_daq.board.link import CONNECT_TIMEOUT_S, Transport
from towtank_daq.board.recovery import State
from towtank_daq.board.snapshot import Snapshot
from towtank_daq.board.stream import Scan, Statistics

__all__ = [
    "CONNECT_TIMEOUT_S",
    "TRIP_ADVICE",
    "AdcBoard",
    "BoardError",
    "DriveState",
    "NoAnswer",
    "Refused",
    "Scan",
    "Snapshot",
    "State",
    "Statistics",
    "Transport",
]
