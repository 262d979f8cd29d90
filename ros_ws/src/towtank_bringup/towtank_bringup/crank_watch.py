# SPDX-License-Identifier: Apache-2.0
"""What a trial makes of the state of the crank's drive. No ROS in here but the message.

Until the crank runs steadily the drive is the operator's, who may stop it, clear a trip and run it
again. From then to the end of the log the run is worth nothing without it.
"""

from __future__ import annotations

import math
import time

from towtank_daq.board import TRIP_ADVICE
from towtank_interfaces.msg import CrankDrive

_TRIPS = {
    CrankDrive.EMERGENCY_STOP: "emergency_stop",
    CrankDrive.OVERSPEED: "overspeed",
    CrankDrive.STALL: "stall",
    CrankDrive.HOST_SILENCE: "host_silence",
    CrankDrive.ENCODER: "encoder",
    CrankDrive.OVERLOAD: "overload",
    CrankDrive.RUNAWAY: "runaway",
}
_RPM = 2.0 * math.pi / 60.0


class CrankWatch:
    """Follows the drive's states; `fault` tells why a trial cannot go on."""

    def __init__(self) -> None:
        self._state: CrankDrive | None = None
        self._held: CrankDrive | None = None
        self._tolerance = 0.0
        self._heard_s = -math.inf

    def take(self, state: CrankDrive) -> str:
        """Take the drive's next state in. Returns what the operator should know of it, or ''."""
        trip_before = self._state.trip if self._state else CrankDrive.NONE
        self._state, self._heard_s = state, time.monotonic()
        if state.trip in (CrankDrive.NONE, trip_before):
            return ""
        return f"the crank's drive has tripped: {self._trip_words()}"

    @property
    def turns(self) -> bool:
        """Whether the drive turns the crank, as far as it has told."""
        return self._state is not None and self._state.state in (
            CrankDrive.RUNNING,
            CrankDrive.STOPPING,
        )

    @property
    def silence_s(self) -> float:
        """How long the drive has told nothing, s; of one that turns it tells ten times a second."""
        return time.monotonic() - self._heard_s

    def hold(self, tolerance: float) -> None:
        """From now on the drive must keep the crank running at its present speed.

        tolerance: fraction of it. A crank that something else drives is not judged, but a trip is.
        """
        self._held = self._state
        self._tolerance = tolerance

    def release(self) -> None:
        """The crank may do what it likes."""
        self._held = None

    def fault(self) -> str:
        """Why the crank does not run any more as it should, in words; '' if it does."""
        held, state = self._held, self._state
        if held is None or state is None:
            return ""
        if state.trip not in (CrankDrive.NONE, held.trip):
            if state.trip == CrankDrive.EMERGENCY_STOP:
                return "the crank was stopped from outside: emergency stop"
            return f"the crank's drive has tripped: {self._trip_words()}"
        if held.state not in (CrankDrive.RUNNING, CrankDrive.STOPPING):
            return ""
        if state.state != CrankDrive.RUNNING:
            return "the crank was stopped from outside"
        if abs(state.target_rate - held.target_rate) > self._tolerance * abs(held.target_rate):
            return (
                f"the crank was set from {held.target_rate / _RPM:.3g} to "
                f"{state.target_rate / _RPM:.3g} rpm from outside"
            )
        return ""

    def _trip_words(self) -> str:
        name = _TRIPS.get(self._state.trip, f"trip {self._state.trip}")
        advice = TRIP_ADVICE.get(name, "look at the drive, then clear the trip")
        return f"{name.replace('_', ' ')}: {advice} (`towtank crank clear`)"
