# SPDX-License-Identifier: Apache-2.0
"""The plant as a node: real time, ahead of now by a lead.

Every 10 ms of simulated time one state is published with its own instant as the stamp. It lies
`lead_s` in the future, so that the virtual board has the state before it has to convert it. When
the machine has held the node up, it catches up cycle by cycle and leaves none out; a state that is
published after its instant counts as an overrun.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from towtank_interfaces.srv import SetDrive
from towtank_node import names, topics
from towtank_node.diagnostics import NodeDiagnostics
from towtank_node.endpoints import publisher, server
from towtank_node.parameters import Parameter, read_parameters
from towtank_node.services import SET_DRIVE
from towtank_node.timers import create_steady_timer
from towtank_node.trial_clock import TrialClock
from towtank_rig import load_rig

import sim_core as sc
from towtank_sim.bench import TrueState
from towtank_sim.drive import DriveError, drive_command
from towtank_sim.messages import (
    CableStateWriter,
    ImuWriter,
    JointStateWriter,
    OdometryWriter,
)
from towtank_sim.plant import CYCLE_NS, Plant
from towtank_sim.simulator_parameters import RIG, SEGMENTS, STEP
from towtank_sim.virtual_crank_node import VirtualCrankNode

_PARAMETERS = (
    RIG,
    SEGMENTS,
    STEP,
    Parameter(
        "lead_s",
        float,
        "how far the plant runs ahead of real time, s",
        default=0.15,
        minimum=0.0,
        maximum=1.0,
    ),
)
_CYCLES_PER_CABLE_STATE = 5  # 20 Hz
_TIME_TO_START_NS = 200_000_000  # from making the node to its plant's time 0
_MOST_CYCLES_AT_ONCE = 10  # then services and diagnostics get their turn


class PlantNode(Node):
    """Node /plant/simulator.

    on_state: gets each state and its instant, CLOCK_MONOTONIC in ns, before it is published.
    """

    def __init__(self, on_state: Callable[[int, TrueState], None]) -> None:
        namespace, name = names.split_name(names.PLANT_NODE)
        super().__init__(name, namespace=namespace)
        self._on_state = on_state
        parameters = read_parameters(self, _PARAMETERS)
        self._plant = Plant(load_rig(parameters.rig), parameters.segments, parameters.step_s)
        self._lead_ns = round(parameters.lead_s * 1e9)
        self._fish_odometry = OdometryWriter(names.FISH)
        self._depressor_odometry = OdometryWriter(names.DEPRESSOR)
        self._joint_states = JointStateWriter()
        self._imu = ImuWriter(names.FISH)
        self._cable_state = CableStateWriter()
        self._publish_fish = publisher(self, topics.PLANT_FISH).publish
        self._publish_depressor = publisher(self, topics.PLANT_DEPRESSOR).publish
        self._publish_joints = publisher(self, topics.PLANT_JOINTS).publish
        self._publish_imu = publisher(self, topics.PLANT_IMU).publish
        self._publish_cables = publisher(self, topics.PLANT_CABLES).publish
        self._diagnostics = NodeDiagnostics(self, CYCLE_NS * 1e-9, self._details)
        server(self, SET_DRIVE, self._set_drive)
        # Real time is the monotonic clock's: a plant cannot follow a simulated or a set clock.
        self._start_ns = time.monotonic_ns() + _TIME_TO_START_NS
        clock = TrialClock(self)
        self._stamp_of_start = self._start_ns + clock.offset_ns
        self.crank_node = VirtualCrankNode(self._plant, clock)
        self.failure: Exception | None = None
        """What ended the simulation; see towtank_node.main."""
        self._timer = create_steady_timer(self, CYCLE_NS * 1e-9, self._work)
        self._diagnostics.ready()

    def _ahead_ns(self) -> int:
        """By how much the plant's state lies in the future."""
        return self._start_ns + self._plant.time_ns - time.monotonic_ns()

    def _work(self) -> None:
        try:
            self._catch_up()
        except Exception as error:  # noqa: BLE001 - raised by the main loop
            self._timer.cancel()
            if isinstance(error, sc.ConvergenceError):
                self._diagnostics.fail(f"the simulation stopped: {error}")
            self.failure = error

    def _catch_up(self) -> None:
        for _ in range(_MOST_CYCLES_AT_ONCE):
            if self._ahead_ns() >= self._lead_ns:
                break
            self._cycle()

    def _cycle(self) -> None:
        with self._diagnostics.cycle():
            self._plant.advance()
            self._publish()
        if self._ahead_ns() < 0:
            self._diagnostics.overrun()

    def _publish(self) -> None:
        plant = self._plant
        stamp = self._stamp_of_start + plant.time_ns
        drive, fish, depressor = plant.drive(), plant.fish(), plant.depressor()
        specific_force = plant.specific_force(fish)
        self._on_state(
            self._start_ns + plant.time_ns,
            TrueState(
                time=plant.time,
                crank_angle=drive.crank_angle,
                carriage_position=drive.carriage_position,
                fish_position=fish.position,
                fish_quaternion=fish.quaternion,
                fish_velocity=fish.velocity_in_body,
                fish_angular_velocity=fish.angular_velocity,
                specific_force=specific_force,
                depressor_position=depressor.position,
                depressor_velocity=depressor.velocity,
            ),
        )
        self._publish_joints(
            self._joint_states.fill(
                stamp,
                drive.crank_angle,
                drive.crank_rate,
                drive.carriage_position,
                drive.carriage_speed,
            )
        )
        self.crank_node.publish(stamp)
        self._publish_depressor(self._depressor_odometry.point(stamp, depressor))
        self._publish_imu(self._imu.fill(stamp, fish, specific_force))
        self._publish_fish(self._fish_odometry.body(stamp, fish))
        if plant.time_ns // CYCLE_NS % _CYCLES_PER_CABLE_STATE == 0:
            self._publish_cables(self._cable_state.fill(stamp, plant.line_shapes()))

    def _set_drive(
        self, request: SetDrive.Request, response: SetDrive.Response
    ) -> SetDrive.Response:
        try:
            self._plant.command(
                drive_command(request.carriage_speed, request.crank_rate, request.ramp_time)
            )
        except DriveError as error:
            response.success, response.message = False, str(error)
        else:
            response.success, response.message = True, "ramp begins"
        return response

    def _details(self) -> dict[str, Any]:
        drive = self._plant.drive()
        return {
            "lead_ms": f"{self._ahead_ns() * 1e-6:.1f}",
            "carriage_position": f"{drive.carriage_position:.3f}",
            "carriage_speed": f"{drive.carriage_speed:.4f}",
            "crank_rate": f"{drive.crank_rate:.4f}",
        }
