# SPDX-License-Identifier: Apache-2.0
"""The virtual bench as a node: plant states in, bench frames to the virtual board out.

It lives in the plant's process (virtual_tank.py), which hands it each state.
"""

from __future__ import annotations

import time

from rclpy.node import Node
from towtank_node.diagnostics import NodeDiagnostics
from towtank_node.names import BENCH_NODE, split_name
from towtank_node.parameters import Parameter, read_parameters
from towtank_rig import load_rig
from towtank_uncertainty import sensor_errors

from towtank_sim.bench import Bench, TrueState
from towtank_sim.bench_frame import bench_frame
from towtank_sim.bench_socket import BenchSocket
from towtank_sim.plant import CYCLE_NS
from towtank_sim.protocol_records import CHANNELS
from towtank_sim.simulator_parameters import RIG
from towtank_sim.terminal_faults import parse_faults

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
        self._frames = 0
        self._diagnostics = NodeDiagnostics(self, CYCLE_NS * 1e-9, lambda: {"frames": self._frames})

    def close(self) -> None:
        """Give the socket back."""
        self._socket.close()

    def take(self, time_ns: int, state: TrueState) -> None:
        """Send what the terminals see of a state of the plant; time_ns: CLOCK_MONOTONIC."""
        with self._diagnostics.cycle():
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
            self._diagnostics.ready("sending frames")
