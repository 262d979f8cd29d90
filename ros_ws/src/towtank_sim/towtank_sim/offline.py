# SPDX-License-Identifier: Apache-2.0
"""A virtual trial without clock and without ROS: as fast as the machine goes, the same each time.

    history = simulate_plant(rig, trial_commands(rig, rest=5.0, steady=40.0), duration=53.0)
    frames = bench_frames(history, rig, sensor_errors.draw(rig, seed=1))     # to the virtual board
    twin = simulate_twin(rig, history.time, *encoder_readings(history, rig))

Plant, bench and twin are those of the nodes.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from towtank_rig import Rig
from towtank_rig.conversion import carriage_encoder, crank_encoder
from towtank_uncertainty.sensor_errors import SensorErrors

from towtank_sim.axes import Vector, add, to_tank
from towtank_sim.bench import Bench, TrueState
from towtank_sim.bench_frame import bench_frame
from towtank_sim.drive import TimedCommand
from towtank_sim.plant import CYCLE_NS, Plant
from towtank_sim.protocol_records import CHANNELS
from towtank_sim.resolution import SEGMENTS, STEP
from towtank_sim.terminal_faults import TerminalFault
from towtank_sim.tow import Tow
from towtank_sim.twin import Twin

Array = NDArray[np.float64]

_CYCLE = CYCLE_NS * 1e-9


@dataclass(frozen=True)
class TowHistory:
    """States of a simulated tow at N instants: shapes (N,), (N, 3), quaternion (N, 4).

    time: s; positions: m, tank axes; fish_quaternion: (w, x, y, z), body → tank; top_tension: N.
    """

    time: Array
    fish_position: Array
    fish_quaternion: Array
    depressor_position: Array
    top_tension: Array

    def fish_place(self, place: Sequence[float]) -> Array:
        """Return where a place on the fish (m, body axes) is in tank axes, m, shape (N, 3)."""
        x, y, z = place
        moved = to_tank(tuple(self.fish_quaternion.T), (x, y, z))
        return np.stack(add(tuple(self.fish_position.T), moved), axis=-1)


@dataclass(frozen=True)
class PlantHistory(TowHistory):
    """The plant's states, with the drive's and what the bench needs.

    crank_angle: rad, crank_rate: rad/s, carriage_position: m, carriage_speed: m/s, all (N,);
    fish_velocity (m/s), fish_angular_velocity (rad/s), specific_force (m/s²): body axes, (N, 3);
    depressor_velocity: m/s, tank axes, (N, 3).
    """

    crank_angle: Array
    crank_rate: Array
    carriage_position: Array
    carriage_speed: Array
    fish_velocity: Array
    fish_angular_velocity: Array
    specific_force: Array
    depressor_velocity: Array

    def true_state(self) -> TrueState:
        """Return all instants at once, as the bench takes them."""

        def components(values: Array) -> Vector:
            return tuple(values.T)

        return TrueState(
            self.time,
            self.crank_angle,
            self.carriage_position,
            components(self.fish_position),
            tuple(self.fish_quaternion.T),
            components(self.fish_velocity),
            components(self.fish_angular_velocity),
            components(self.specific_force),
            components(self.depressor_position),
            components(self.depressor_velocity),
        )


def simulate_plant(
    rig: Rig,
    commands: Sequence[TimedCommand],
    duration: float,
    output_rate: float = 100.0,
    *,
    segments: int = SEGMENTS,
    step: float = STEP,
) -> PlantHistory:
    """Run the plant from rest at time 0 to `duration` (s) and return its states.

    commands: times (s, not decreasing) and drive commands; each holds from the first plant cycle
    (10 ms) at or after its time. output_rate: Hz, a whole part of the plant's 100 Hz.
    segments, step: as the nodes' parameters. Raises ValueError for another output rate.
    """
    stride = round(1.0 / (output_rate * _CYCLE))
    if stride < 1 or abs(stride * output_rate * _CYCLE - 1.0) > 1e-9:
        raise ValueError(
            f"an output rate of {output_rate:g} Hz is no whole part of the plant's "
            f"{1 / _CYCLE:g} Hz: give 100, 50, 25, 20, 10 ..."
        )
    plant = Plant(rig, segments, step)
    rows = []
    for cycle in _run(plant, commands, round(duration / _CYCLE)):
        if cycle % stride == 0:
            rows.append(_plant_row(plant))
    # NumPy arrays by field; each row holds the fields in the order of PlantHistory.
    return PlantHistory(*(np.array(column) for column in zip(*rows, strict=True)))


def _run(plant: Plant, commands: Sequence[TimedCommand], cycles: int) -> Iterator[int]:
    """Yield the number of each cycle, from 0, when the plant has got there."""
    waiting = deque(commands)
    for cycle in range(cycles + 1):
        if cycle > 0:
            plant.advance()
        while waiting and waiting[0][0] <= plant.time + 1e-9:
            plant.command(waiting.popleft()[1])
        yield cycle


def _plant_row(plant: Plant) -> tuple[object, ...]:
    drive, fish, depressor = plant.drive(), plant.fish(), plant.depressor()
    return (
        plant.time,
        fish.position,
        fish.quaternion,
        depressor.position,
        plant.top_tension(),
        drive.crank_angle,
        drive.crank_rate,
        drive.carriage_position,
        drive.carriage_speed,
        fish.velocity_in_body,
        fish.angular_velocity,
        plant.specific_force(fish),
        depressor.velocity,
    )


def bench_frames(
    history: PlantHistory,
    rig: Rig,
    errors: SensorErrors,
    start_ns: int = 0,
    faults: Sequence[TerminalFault] = (),
) -> list[bytes]:
    """Return the bench frames of a plant's history, numbered from 0.

    start_ns: the board's time at the plant's time 0, ns. A board takes only frames that lie ahead
    of it, so one that begins at 0 needs a later start. faults: of sensors and wires.
    """
    bench = Bench(rig, errors, CHANNELS, faults)
    state = history.true_state()
    volts = bench.terminal_volts(state).tolist()
    crank, wheel = (angle.tolist() for angle in bench.encoder_angles(state))
    times = (start_ns + np.round(history.time * 1e9).astype(np.int64)).tolist()
    return [
        bench_frame(number, *frame)
        for number, frame in enumerate(zip(times, volts, crank, wheel, strict=True))
    ]


def encoder_readings(history: PlantHistory, rig: Rig) -> tuple[Array, Array]:
    """Return crank angle (rad) and carriage position (m) as ideal encoders count them."""
    crank, carriage = crank_encoder(rig), carriage_encoder(rig)
    return (
        crank.value(crank.counts(history.crank_angle)),
        carriage.value(carriage.counts(history.carriage_position)),
    )


def simulate_twin(
    rig: Rig,
    time: ArrayLike,
    crank_angle: ArrayLike,
    carriage_position: ArrayLike,
    *,
    segments: int = SEGMENTS,
    step: float = STEP,
) -> TowHistory:
    """Run the twin over measured samples; the states are at the samples that it reaches.

    time: s, rising; crank_angle: rad; carriage_position: m; all (N,). The first and last
    HALF_WIDTH samples of the smoothing window have no state (towtank_sim.smoother).
    """
    twin = Twin(rig, segments, step)
    rows = []
    samples = np.column_stack((time, crank_angle, carriage_position))
    for instant, angle, position in samples.tolist():
        state = twin.follow(round(instant * 1e9), angle, position)
        if state is not None:
            rows.append(_tow_row(state * 1e-9, twin.tow))
    return TowHistory(*(np.array(column) for column in zip(*rows, strict=True)))


def _tow_row(time: float, tow: Tow) -> tuple[object, ...]:
    fish = tow.fish()
    return time, fish.position, fish.quaternion, tow.depressor().position, tow.top_tension()
