# SPDX-License-Identifier: Apache-2.0
"""The virtual board as a calibration's station: no hardware, the real firmware, in real time."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Iterator
from pathlib import Path

from towtank_lab.virtual_sensors import VirtualSensors
from towtank_rig import Rig
from towtank_rig.conversion import crank_encoder
from towtank_sim.bench_frame import bench_frame
from towtank_sim.bench_socket import BenchSocket, BenchSocketError
from towtank_sim.protocol_records import CHANNELS
from towtank_uncertainty import sensor_errors

from towtank_bringup.environment import runtime_folder
from towtank_bringup.graph import VirtualTankSettings, virtual_board
from towtank_bringup.plan import board_eeprom, conversion_noise, firmware_folder
from towtank_bringup.processes import ProcessGroup

_FRAME_S = 0.01
_LEAD_NS = 50_000_000


@contextlib.contextmanager
def virtual_station(rig: Rig, rig_file: Path, seed: int) -> Iterator[tuple[Path, VirtualSensors]]:
    """Run a virtual board; yields its port and its sensors, whose errors are drawn by the seed.

    Raises PlanError if the board is not built, ProcessError or BenchSocketError if it fails,
    EnvironmentProblem if there is no folder for its socket.
    """
    sensors = VirtualSensors(rig, sensor_errors.draw(rig, seed), CHANNELS)
    with runtime_folder() as folder:
        settings = VirtualTankSettings(
            plant_rig=rig_file,
            firmware=firmware_folder(),
            runtime=folder,
            crank_cpr=crank_encoder(rig).counts_per_revolution,
            carriage_cpr=rig.sensors.carriage_encoder.counts_per_revolution,
            conversion_noise=conversion_noise(rig),
            seed=seed,
            eeprom=board_eeprom(rig, folder),
        )
        processes = ProcessGroup(folder / "logs")
        try:
            processes.start((virtual_board(settings),), processes.check)
            with BenchSocket(str(settings.bench_socket)) as socket, _fed(socket, sensors):
                yield settings.port, sensors
        finally:
            processes.stop()


@contextlib.contextmanager
def _fed(socket: BenchSocket, sensors: VirtualSensors) -> Iterator[None]:
    """Send the terminals' state to the board as long as the context lasts."""
    ending = threading.Event()

    def feed() -> None:
        number = 0
        while not ending.wait(_FRAME_S):
            frame = bench_frame(
                number,
                time.monotonic_ns() + _LEAD_NS,
                sensors.terminal_volts(),
                sensors.crank_shaft(),
                sensors.carriage_shaft(),
            )
            try:
                socket.send(frame)
            except BenchSocketError:
                return  # the board is gone: the driver tells it
            number += 1

    thread = threading.Thread(target=feed, name="bench", daemon=True)
    thread.start()
    try:
        yield
    finally:
        ending.set()
        thread.join()
