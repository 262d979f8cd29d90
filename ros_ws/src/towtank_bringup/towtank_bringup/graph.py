# SPDX-License-Identifier: Apache-2.0
"""The graph of a trial: which nodes and programs run, under which names, with which parameters.

This is the one place that says so. The `towtank` command starts these processes itself; the
launch file turns the same description into launch actions. No ROS in here.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from towtank_node.names import (
    BENCH_NODE,
    BOARD_NODE,
    BODIES,
    COMPARISON_NODE,
    CONDUCTOR_NODE,
    CRANK_DRIVE_NODE,
    ENCODER_NODE,
    INCLINOMETER_NODE,
    PLANT_NODE,
    RECORDER_NODE,
    TWIN_NODE,
    pressure_node,
    split_name,
)
from towtank_sim.resolution import SEGMENTS, STEP

VIRTUAL_BOARD = "vboard/towtank-vboard"
FIRMWARE_IMAGE = "towtank_board.elf"
"""Where `make -C firmware` puts the program and what it executes, below its folder."""

ACQUISITION_RESTARTS = 3
"""The process of acquisition may die so often in a trial: it holds nothing that the board does not
have, or that it has not kept (where the sensors were zeroed). What the others hold (the twin's
state, the open bag) would be lost with them."""


@dataclass(frozen=True)
class RosNode:
    """A node that is its own process.

    lifecycle: the conductor configures and activates it, and deactivates it at the end.
    """

    package: str
    executable: str
    namespace: str
    name: str
    parameters: dict[str, Any] = field(default_factory=dict)
    lifecycle: bool = False

    @property
    def full_name(self) -> str:
        """Fully qualified node name, as diagnostics and services carry it."""
        return f"{self.namespace.rstrip('/')}/{self.name}"

    @property
    def node_names(self) -> tuple[str, ...]:
        return (self.full_name,)

    @property
    def lifecycle_names(self) -> tuple[str, ...]:
        return self.node_names if self.lifecycle else ()


@dataclass(frozen=True)
class NodeGroup:
    """Several nodes in one process, which name themselves.

    node_names: fully qualified; parameters: of all of them.
    lifecycle_names: those of them that are lifecycle nodes, which the conductor leads.
    restarts: how often the process is started again when it ends in the middle of a trial; 0: then
    the trial ends.
    companions: full names of further nodes in the process; whether they are ready is not waited
    for.
    """

    package: str
    executable: str
    node_names: tuple[str, ...]
    parameters: dict[str, Any] = field(default_factory=dict)
    lifecycle_names: tuple[str, ...] = ()
    restarts: int = 0
    companions: tuple[str, ...] = ()

    @property
    def full_name(self) -> str:
        return self.executable


@dataclass(frozen=True)
class Program:
    """A program outside ROS. It is up once its standard output has a line that begins so."""

    name: str
    command: tuple[str, ...]
    ready_line: str
    node_names: tuple[str, ...] = ()
    lifecycle_names: tuple[str, ...] = ()

    @property
    def full_name(self) -> str:
        return self.name


_TOLD = ("clock_offset_ns", "senders")

Item = RosNode | NodeGroup | Program
"""What a graph consists of: a process."""

Graph = tuple[Item, ...]
"""In the order of starting; stopped the other way round."""


@dataclass(frozen=True)
class TrialSettings:
    """What a trial's graph depends on. Paths are absolute; rates and times in SI units.

    board_drives_crank: the board's node offers its drive for the crank; on the virtual tank the
    plant offers its own under the same name.
    any_calibration: a board of another calibration than the rig's is taken, with a warning.
    zeros: folder that keeps where the sensors were zeroed while the trial runs; None: not kept.
    """

    rig: Path
    bag: Path
    port: Path
    rate_hz: int = 100
    segments: int = SEGMENTS
    step_s: float = STEP
    window_s: float = 10.0
    board_drives_crank: bool = True
    any_calibration: bool = False
    zeros: Path | None = None


@dataclass(frozen=True)
class VirtualTankSettings:
    """The stand-in for tank, sensors and board.

    runtime: folder for the virtual board's pty link and bench socket.
    crank_cpr, carriage_cpr: counts per revolution of the encoders, after decoding by four.
    plant_rig: the plant's own rig file, which may differ from what the twin assumes.
    noise: 'rig' for sensor errors drawn from the rig's budget, 'none' for ideal sensors.
    conversion_noise: standard deviation of one conversion at the ADC's input by channel, V: white
    noise of sensor, front end and converter together.
    sensor_faults: of sensors and wires, as towtank_sim.terminal_faults reads them.
    eeprom: file that is the board's EEPROM; None for a blank one.
    """

    plant_rig: Path
    firmware: Path
    runtime: Path
    crank_cpr: int
    carriage_cpr: int
    conversion_noise: tuple[float, ...]
    noise: str = "rig"
    seed: int = 1
    sensor_faults: str = ""
    eeprom: Path | None = None

    @property
    def port(self) -> Path:
        return self.runtime / "board"

    @property
    def bench_socket(self) -> Path:
        return self.runtime / "bench"


def measurement(settings: TrialSettings) -> Graph:
    """Acquisition, twin, comparison and recorder: the same with a real and a virtual tank."""
    rig = {"rig": str(settings.rig)}
    return (
        RosNode(
            "towtank_bag",
            "recorder",
            *split_name(RECORDER_NODE),
            {**rig, "uri": str(settings.bag)},
            True,
        ),
        RosNode(
            "towtank_sim",
            "twin",
            *split_name(TWIN_NODE),
            {**rig, "segments": settings.segments, "step_s": settings.step_s},
        ),
        RosNode(
            "towtank_compare",
            "comparison",
            *split_name(COMPARISON_NODE),
            {**rig, "window_s": settings.window_s},
        ),
        NodeGroup(
            "towtank_daq",
            "acquisition",
            (BOARD_NODE, *map(pressure_node, BODIES), INCLINOMETER_NODE, ENCODER_NODE),
            {
                **rig,
                "port": str(settings.port),
                "rate_hz": settings.rate_hz,
                "drives_crank": settings.board_drives_crank,
                "any_calibration": settings.any_calibration,
                "zeros": str(settings.zeros or ""),
            },
            lifecycle_names=(BOARD_NODE,),
            restarts=ACQUISITION_RESTARTS,
            companions=(CRANK_DRIVE_NODE,),
        ),
    )


def virtual_board(tank: VirtualTankSettings) -> Program:
    """The real firmware on a virtual board, which waits for a bench on its socket."""
    return Program(
        "virtual_board",
        (
            str(tank.firmware / VIRTUAL_BOARD),
            "--elf",
            str(tank.firmware / FIRMWARE_IMAGE),
            "--pty-link",
            str(tank.port),
            "--bench-socket",
            str(tank.bench_socket),
            "--crank-cpr",
            str(tank.crank_cpr),
            "--carriage-cpr",
            str(tank.carriage_cpr),
            "--seed",
            str(tank.seed),
            "--noise",
            ",".join(f"{volts:.3g}" for volts in tank.conversion_noise),
            *(("--eeprom", str(tank.eeprom)) if tank.eeprom else ()),
        ),
        "ready",
    )


def virtual_tank(settings: TrialSettings, tank: VirtualTankSettings) -> Graph:
    """Virtual board, plant simulator and virtual bench: what the real tank and board do else."""
    return (
        virtual_board(tank),
        NodeGroup(
            "towtank_sim",
            "virtual_tank",
            (PLANT_NODE, BENCH_NODE),
            {
                "rig": str(tank.plant_rig),
                "segments": settings.segments,
                "step_s": settings.step_s,
                "socket": str(tank.bench_socket),
                "noise": tank.noise,
                "seed": tank.seed,
                "sensor_faults": tank.sensor_faults,
            },
        ),
    )


def joined(graph: Graph, clock_offset_ns: int) -> Graph:
    """The graph, each node of which is told what all must know of the trial: its clock
    (towtank_node.trial_clock), and whom to listen to (towtank_node.senders)."""
    node_names = [CONDUCTOR_NODE]  # it leads the graph, and is none of it
    for item in graph:
        companions = item.companions if isinstance(item, NodeGroup) else ()
        node_names += [*item.node_names, *companions]
    told = {"clock_offset_ns": clock_offset_ns, "senders": " ".join(node_names)}
    return tuple(
        item if isinstance(item, Program) else replace(item, parameters={**item.parameters, **told})
        for item in graph
    )


def told_to_all(graph: Graph) -> dict[str, Any]:
    """What `joined` has told the nodes of a graph; nothing where it was not asked to."""
    for item in graph:
        if not isinstance(item, Program):
            return {name: item.parameters[name] for name in _TOLD if name in item.parameters}
    return {}
