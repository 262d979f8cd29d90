# SPDX-License-Identifier: Apache-2.0
"""A whole trial without clock and without ROS, in one process and the same every time: plant,
bench, the real firmware in the virtual board, driver, conversion and analysis."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from pathlib import Path

from towtank_bringup.simulated_heave import plant_samples
from towtank_compare.heave import HeaveResult, HeaveSamples, analyse_window
from towtank_compare.series import Series
from towtank_daq.board import AdcBoard, Scan, Transport
from towtank_daq.configuration import configuration_at
from towtank_daq.description import BoardDescription, installed_description, load_description
from towtank_daq.pressure import PressureSensor
from towtank_daq.protocol import Protocol
from towtank_rig import Rig
from towtank_rig.conversion import crank_encoder
from towtank_sim.drive import trial_commands
from towtank_sim.offline import PlantHistory, bench_frames, simulate_plant
from towtank_uncertainty.sensor_errors import SensorErrors

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / "firmware" / "vboard"))

from vboard import VirtualBoard  # noqa: E402

ELF = ROOT / "build" / "firmware" / "towtank_board.elf"

REST_S = 3.0
STEADY_S = 14.0
START_NS = 100_000_000  # board time at the plant's time 0: the board is up by then
ZERO_SCANS = 200
_QUANTUM_NS = 200_000
_LEAD_NS = 50_000_000


@dataclass(frozen=True)
class OfflineTrial:
    """One run of the plant, to be measured with as many sets of sensors as wanted."""

    rig: Rig
    history: PlantHistory

    @classmethod
    def of(cls, rig: Rig) -> OfflineTrial:
        commands = trial_commands(rig, rest=REST_S, steady=STEADY_S)
        duration = REST_S + rig.run.ramp_time.value + STEADY_S
        return cls(rig, simulate_plant(rig, commands, duration))

    @property
    def window_ms(self) -> tuple[int, int]:
        """From 2 s after the ramp to 1 s before the end, in board time."""
        start = START_NS * 1e-9 + REST_S + self.rig.run.ramp_time.value + 2.0
        return round(1e3 * start), round(1e3 * (start + STEADY_S - 3.0))

    def truth(self) -> HeaveResult:
        """The plant's own heave, at the places of the sensors."""
        samples = plant_samples(self.rig, self.history, START_NS)
        return analyse_window(samples, self.rig, *self.window_ms)

    def measure(
        self, errors: SensorErrors, seed: int, noise_volts: float | tuple[float, ...]
    ) -> tuple[HeaveSamples, HeaveResult]:
        """What the sensors and the board make of the run: samples and analysis."""
        board = load_description(installed_description())
        with VirtualBoard(
            ELF,
            crank_counts_per_revolution=self.rig.sensors.crank_encoder.counts_per_revolution,
            carriage_counts_per_revolution=self.rig.sensors.carriage_encoder.counts_per_revolution,
            noise_volts=noise_volts,
            seed=seed,
        ) as virtual:
            frames = bench_frames(self.history, self.rig, errors, START_NS)
            scans = acquire(virtual, board, frames, self.history.time[-1])
        samples = self._convert(scans, board)
        return samples, analyse_window(samples, self.rig, *self.window_ms)

    def _convert(self, scans: list[Scan], board: BoardDescription) -> HeaveSamples:
        delays = configuration_at(board, 100).channel_delays_ns(board)
        heave, zero_depths = {}, []
        for name in ("fish_pressure", "depressor_pressure"):
            sensor = PressureSensor(self.rig, board, name, ZERO_SCANS)
            stamps, depths = [], []
            for scan in scans:
                reading = sensor.process(scan.codes, scan.valid_mask)
                if sensor.can_be_zeroed and not sensor.zeroed:
                    sensor.zero()
                elif sensor.zeroed:
                    stamps.append(scan.stamp_ns + delays[sensor.channel])
                    depths.append(-reading.depth)
            heave[name] = Series.of(stamps, depths)
            zero_depths.append(sensor.zero_depth)
        per_count = crank_encoder(self.rig).per_count
        crank = Series.of(
            [scan.stamp_ns for scan in scans], [per_count * scan.crank for scan in scans]
        )
        return HeaveSamples("measured", crank, *heave.values(), tuple(zero_depths))


class _Line(Transport):
    """The driver's transport and clock: reading is what makes the board's time pass."""

    def __init__(self, board: VirtualBoard, frames: list[bytes]) -> None:
        self._board = board
        self._frames = frames
        self._fed = 0

    def monotonic_ns(self) -> int:
        return self._board.now_ns

    def write(self, data: bytes) -> None:
        self._board.write(data)

    def read(self, timeout_s: float) -> bytes:
        now_ns = self._board.now_ns
        end_ns = now_ns + round(1e9 * timeout_s)
        while not (data := self._board.read()) and now_ns < end_ns:
            self._feed(now_ns)
            now_ns = min(end_ns, now_ns + _QUANTUM_NS)
            self._board.run_until(now_ns)
        return data

    def _feed(self, now_ns: int) -> None:
        due = (now_ns + _LEAD_NS - START_NS) // 10_000_000 + 1  # one frame in 10 ms
        while self._fed < min(due, len(self._frames)):
            self._board.push_bench(self._frames[self._fed])
            self._fed += 1


def acquire(
    virtual: VirtualBoard, board: BoardDescription, frames: list[bytes], duration_s: float
) -> list[Scan]:
    scans: list[Scan] = []
    line = _Line(virtual, frames)
    driver = AdcBoard(line, Protocol(board), scans.append, print, line.monotonic_ns)
    virtual.run_until(50_000_000)  # the board has been switched on a moment before
    driver.connect()
    driver.configure(configuration_at(board, 100))
    driver.start()
    driver.poll(START_NS * 1e-9 + duration_s - virtual.now_ns * 1e-9)
    driver.stop()
    assert (driver.statistics.scans_lost, driver.statistics.scans_bad) == (0, 0)
    assert math.isclose(virtual.now_ns * 1e-9, duration_s + START_NS * 1e-9, abs_tol=0.2)
    return scans
