# SPDX-License-Identifier: Apache-2.0
"""The twin as a node: what the measured carriage and crank should have done to the tow.

States are stamped with the instant of the measured sample that they belong to. They come half a
smoothing window (0.1 s at 100 Hz) after it.
"""

from __future__ import annotations

from typing import Any

from rclpy.node import Node
from sensor_msgs.msg import JointState
from towtank_node import names, topics
from towtank_node.diagnostics import NodeDiagnostics
from towtank_node.endpoints import publisher
from towtank_node.main import run_node
from towtank_node.parameters import read_parameters
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
    """Node /twin/simulator."""

    def __init__(self) -> None:
        namespace, name = names.split_name(names.TWIN_NODE)
        super().__init__(name, namespace=namespace)
        parameters = read_parameters(self, (RIG, SEGMENTS, STEP))
        rig: Rig = load_rig(parameters.rig)
        self._twin = Twin(rig, parameters.segments, parameters.step_s)
        self._interruptions = 0
        self._cable_state_period = 0
        self._fish_odometry = OdometryWriter(names.FISH)
        self._depressor_odometry = OdometryWriter(names.DEPRESSOR)
        self._cable_state = CableStateWriter()
        self._publish_fish = publisher(self, topics.TWIN_FISH).publish
        self._publish_depressor = publisher(self, topics.TWIN_DEPRESSOR).publish
        self._publish_cables = publisher(self, topics.TWIN_CABLES).publish
        period = 1.0 / rig.board.sample_rate.value
        self._diagnostics = NodeDiagnostics(self, period, self._details)
        Senders(self).subscribe(topics.MEASURED_JOINTS, self._follow)
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
        return position[names.CRANK_JOINT], position[names.CARRIAGE_JOINT]
    except KeyError as error:
        raise TwinError(
            f"{topics.MEASURED_JOINTS.name} has no joint {error}: it must name "
            f"{names.CRANK_JOINT} and {names.CARRIAGE_JOINT}"
        ) from error


def main() -> int:
    """Run the node until it is stopped."""
    return run_node(TwinNode, (RigError, ModelError, TwinError, sc.InvalidInput))
