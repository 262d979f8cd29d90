# SPDX-License-Identifier: Apache-2.0
"""The twin as a node: what the measured carriage and crank should have done to the tow.

States are stamped with the instant of the measured sample that they belong to. They come half a
smoothing window (0.1 s at 100 Hz) after it.
"""

from __future__ import annotations

from typing import Any

from nav_msgs.msg import Odometry
from rclpy.node import Node
from sensor_msgs.msg import JointState
from towtank_interfaces.msg import CableState
from towtank_node.diagnostics import NodeDiagnostics
from towtank_node.main import run_node
from towtank_node.parameters import read_parameters
from towtank_node.qos import SENSOR_QOS
from towtank_node.senders import Senders
from towtank_node.stamps import stamp_ns
from towtank_rig import Rig, RigError, load_rig

import sim_core as sc
from towtank_sim.messages import CableStateWriter, OdometryWriter
from towtank_sim.model import ModelError
from towtank_sim.simulator_parameters import RIG, SEGMENTS, STEP
from towtank_sim.twin import Twin

_CABLE_STATE_PERIOD_NS = 50_000_000  # 20 Hz


class TwinError(RuntimeError):
    """The simulation cannot follow the measured drive."""


class TwinNode(Node):
    """Node /twin/simulator; its outputs are relative to its namespace."""

    def __init__(self) -> None:
        super().__init__("simulator", namespace="twin")
        parameters = read_parameters(self, (RIG, SEGMENTS, STEP))
        rig: Rig = load_rig(parameters.rig)
        self._twin = Twin(rig, parameters.segments, parameters.step_s)
        self._interruptions = 0
        self._cable_state_period = 0
        self._fish_odometry = OdometryWriter("fish")
        self._depressor_odometry = OdometryWriter("depressor")
        self._cable_state = CableStateWriter()
        self._publish_fish = self.create_publisher(Odometry, "fish/odometry", SENSOR_QOS).publish
        self._publish_depressor = self.create_publisher(
            Odometry, "depressor/odometry", SENSOR_QOS
        ).publish
        self._publish_cables = self.create_publisher(CableState, "cable_state", SENSOR_QOS).publish
        period = 1.0 / rig.board.sample_rate.value
        self._diagnostics = NodeDiagnostics(self, period, self._details)
        Senders(self).subscribe(JointState, "/measured/joint_states", self._follow, SENSOR_QOS)
        self._diagnostics.ready("waiting for crank and carriage")

    def _follow(self, message: JointState) -> None:
        with self._diagnostics.cycle():
            stamp = stamp_ns(message.header.stamp)
            crank_angle, carriage_position = _joints(message)
            was_running = self._twin.running
            try:
                state = self._twin.follow(stamp, crank_angle, carriage_position)
            except (sc.ConvergenceError, sc.InvalidInput) as error:
                text = f"the twin stopped at the sample of {stamp * 1e-9:.3f} s: {error}"
                self._diagnostics.fail(text)
                raise TwinError(text) from error
            if state is not None:
                self._publish(state)
        if self._twin.interruptions != self._interruptions:
            self._interruptions = self._twin.interruptions
            # No failure: what is measured goes on, and the experimenter wants it recorded.
            self._diagnostics.warn(
                f"{self._twin.interruption}: the twin begins anew, see the board and the encoder"
            )
        elif self._twin.running and not was_running:
            self._say_started()

    def _say_started(self) -> None:
        if self._interruptions == 0:
            self._diagnostics.ready("running")
        else:
            self._diagnostics.ready()
            self._diagnostics.warn(
                f"began anew after an interruption ({self._twin.interruption}): "
                "the first half minute holds the transient of a start"
            )

    def _publish(self, stamp: int) -> None:
        tow = self._twin.tow
        self._publish_fish(self._fish_odometry.body(stamp, tow.fish()))
        self._publish_depressor(self._depressor_odometry.point(stamp, tow.depressor()))
        if stamp // _CABLE_STATE_PERIOD_NS != self._cable_state_period:
            self._cable_state_period = stamp // _CABLE_STATE_PERIOD_NS
            self._publish_cables(self._cable_state.fill(stamp, tow.line_shapes()))

    def _details(self) -> dict[str, Any]:
        return {"interruptions": self._twin.interruptions}


def _joints(message: JointState) -> tuple[float, float]:
    """Crank angle (rad) and carriage position (m), wherever they stand in the message."""
    position = dict(zip(message.name, message.position, strict=False))
    try:
        return position["crank"], position["carriage"]
    except KeyError as error:
        raise TwinError(
            f"/measured/joint_states has no joint {error}: it must name crank and carriage"
        ) from error


def main() -> int:
    """Run the node until it is stopped."""
    return run_node(TwinNode, (RigError, ModelError, TwinError, sc.InvalidInput))
