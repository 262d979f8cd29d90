# SPDX-License-Identifier: Apache-2.0
"""Node of the crank's drive: a service to set it, a topic for its state.

It lives in the process of the board's node, whose serial thread is the only user of the driver:
that thread serves the requests (crank_drive.py) and publishes the states as they come. The drive
can be set while the board's node is active, and stopped as long as its board is connected.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import TimeoutError as NotInTime

from towtank_interfaces.msg import CrankDrive as CrankDriveMessage
from towtank_interfaces.srv import SetCrankSpeed
from towtank_node.crank_node import CrankNode
from towtank_node.diagnostics import NodeDiagnostics
from towtank_node.endpoints import publisher, server
from towtank_node.names import CRANK_DRIVE_FRAME, CRANK_DRIVE_NODE, split_name
from towtank_node.services import CRANK_SPEED
from towtank_node.topics import CRANK_DRIVE_STATE
from towtank_node.trial_clock import TrialClock

from towtank_daq.board import TRIP_ADVICE, BoardError, DriveState
from towtank_daq.crank_drive import RPM, CrankDrive
from towtank_daq.description import BoardDescription

_ANSWER_S = 2.0
_PERIOD_S = 0.1  # of the board's frames while the crank turns
_STOPS = ("stop", "emergency_stop")
_ACTIONS = {
    SetCrankSpeed.Request.STOP: "stop",
    SetCrankSpeed.Request.RUN: "run",
    SetCrankSpeed.Request.EMERGENCY_STOP: "emergency_stop",
    SetCrankSpeed.Request.CLEAR_TRIP: "clear_trip",
}


class CrankDriveNode(CrankNode):
    """The drive of the board that the process has.

    stop_between_runs: called, from any thread, with a stop of board.yaml's `drive_action` while
    there is no drive to attend to; returns why the crank was not stopped, '' if it was, None if
    there is a drive by now.
    """

    def __init__(
        self,
        board: BoardDescription,
        clock: TrialClock,
        stop_between_runs: Callable[[str], str | None],
    ) -> None:
        # The process's name and parameters are those of the board's node
        namespace, name = split_name(CRANK_DRIVE_NODE)
        super().__init__(name, namespace=namespace, use_global_arguments=False)
        self._board = board
        self._trial_clock = clock
        self._stop_between_runs = stop_between_runs
        self._drive: CrankDrive | None = None
        self._trip = "none"
        self._message = CrankDriveMessage()
        self._message.header.frame_id = CRANK_DRIVE_FRAME
        self._publisher = publisher(self, CRANK_DRIVE_STATE.of("~"))
        server(self, CRANK_SPEED.of("~"), self._on_set_speed)
        self.diagnostics = NodeDiagnostics(self, _PERIOD_S, lambda: {"trip": self._trip}, clock)
        self.diagnostics.ready()
        self.heed(lambda: self._ask("emergency_stop"))

    def attend(self, drive: CrankDrive | None) -> None:
        """Pass the service's requests to a drive from now on, or refuse them."""
        self._drive = drive

    def publish(self, state: DriveState) -> None:
        """Publish what the board has told, and report a trip. From the serial thread."""
        message = self._message
        self._trial_clock.stamp(message.header.stamp)
        message.state = self._board.drive_state.get(state.state, 255)
        message.trip = self._board.drive_trip.get(state.trip, 255)
        message.target_rate = state.target_rpm * RPM
        message.setpoint_rate = state.setpoint_rpm * RPM
        message.crank_rate = state.speed_rpm * RPM
        message.duty = state.duty
        message.emergency_stop_closed = state.emergency_stop_closed
        self._publisher.publish(message)
        trip = state.trip
        if trip == "none" and self._drive is not None:
            # A board that was reset has forgotten it; nobody has cleared it
            trip = self._drive.trip
        if trip != self._trip:
            self._trip = trip
            if trip == "none":
                self.diagnostics.ready()
            else:
                advice = TRIP_ADVICE.get(trip, "look at the drive, then clear the trip")
                self.get_logger().error(f"{trip.replace('_', ' ')}: {advice}")
                self.diagnostics.fail(f"{trip.replace('_', ' ')}: {advice}")

    def _on_set_speed(
        self, request: SetCrankSpeed.Request, response: SetCrankSpeed.Response
    ) -> SetCrankSpeed.Response:
        action = _ACTIONS.get(request.action)
        if action is None:
            response.message = f"no action {request.action}: give one of SetCrankSpeed's constants"
        else:
            response.message = self._ask(action, request.crank_rate)
            response.success = not response.message
        return response

    def _ask(self, action: str, crank_rate: float = 0.0) -> str:
        """Have the drive do it. Returns why it has not, or ''."""
        if self._drive is None and action in _STOPS:
            why_not = self._stop_between_runs(action)
            if why_not is not None:
                return why_not
        drive = self._drive
        if drive is None:
            return "the board's node is not active: activate it first"
        asked = drive.ask(action, crank_rate)
        try:
            asked.result(_ANSWER_S)
        except NotInTime:
            if action == "run":
                drive.take_back(asked)  # a crank that starts late would surprise
            return f"no answer within {_ANSWER_S:g} s: is the board still there?"
        except (BoardError, OSError) as error:
            return str(error)
        return ""
