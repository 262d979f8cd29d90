# SPDX-License-Identifier: Apache-2.0
"""The virtual bench as a node: plant states in, bench frames to the virtual board out."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from towtank_node import topics
from towtank_node.diagnostics import NodeDiagnostics
from towtank_node.main import run_node
from towtank_node.names import BENCH_NODE, CARRIAGE_JOINT, CRANK_JOINT, split_name
from towtank_node.parameters import Parameter, read_parameters
from towtank_node.senders import Senders
from towtank_node.timers import create_steady_timer
from towtank_node.trial_clock import TrialClock
from towtank_rig import RigError, load_rig
from towtank_uncertainty import sensor_errors

from towtank_sim.bench import Bench, BenchError, TrueState
from towtank_sim.bench_frame import bench_frame
from towtank_sim.bench_socket import BenchSocket
from towtank_sim.matching import StampMatcher
from towtank_sim.plant import CYCLE_NS
from towtank_sim.protocol_records import CHANNELS
from towtank_sim.serialised import (
    ImuFields,
    JointFields,
    OdometryFields,
    SerialisedError,
    read_imu,
    read_joints,
    read_odometry,
)
from towtank_sim.simulator_parameters import RIG
from towtank_sim.terminal_faults import FaultError, parse_faults

_PARAMETERS = (
    RIG,
    Parameter("socket", str, "path of the virtual board's bench socket"),
    Parameter("seed", int, "seed of the sensors' errors", default=1, minimum=0, maximum=2**31 - 1),
    Parameter(
        "noise",
        str,
        "errors of the sensors: drawn from the rig's budget, or none",
        default="rig",
        choices=("rig", "none"),
    ),
    Parameter(
        "sensor_faults",
        str,
        "faults of sensors and wires, as towtank_sim/terminal_faults.py has them",
        default="",
    ),
)
_SILENCE_S = 1.0
_SENDING = "sending frames"


class BenchNode(Node):
    """Node /plant/bench."""

    def __init__(self) -> None:
        namespace, name = split_name(BENCH_NODE)
        super().__init__(name, namespace=namespace)
        parameters = read_parameters(self, _PARAMETERS)
        rig = load_rig(parameters.rig)
        errors = (
            sensor_errors.none(rig)
            if parameters.noise == "none"
            else sensor_errors.draw(rig, parameters.seed)
        )
        faults = parse_faults(parameters.sensor_faults)
        self._bench = Bench(rig, errors, CHANNELS, faults)
        self._socket = BenchSocket(parameters.socket)
        self._ros_minus_monotonic = TrialClock(self).offset_ns
        self._first_stamp: int | None = None
        self._frames = 0
        self._frames_at_last_look = 0
        self._silent = False
        self._diagnostics = NodeDiagnostics(self, CYCLE_NS * 1e-9, self._details)
        inputs = (
            (topics.PLANT_JOINTS, read_joints),
            (topics.PLANT_DEPRESSOR, read_odometry),
            (topics.PLANT_IMU, read_imu),
            (topics.PLANT_FISH, read_odometry),
        )
        self._matcher = StampMatcher(topics=len(inputs))
        senders = Senders(self)
        for number, (topic, read) in enumerate(inputs):
            senders.subscribe(topic, self._receiver(number, read), raw=True)
        create_steady_timer(self, _SILENCE_S, self._look_for_silence)

    def close(self) -> None:
        """Give the socket back."""
        self._socket.close()

    def _receiver(self, topic: int, read: Callable[[bytes], Any]) -> Callable[[bytes], None]:
        """The callback of one topic, number `topic` in the order of _send's arguments."""

        def receive(data: bytes) -> None:
            fields = read(data)
            complete = self._matcher.add(topic, fields.stamp, fields)
            if complete is not None:
                with self._diagnostics.cycle():
                    self._send(*complete)

        return receive

    def _send(
        self, joints: JointFields, depressor: OdometryFields, imu: ImuFields, fish: OdometryFields
    ) -> None:
        stamp = joints.stamp
        if self._first_stamp is None:
            self._first_stamp = stamp
        state = _true_state((stamp - self._first_stamp) * 1e-9, joints, depressor, imu, fish)
        time_ns = stamp - self._ros_minus_monotonic
        self._socket.send(
            bench_frame(
                self._frames,
                time_ns,
                self._bench.terminal_volts(state).tolist(),
                *self._bench.encoder_angles(state),
            )
        )
        if time.monotonic_ns() > time_ns:
            self._diagnostics.overrun()  # the board has had to do without
        self._frames += 1
        if self._frames == 1:
            self._diagnostics.ready(_SENDING)

    def _look_for_silence(self) -> None:
        silent = 0 < self._frames == self._frames_at_last_look
        if silent and not self._silent:
            self._diagnostics.warn(
                f"no complete plant state for {_SILENCE_S:g} s: see the plant simulator"
            )
        elif self._silent and not silent:
            self._diagnostics.ready(_SENDING)
        self._silent = silent
        self._frames_at_last_look = self._frames

    def _details(self) -> dict[str, Any]:
        return {"frames": self._frames, "lost_states": self._matcher.lost}


def _true_state(
    time_s: float,
    joints: JointFields,
    depressor: OdometryFields,
    imu: ImuFields,
    fish: OdometryFields,
) -> TrueState:
    return TrueState(
        time=time_s,
        crank_angle=joints.position[CRANK_JOINT],
        carriage_position=joints.position[CARRIAGE_JOINT],
        fish_position=fish.position,
        fish_quaternion=fish.quaternion,
        fish_velocity=fish.linear,
        fish_angular_velocity=fish.angular,
        specific_force=imu.linear_acceleration,
        depressor_position=depressor.position,
        depressor_velocity=depressor.linear,
    )


def main() -> int:
    """Run the node until it is stopped."""
    return run_node(BenchNode, (RigError, BenchError, FaultError, SerialisedError))
