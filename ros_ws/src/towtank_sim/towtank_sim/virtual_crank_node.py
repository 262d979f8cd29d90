# SPDX-License-Identifier: Apache-2.0
"""Node of the virtual crank's drive: service, topic and meanings are those of the board's.

It lives in the plant's process. What it is told holds from the plant's present state on, which lies
`lead_s` ahead: the encoder shows it so much later.
"""

from __future__ import annotations

import math
import queue
from concurrent.futures import Future
from concurrent.futures import TimeoutError as NotInTime

from towtank_interfaces.msg import CrankDrive
from towtank_interfaces.srv import SetCrankSpeed
from towtank_node.crank_node import CrankNode
from towtank_node.diagnostics import NodeDiagnostics
from towtank_node.endpoints import publisher, server
from towtank_node.names import CRANK_DRIVE_FRAME, CRANK_DRIVE_NODE, split_name
from towtank_node.services import CRANK_SPEED
from towtank_node.stamps import set_stamp
from towtank_node.topics import CRANK_DRIVE_STATE
from towtank_node.trial_clock import TrialClock

from towtank_sim.board_file import board_file
from towtank_sim.drive import DriveError
from towtank_sim.plant import Plant
from towtank_sim.virtual_crank import CrankStatus

_TURNING_NS = 100_000_000
_STANDING_NS = 1_000_000_000
_ANSWER_S = 2.0


class VirtualCrankNode(CrankNode):
    """Node /measured/crank_drive of a trial on the virtual tank."""

    def __init__(self, plant: Plant, clock: TrialClock) -> None:
        # The process's name and parameters are those of the plant's node
        namespace, name = split_name(CRANK_DRIVE_NODE)
        super().__init__(name, namespace=namespace, use_global_arguments=False)
        self._plant = plant
        self._states = board_file()["drive_state"]
        self._trips = board_file()["drive_trip"]
        self._told: CrankStatus | None = None
        self._told_ns = 0
        # An ideal motor has no duty, and no emergency-stop loop that could be open
        self._message = CrankDrive(duty=math.nan, emergency_stop_closed=True)
        self._message.header.frame_id = CRANK_DRIVE_FRAME
        self._publisher = publisher(self, CRANK_DRIVE_STATE.of("~"))
        server(self, CRANK_SPEED.of("~"), self._on_set_speed)
        self._diagnostics = NodeDiagnostics(
            self, _TURNING_NS * 1e-9, lambda: {"trip": self._status().trip}, clock
        )
        self._diagnostics.ready()
        self._stops: queue.SimpleQueue[Future[None]] = queue.SimpleQueue()
        self.heed(self._stop_quickly)

    def _stop_quickly(self) -> str:
        """From the quick stop's thread: the plant's own does it, at its next state."""
        done: Future[None] = Future()
        self._stops.put(done)
        try:
            done.result(_ANSWER_S)
        except NotInTime:
            return f"the plant does not answer within {_ANSWER_S:g} s"
        return ""

    def _status(self) -> CrankStatus:
        return self._plant.crank.status(self._plant.time)

    def publish(self, stamp: int) -> None:
        """Publish the state if it is due; stamp: of the plant's state, ns since the epoch."""
        while not self._stops.empty():
            self._plant.crank.emergency_stop(self._plant.time)
            self._stops.get().set_result(None)
        status, told = self._status(), self._told
        changed = told is None or (status.state, status.trip, status.target_rate) != (
            told.state,
            told.trip,
            told.target_rate,
        )
        period_ns = _TURNING_NS if status.state in ("running", "stopping") else _STANDING_NS
        if not changed and self._plant.time_ns - self._told_ns < period_ns:
            return
        if told is not None and status.trip != told.trip:
            self._report(status.trip)
        self._told, self._told_ns = status, self._plant.time_ns
        message = self._message
        set_stamp(message.header.stamp, stamp)
        message.state = self._states[status.state]
        message.trip = self._trips[status.trip]
        message.target_rate = status.target_rate
        message.setpoint_rate = message.crank_rate = status.rate
        self._publisher.publish(message)

    def _report(self, trip: str) -> None:
        if trip == "none":
            self._diagnostics.ready()
        else:
            words = f"{trip.replace('_', ' ')}: clear the trip"
            self.get_logger().error(words)
            self._diagnostics.fail(words)

    def _on_set_speed(
        self, request: SetCrankSpeed.Request, response: SetCrankSpeed.Response
    ) -> SetCrankSpeed.Response:
        crank, now = self._plant.crank, self._plant.time
        try:
            if request.action == SetCrankSpeed.Request.RUN:
                crank.run(now, request.crank_rate)
            elif request.action == SetCrankSpeed.Request.STOP:
                crank.stop(now)
            elif request.action == SetCrankSpeed.Request.EMERGENCY_STOP:
                crank.emergency_stop(now)
            elif request.action == SetCrankSpeed.Request.CLEAR_TRIP:
                crank.clear_trip()
            else:
                raise DriveError(
                    f"no action {request.action}: give one of SetCrankSpeed's constants"
                )
        except DriveError as error:
            response.message = str(error)
        else:
            response.success = True
        return response
