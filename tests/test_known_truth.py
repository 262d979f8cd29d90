# SPDX-License-Identifier: Apache-2.0
"""Known truth: random motions through random sensors lie in their stated intervals.

A trial draws every error that the rig allows once, for that is what a systematic error is: one
value for the whole of a trial. Sensors are zeroed at rest at some depth; then fish and depressor
move, the crank turning five times. What the sensor nodes and a trial's analysis are made of reads
the codes and states values with 95 % intervals: of depth and attitude at one sample of a trial,
taken at random (the next sample has the same systematic errors and would say little new), and of
the heave ratio, the one that a trial's result has. A statement is right if 95 % of the trials lie
inside: fewer make it false, more make it idle.

The chain is that of a trial without microcontroller and clock (test_offline_trials.py has those).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from towtank_compare.heave import HeaveSamples, analyse_window
from towtank_compare.series import Series
from towtank_daq.description import installed_description, load_description
from towtank_daq.encoder import Drive
from towtank_daq.inclinometer import Inclinometer
from towtank_daq.pressure import PressureReading, PressureSensor
from towtank_rig import Rig, conversion, load_rig
from towtank_rig.loading import replaced
from towtank_sim.axes import to_tank
from towtank_sim.drive import trial_commands
from towtank_sim.offline import simulate_plant
from towtank_uncertainty.sensor_errors import draw_many

RIGS = Path(__file__).resolve().parents[1] / "hardware" / "rigs"
BOARD = load_description(installed_description())
ALL_VALID = (1 << len(BOARD.channels)) - 1
SENSORS = ("fish_pressure", "depressor_pressure")
TRIALS = 1000
TURNS = 5
SAMPLES_PER_TURN = 25
ZERO_SCANS = 20


@dataclass(frozen=True)
class Motion:
    """True motion of one body in TRIALS trials; samples along the second axis.

    Attributes:
        rest: Depth below still water where the sensor is zeroed, m, shape (TRIALS,).
        amplitude: Of the first harmonic of heave, m, shape (TRIALS,).
        depth: Below still water, m, shape (TRIALS, samples).
        surge: Speed along the tank over that of the carriage, m/s, shape (TRIALS, samples).
        surge_acceleration: m/s², shape (TRIALS, samples).
        heave_acceleration: m/s², upwards, shape (TRIALS, samples).
    """

    rest: np.ndarray
    amplitude: np.ndarray
    depth: np.ndarray
    surge: np.ndarray
    surge_acceleration: np.ndarray
    heave_acceleration: np.ndarray


class KnownTruth:
    """TRIALS random trials of a rig, and the codes that its random sensors give.

    Attributes:
        motions: By pressure sensor, that of its body.
        resting: By pressure sensor, its codes at rest, shape (TRIALS, ZERO_SCANS).
        towed: By pressure sensor, its codes under way, shape (TRIALS, samples).
        chosen: One sample of each trial.
        pitch, roll: True ones at that sample, rad, shape (TRIALS,).
        accelerations: Codes of the accelerometer's axes at that sample, shape (TRIALS, 3).
    """

    def __init__(self, rig: Rig, seed: int) -> None:
        self.rig = rig
        self._rng = np.random.default_rng(seed)
        self._sensors = draw_many(rig, self._rng, TRIALS)
        self.crank_rate = rig.run.crank_rate.value
        self.speed = rig.run.carriage_speed.value
        period = 2.0 * math.pi / self.crank_rate
        # A little more than the whole turns that the analysis takes
        self.time = np.arange(0.0, (TURNS + 0.02) * period, period / SAMPLES_PER_TURN)
        depressor = self._rng.uniform(0.03, 0.1, TRIALS)
        fish = depressor * self._rng.uniform(0.15, 0.4, TRIALS)
        self.motions, self.resting, self.towed = {}, {}, {}
        for sensor, amplitude in zip(SENSORS, (fish, depressor), strict=True):
            motion = self.motions[sensor] = self._motion(sensor, amplitude)
            at_rest = np.tile(column(motion.rest), ZERO_SCANS)
            self.resting[sensor] = self._pressure_codes(sensor, at_rest, 0.0, 0.0)
            past_the_port = self.speed + motion.surge
            self.towed[sensor] = self._pressure_codes(sensor, motion.depth, past_the_port, 1.0)
        self.chosen = self._rng.integers(len(self.time), size=TRIALS)
        self.pitch, self.roll = self._rng.uniform(-0.4, 0.4, (2, TRIALS))
        self.accelerations = self._accelerometer_codes()

    def _motion(self, sensor: str, amplitude: np.ndarray) -> Motion:
        """Heave at the crank's frequency with a second harmonic and a slow swing; a surge in phase
        with heave, for which the rig gives the limit."""
        rng, rate = self._rng, self.crank_rate
        given = getattr(self.rig.sensors, sensor)
        rest, mean = rng.uniform(0.3, self._deepest - 0.2, (2, TRIALS))
        first, second, swing = 2.0 * math.pi * rng.random((3, TRIALS, 1))
        parts = ((1.0, 1.0, first), (0.1, 2.0, second), (0.2, 1.0 / 6.3, swing))
        angles = [multiple * rate * self.time + phase for _, multiple, phase in parts]
        heave = sum(a * np.cos(angle) for (a, _, _), angle in zip(parts, angles, strict=True))
        curved = sum(
            -a * (multiple * rate) ** 2 * np.cos(angle)
            for (a, multiple, _), angle in zip(parts, angles, strict=True)
        )
        surge = column(given.errors.surge_speed.value * rng.uniform(-1.0, 1.0, TRIALS))
        return Motion(
            rest,
            amplitude,
            column(mean) - column(amplitude) * heave,
            surge * np.cos(angles[0]),
            -surge * rate * np.sin(angles[0]),
            column(amplitude) * curved,
        )

    @property
    def _deepest(self) -> float:
        """Where the sensors may be, m: within tank, full scale and the calibration's range."""
        rig = self.rig
        weight = rig.water.density.value * rig.water.gravity.value
        calibration = rig.calibrations.fish_pressure
        limit = calibration.fitted_range if calibration else rig.sensors.fish_pressure.full_scale
        return min(rig.tank.depth.value, 0.95 * limit.value / weight)

    def _pressure_codes(
        self, sensor: str, depth: np.ndarray, speed: np.ndarray | float, drift: float
    ) -> np.ndarray:
        """Codes of one pressure channel at depths (m) and speeds (m/s), shape (TRIALS, samples)."""
        model = getattr(self._sensors, sensor)
        pressure = conversion.pressure_from_depth(depth, self.rig.water)
        # The errors' shape, (TRIALS,), must come last
        volts = model.volts(pressure.T, np.transpose(speed), drift).T
        return self._codes(self._channel(sensor), volts, model.noise)

    def _accelerometer_codes(self) -> np.ndarray:
        fish = self.motions["fish_pressure"]
        force = np.zeros((TRIALS, 3))
        force[:, 0] = at_sample(fish.surge_acceleration, self.chosen)
        force[:, 2] = self.rig.water.gravity.value
        force[:, 2] += at_sample(fish.heave_acceleration, self.chosen)
        to_fish = np.swapaxes(conversion.rotation(self.roll, self.pitch, 0.0), -1, -2)
        model = self._sensors.accelerometer
        volts = model.volts((to_fish @ force[..., np.newaxis])[..., 0])
        axes = zip(self._axes, volts.T, strict=True)
        return np.stack([self._codes(name, axis, model.noise) for name, axis in axes], axis=-1)

    def _codes(self, channel: str, volts: np.ndarray, sensor_noise: float) -> np.ndarray:
        adc = BOARD.adc_channel(channel, self.rig.board.excitation.value)
        board_noise = BOARD.channels[BOARD.channel_names.index(channel)].noise_volts / adc.gain
        noise = math.hypot(sensor_noise, board_noise)
        return adc.codes(volts + noise * self._rng.standard_normal(volts.shape))

    def depths(self, sensor: str, codes: np.ndarray, speed: float) -> np.ndarray:
        """Depths below still water that the codes of one channel are read as, m."""
        adc = BOARD.adc_channel(self._channel(sensor), self.rig.board.excitation.value)
        read = conversion.depth_conversion(self.rig, sensor, adc)
        return read.depth(read.pressure(codes), speed)

    def zeroed_sensor(self, sensor: str, trial: int) -> tuple[PressureSensor, PressureReading]:
        """A trial's sensor after zeroing, and its last reading before."""
        reader = PressureSensor(self.rig, BOARD, sensor, ZERO_SCANS)
        for code in self.resting[sensor][trial].tolist():
            reading = reader.process(scan_of({self._channel(sensor): code}), ALL_VALID)
        reader.zero()
        return reader, reading

    def towed_scan(self, sensor: str, trial: int) -> list[int]:
        """A trial's scan at its chosen sample, as a pressure sensor's node sees it."""
        code = int(self.towed[sensor][trial, self.chosen[trial]])
        return scan_of({self._channel(sensor): code})

    def accelerometer_scan(self, trial: int) -> list[int]:
        """A trial's scan at its chosen sample, as the inclinometer's node sees it."""
        return scan_of(dict(zip(self._axes, self.accelerations[trial].tolist(), strict=True)))

    def _channel(self, sensor: str) -> str:
        return getattr(self.rig.sensors, sensor).channel

    @property
    def _axes(self) -> tuple[str, str, str]:
        names = self.rig.sensors.accelerometer.channels
        return names.x, names.y, names.z

    @property
    def drive(self) -> Drive:
        """Under way."""
        return Drive(self.crank_rate, self.speed, 0.0)


def scan_of(codes: dict[str, int]) -> list[int]:
    """A scan with the codes of some channels."""
    return [codes.get(name, 0) for name in BOARD.channel_names]


def column(values: np.ndarray) -> np.ndarray:
    """One value a trial, to go with samples along the second axis."""
    return values[:, np.newaxis]


def at_sample(values: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Each trial's value at its chosen sample."""
    return values[np.arange(TRIALS), chosen]


def assert_covered(inside: np.ndarray, what: str) -> None:
    """95 ± 2 %. The share of 1000 trials has a standard error of √(0.95 · 0.05/1000) = 0.7 %: a
    right statement fails for one seed in 250 (the seed is fixed), one that holds 92 % or 98 %
    passes for one in 8 or less."""
    assert abs(np.mean(inside) - 0.95) <= 0.02, f"{what}: {100 * np.mean(inside):.1f} % inside"


@pytest.fixture(
    scope="module",
    params=[("nit_calicut_2012", True), ("wu_chwang_2001", False)],
    ids=["nit_calicut_calibrated", "wu_chwang_data_sheet"],
)
def known(request) -> KnownTruth:
    name, calibrated = request.param
    rig = load_rig(RIGS / f"{name}.yaml")
    return KnownTruth(rig if calibrated else replaced(rig, {"calibrations": {}}), seed=1)


@pytest.mark.parametrize("sensor", SENSORS)
def test_depths_lie_in_their_intervals(known, sensor):
    """Below still water at rest, before zeroing; below the place of zeroing under way."""
    motion = known.motions[sensor]
    truth = at_sample(motion.depth, known.chosen) - motion.rest
    at_rest, under_way = np.zeros((2, TRIALS), dtype=bool)
    for trial in range(TRIALS):
        reader, resting = known.zeroed_sensor(sensor, trial)
        at_rest[trial] = abs(resting.depth - motion.rest[trial]) <= resting.depth_u95
        towed = reader.process(known.towed_scan(sensor, trial), ALL_VALID, known.drive)
        under_way[trial] = abs(towed.depth - truth[trial]) <= towed.depth_u95
    assert_covered(at_rest, "depth below still water")
    assert_covered(under_way, "depth below the place of zeroing")


def test_pitch_and_roll_lie_in_their_intervals(known):
    """Under way: the fish heaves and surges."""
    reader = Inclinometer(known.rig, BOARD)
    inside = np.zeros((2, TRIALS), dtype=bool)
    for trial in range(TRIALS):
        read = reader.process(known.accelerometer_scan(trial), ALL_VALID, known.drive)
        inside[0, trial] = abs(read.pitch - known.pitch[trial]) <= read.pitch_uncertainty.u95
        inside[1, trial] = abs(read.roll - known.roll[trial]) <= read.roll_uncertainty.u95
    assert_covered(inside[0], "pitch")
    assert_covered(inside[1], "roll")


def test_heave_ratios_lie_in_their_intervals(known):
    zeros = {
        sensor: known.depths(sensor, known.resting[sensor], 0.0).mean(axis=1) for sensor in SENSORS
    }
    heaves = {
        sensor: column(zeros[sensor]) - known.depths(sensor, known.towed[sensor], known.speed)
        for sensor in SENSORS
    }
    fish, depressor = (known.motions[sensor].amplitude for sensor in SENSORS)
    stamps = np.round(1e9 * known.time).astype(np.int64)
    crank = Series(stamps, known.crank_rate * known.time)
    inside = np.zeros((3, TRIALS), dtype=bool)
    for trial in range(TRIALS):
        series = (Series(stamps, heaves[sensor][trial]) for sensor in SENSORS)
        zero_depths = tuple(float(zeros[sensor][trial]) for sensor in SENSORS)
        samples = HeaveSamples("measured", crank, *series, zero_depths)
        result = analyse_window(samples, known.rig, 0, round(1e3 * known.time[-1]))
        inside[0, trial] = abs(result.ratio - fish[trial] / depressor[trial]) <= result.u95
        for row, body, true in ((1, result.fish, fish), (2, result.depressor, depressor)):
            inside[row, trial] = abs(body.amplitude - true[trial]) <= body.uncertainty.u95
    assert_covered(inside[0], "heave ratio")
    assert_covered(inside[1], "heave amplitude of the fish")
    assert_covered(inside[2], "heave amplitude of the depressor")


@pytest.mark.parametrize("name", ["nit_calicut_2012", "wu_chwang_2001"])
def test_rigs_allow_for_the_surge_that_the_simulator_gives(name):
    """First harmonic of the ports' speed along the tank, over the last six turns of the crank."""
    rig = load_rig(RIGS / f"{name}.yaml")
    duration = 2.0 + rig.run.ramp_time.value + 36.0
    history = simulate_plant(rig, trial_commands(rig, rest=2.0, steady=36.0), duration, segments=12)
    rate = rig.run.crank_rate.value
    late = history.time > duration - 6 * 2 * math.pi / rate
    time = history.time[late]
    fish = np.stack(to_tank(tuple(history.fish_quaternion.T), tuple(history.fish_velocity.T)))
    model = np.column_stack([np.ones_like(time), time, np.cos(rate * time), np.sin(rate * time)])
    for sensor, speed in zip(SENSORS, (fish[0], history.depressor_velocity[:, 0]), strict=True):
        _, _, cosine, sine = np.linalg.lstsq(model, speed[late], rcond=None)[0]
        limit = getattr(rig.sensors, sensor).errors.surge_speed.value
        assert 0.5 * limit < math.hypot(cosine, sine) <= limit, sensor
