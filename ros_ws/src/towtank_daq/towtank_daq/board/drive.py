# SPDX-License-Identifier: Apache-2.0
"""Orders to the crank's drive, and how it says that it is."""

from __future__ import annotations

from dataclasses import dataclass

from towtank_daq.board.advice import TRIP_ADVICE
from towtank_daq.board.errors import BoardError, Refused
from towtank_daq.board.link import ANSWER_TIMEOUT_S, Link
from towtank_daq.clock import BoardClock, unwrap
from towtank_daq.description import BoardDescription
from towtank_daq.protocol_records import DriveArguments, DriveFrame, drive

_KNOWS_ENCODER = ("run", "watch")
_STOPS = ("stop", "emergency_stop")
"""Actions that are sent also to a board that is not heard: it may hear them."""


@dataclass(frozen=True, slots=True)
class DriveState:
    """How the crank's drive is. Names of state and trip are those of board.yaml."""

    ticks: int
    """Board time, unwrapped."""
    state: str
    trip: str
    target_rpm: float
    setpoint_rpm: float
    """On its ramp to the target."""
    speed_rpm: float
    """Of the crank, measured."""
    duty: float
    """Of the PWM, 0 to 1."""
    emergency_stop_closed: bool


class Drive:
    """The drive of one board, by requests."""

    def __init__(self, link: Link, board: BoardDescription) -> None:
        self._link = link
        self._board = board
        self.state: DriveState | None = None
        """As told last; None since a reset of the board."""

    def ask(self, action: str, speed_rpm: float, counts_per_revolution: int) -> None:
        """AdcBoard.drive."""
        limits = self._board.drive.speed_rpm
        if action == "run" and not limits.minimum <= speed_rpm <= limits.maximum:
            raise BoardError(
                f"the crank cannot be driven at {speed_rpm:g} rpm: give {limits.minimum:g} to "
                f"{limits.maximum:g} rpm"
            )
        if action in _KNOWS_ENCODER and not 512 <= abs(counts_per_revolution) < 2**15:
            raise BoardError(
                f"the drive cannot be led by an encoder of {abs(counts_per_revolution)} counts a "
                "revolution: use one of 512 to 32767"
            )
        arguments = DriveArguments(
            action=self._board.drive_action[action],
            speed=round(100 * speed_rpm),
            counts_per_revolution=counts_per_revolution,
        )
        try:
            self._link.command(drive(arguments), blind=action in _STOPS)
        except Refused as error:
            if error.status != "drive_tripped":
                raise
            until_ns = self._link.now_ns() + round(1e9 * ANSWER_TIMEOUT_S)
            self._link.wait(until_ns, lambda: self._trip != "none")
            advice = TRIP_ADVICE.get(self._trip, "look at the drive, then clear the trip")
            raise BoardError(
                f"the drive is stopped ({self._trip.replace('_', ' ')}): {advice}"
            ) from error

    @property
    def _trip(self) -> str:
        return self.state.trip if self.state is not None else "none"

    def take(self, record: DriveFrame, received_ns: int, clock: BoardClock) -> DriveState:
        """What a frame of the drive says."""
        # Before the clock is known, the low half as it came
        near = clock.ticks(received_ns) if clock.points else record.ticks
        self.state = DriveState(
            ticks=unwrap(record.ticks, 32, near),
            state=name_of(self._board.drive_state, record.state),
            trip=name_of(self._board.drive_trip, record.trip),
            target_rpm=record.target / 100,
            setpoint_rpm=record.setpoint / 100,
            speed_rpm=record.speed / 100,
            duty=record.duty / 10_000,
            emergency_stop_closed=bool(record.emergency_stop_closed),
        )
        return self.state


def name_of(names: dict[str, int], number: int) -> str:
    """What board.yaml calls a number."""
    return next((name for name, value in names.items() if value == number), f"number {number}")
