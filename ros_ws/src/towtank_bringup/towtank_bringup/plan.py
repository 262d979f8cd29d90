# SPDX-License-Identifier: Apache-2.0
"""From a user's wishes to a planned trial: rig, graph, course and directory. Starts nothing."""

from __future__ import annotations

import datetime
import math
import os
import time
from dataclasses import dataclass
from pathlib import Path

from towtank_daq.description import installed_description, load_description
from towtank_daq.identity import eeprom_image
from towtank_node.stamps import ros_minus_monotonic_ns
from towtank_rig import Rig, load_rig
from towtank_rig.conversion import crank_encoder
from towtank_sim.terminal_faults import FaultError, TerminalFaults, parse_faults

from towtank_bringup.course_plan import Course, PlanError, course_notes, plan_course
from towtank_bringup.environment import as_text
from towtank_bringup.graph import (
    FIRMWARE_IMAGE,
    VIRTUAL_BOARD,
    Graph,
    TrialSettings,
    VirtualTankSettings,
    joined,
    measurement,
    virtual_tank,
)
from towtank_bringup.rigs import rig_path
from towtank_bringup.trial_directory import TrialDirectory

EEPROM_BYTES = 4096


@dataclass(frozen=True)
class PlannedTrial:
    """A trial that is ready to start. `on_virtual_tank`: no hardware is involved."""

    rig: Rig
    graph: Graph
    course: Course
    directory: TrialDirectory
    on_virtual_tank: bool

    def notes(self) -> list[str]:
        """What the experimenter should know before the start."""
        return course_notes(self.course, self.rig)


def plan_trial(
    *,
    rig: str,
    runtime: Path,
    port: Path | None = None,
    duration: float | None = None,
    beyond_tank: bool = False,
    out: Path | None = None,
    plant_rig: str | None = None,
    noise: str = "rig",
    seed: int = 1,
    sensor_faults: str = "",
    clock_offset_ns: int | None = None,
    any_calibration: bool = False,
) -> PlannedTrial:
    """Plan a trial. See `towtank trial --help` for the arguments.

    runtime: an existing folder for the virtual board's pty link and socket, as
    environment.make_runtime_folder() makes it.
    clock_offset_ns: of the trial's clock, as towtank_node.trial_clock has it; read now if None.
    Raises RigError for a bad rig file, PlanError for what else cannot be.
    """
    if port and beyond_tank:
        raise PlanError("a real carriage ends with its tank: leave --beyond-tank out")
    if port and not port.exists():
        raise PlanError(
            f"port {port} does not exist: connect the board, or leave the port out for the "
            "virtual one"
        )
    rig_file = rig_path(rig)
    loaded = load_rig(rig_file)
    course = plan_course(loaded, duration, attended=port is not None, beyond_tank=beyond_tank)
    try:
        TerminalFaults(parse_faults(sensor_faults), loaded, loaded.board.channels)
    except FaultError as error:
        raise PlanError(str(error)) from error
    now = datetime.datetime.now(datetime.UTC)
    directory = TrialDirectory(
        (out or Path("trials") / f"{rig_file.stem}-{now:%Y%m%dT%H%M%SZ}").absolute()
    )
    settings = TrialSettings(
        as_text(rig_file, runtime, "rig.yaml"),
        as_text(directory.path, runtime, "trial") / directory.bag.name,
        port or runtime / "board",
        board_drives_crank=port is not None,
        any_calibration=any_calibration,
        zeros=runtime / "zeros",
    )
    graph = measurement(settings)
    if port is None:
        plant_rig_file = rig_path(plant_rig) if plant_rig else rig_file
        load_rig(plant_rig_file)
        tank = VirtualTankSettings(
            plant_rig=as_text(plant_rig_file, runtime, "plant_rig.yaml"),
            firmware=firmware_folder(),
            runtime=runtime,
            crank_cpr=crank_encoder(loaded).counts_per_revolution,
            carriage_cpr=loaded.sensors.carriage_encoder.counts_per_revolution,
            conversion_noise=conversion_noise(loaded) if noise == "rig" else (0.0,),
            noise=noise,
            seed=seed,
            sensor_faults=sensor_faults,
            eeprom=board_eeprom(loaded, runtime),
        )
        graph = virtual_tank(settings, tank) + graph
    if clock_offset_ns is None:
        clock_offset_ns = ros_minus_monotonic_ns(time.time_ns)
    graph = joined(graph, clock_offset_ns)
    return PlannedTrial(loaded, graph, course, directory, port is None)


def conversion_noise(rig: Rig) -> tuple[float, ...]:
    """White noise at the ADC's input by channel, V: the converter's, and the sensor's amplified."""
    sensors = rig.sensors
    terminal_noise = {
        sensors.fish_pressure.channel: sensors.fish_pressure.errors.noise.value,
        sensors.depressor_pressure.channel: sensors.depressor_pressure.errors.noise.value,
    }
    for channel in sensors.accelerometer.channels.model_dump().values():
        terminal_noise[channel] = sensors.accelerometer.errors.noise.value
    board = load_description(installed_description())
    return tuple(
        math.hypot(channel.noise_volts, channel.gain * terminal_noise.get(channel.name, 0.0))
        for channel in board.channels
    )


def board_eeprom(rig: Rig, runtime: Path) -> Path | None:
    """The EEPROM of a virtual board that a rig's calibrations are of; None if the rig takes any."""
    calibration_id = rig.board.calibration_id
    if calibration_id is None:
        return None
    image = eeprom_image(load_description(installed_description()), 0, calibration_id)
    path = runtime / "eeprom"
    path.write_bytes(image.ljust(EEPROM_BYTES, b"\xff"))
    return path


def firmware_folder() -> Path:
    """Where the virtual board and its firmware are; PlanError if they are not built."""
    mend = (
        "start through ./towtank, or run `make -C firmware` and set TOWTANK_FIRMWARE to "
        "build/firmware"
    )
    folder = os.environ.get("TOWTANK_FIRMWARE")
    if not folder:
        raise PlanError(f"the virtual board is not known: {mend}")
    for name in (VIRTUAL_BOARD, FIRMWARE_IMAGE):
        if not (Path(folder) / name).is_file():
            raise PlanError(f"the virtual board is not built, {folder} has no {name}: {mend}")
    return Path(folder)
