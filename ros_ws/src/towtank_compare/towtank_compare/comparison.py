# SPDX-License-Identifier: Apache-2.0
"""The comparison node: heave ratio of measurement and twin over the last seconds, at 2 Hz."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable
from functools import partial
from typing import Any

# Before NumPy loads: on matrices this small OpenBLAS's threads do nothing but wait busily for each
# other, which makes a node of 6 % of a core one of 27 %.
os.environ["OPENBLAS_NUM_THREADS"] = "1"

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point
from nav_msgs.msg import Odometry
from rclpy.node import Node
from sensor_msgs.msg import JointState
from towtank_interfaces.msg import Depth, HeaveRatio
from towtank_node import topics
from towtank_node.diagnostics import NodeDiagnostics
from towtank_node.endpoints import publisher
from towtank_node.main import run_node
from towtank_node.names import (
    BODIES,
    COMPARISON_NODE,
    CRANK_JOINT,
    MEASURED,
    TANK_FRAME,
    TWIN,
    split_name,
)
from towtank_node.parameters import Parameter, read_parameters
from towtank_node.polling import PolledSubscription
from towtank_node.senders import Senders
from towtank_node.stamps import stamp_ns
from towtank_node.timers import create_steady_timer
from towtank_rig import RigError, load_rig

from towtank_compare.heave import NS_PER_MS
from towtank_compare.live import Evaluation, LiveHeave
from towtank_compare.places import pressure_port

POLL_PERIOD_S = 0.1
"""Ten samples of each topic: a fifth of what their queues hold."""

POLLS_PER_EVALUATION = 5

PARAMETERS = (
    Parameter("rig", str, "path of the rig file"),
    Parameter(
        "window_s",
        float,
        "length of the window that is evaluated, s",
        default=10.0,
        minimum=1.0,
        maximum=600.0,
    ),
)


class Comparison(Node):
    """Shell around LiveHeave."""

    def __init__(self) -> None:
        super().__init__(split_name(COMPARISON_NODE)[1])
        parameters = read_parameters(self, PARAMETERS)
        rig = load_rig(parameters.rig)
        self._place = pressure_port(rig)
        self._live = LiveHeave(rig, parameters.window_s)
        self._ratio_publishers = {
            source: publisher(self, topics.HEAVE_RATIO.within(source))
            for source in (MEASURED, TWIN)
        }
        self._senders = Senders(self)
        self._inputs: list[tuple[PolledSubscription, Callable[[Any], None]]] = [
            (self._subscribe(topics.MEASURED_JOINTS), self._take_crank),
            *(
                (self._subscribe(topic.within(source, body)), partial(take, body))
                for source, topic, take in (
                    (MEASURED, topics.DEPTH, self._take_depth),
                    (TWIN, topics.ODOMETRY, self._take_pose),
                )
                for body in BODIES
            ),
        ]
        self._polls = 0
        self._diagnostics = NodeDiagnostics(self, POLL_PERIOD_S, self._counters)
        create_steady_timer(self, POLL_PERIOD_S, self._poll)
        self._diagnostics.ready("comparing")

    def _subscribe(self, topic: topics.Topic) -> PolledSubscription:
        return PolledSubscription(self, topic, self._senders)

    def _poll(self) -> None:
        with self._diagnostics.cycle():
            for subscription, take in self._inputs:
                for received in subscription.take():
                    take(received.message)
            self._polls += 1
            if self._polls % POLLS_PER_EVALUATION == 0:
                for evaluation in self._live.evaluate():
                    self._ratio_publishers[evaluation.source].publish(self._message(evaluation))

    def _take_crank(self, message: JointState) -> None:
        if CRANK_JOINT in message.name:
            angle = message.position[message.name.index(CRANK_JOINT)]
            self._live.add_crank(stamp_ns(message.header.stamp), angle)

    def _take_depth(self, body: str, message: Depth) -> None:
        self._live.add_depth(
            body,
            stamp_ns(message.header.stamp),
            message.depth,
            message.valid,
            message.zero_depth,
        )

    def _take_pose(self, body: str, message: Odometry) -> None:
        pose = message.pose.pose
        turn = pose.orientation
        quaternion = (turn.x, turn.y, turn.z, turn.w)
        self._live.add_pose(body, stamp_ns(message.header.stamp), pose.position.z, quaternion)

    def _message(self, evaluation: Evaluation) -> HeaveRatio:
        nothing = math.nan
        message = HeaveRatio(
            source=evaluation.source,
            window_start=_time(evaluation.t0_ms),
            window_end=_time(evaluation.t1_ms),
            valid=evaluation.result is not None,
            reason=evaluation.reason,
            value=nothing,
            u95=nothing,
            phase=nothing,
            fish_amplitude=nothing,
            fish_amplitude_u95=nothing,
            depressor_amplitude=nothing,
            depressor_amplitude_u95=nothing,
            crank_frequency=nothing,
            fish_place=self._place.name,
            fish_position=Point(**dict(zip("xyz", self._place.position, strict=True))),
        )
        message.header.stamp = message.window_end
        message.header.frame_id = TANK_FRAME
        result = evaluation.result
        if result is not None:
            message.value = result.ratio
            message.phase = result.phase
            message.fish_amplitude = result.fish.amplitude
            message.depressor_amplitude = result.depressor.amplitude
            message.crank_frequency = result.crank_frequency_hz
            if result.u95 is not None:
                message.u95 = result.u95
                message.fish_amplitude_u95 = result.fish.uncertainty.u95
                message.depressor_amplitude_u95 = result.depressor.uncertainty.u95
        return message

    def _counters(self) -> dict[str, Any]:
        return {"lost_in_transport": sum(polled.lost for polled, _ in self._inputs)}


def _time(milliseconds: int) -> Time:
    seconds, rest = divmod(milliseconds, 1000)
    return Time(sec=seconds, nanosec=rest * NS_PER_MS)


def main() -> None:
    """Run the node until it is told to end."""
    sys.exit(run_node(Comparison, (RigError,)))


if __name__ == "__main__":
    main()
