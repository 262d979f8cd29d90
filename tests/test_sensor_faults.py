# SPDX-License-Identifier: Apache-2.0
"""Broken sensors and wires, from the volts at the terminals to the flags that tell of them: virtual
bench, front ends and ADC, the real firmware, driver, and the judgement of the sensor nodes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from offline_trial import ELF, START_NS, acquire
from towtank_bringup.plan import conversion_noise
from towtank_bringup.rigs import rig_path
from towtank_daq.description import installed_description, load_description
from towtank_daq.sensor_health import AccelerometerHealth, PressureHealth
from towtank_node.health import Health
from towtank_rig import load_rig
from towtank_sim.offline import PlantHistory, bench_frames
from towtank_sim.terminal_faults import parse_faults
from towtank_uncertainty import sensor_errors
from vboard import VirtualBoard

RIG = load_rig(rig_path("nit_calicut_2012"))
BOARD = load_description(installed_description())
DURATION_S = 16.0
CRANK_HZ = 0.5

# Sensor, fault, and what must be told between the two times after the start and stop of the fault:
# at once, or when the block of a second or the turn of two seconds that follows is full.
AT_ONCE, BLOCK, TURN = (0.1, 0.1), (2.1, 2.1), (4.1, 2.1)
FAULTS = (
    ("fish_pressure", "fish_pressure:open@2-3", Health.OPEN, AT_ONCE),
    ("fish_pressure", "fish_pressure:short@5-7.5", Health.SHORT, BLOCK),
    ("fish_pressure", "fish_pressure:noisy@9.8-12.4", Health.NOISE, BLOCK),
    ("depressor_pressure", "depressor_pressure:stuck@2-8", Health.STUCK, TURN),
    ("depressor_pressure", "excitation:low@14-15", Health.EXCITATION, AT_ONCE),
    ("fish_pressure", "excitation:low@14-15", Health.EXCITATION, AT_ONCE),
    # Its scale ends at the supply, a little above where the ADC's buffer does: not saturated.
    ("accelerometer", "accel_x:open@2-3", Health.OPEN, AT_ONCE),
    ("accelerometer", "accel_y:short@5-6", Health.SHORT, AT_ONCE),
    ("accelerometer", "accel_z:noisy@9-11.6", Health.NOISE, BLOCK),
)


def history() -> PlantHistory:
    """A tow in steady heave, its crank turning, from the first to the last instant."""
    time = np.arange(0.0, DURATION_S, 0.01)
    turn = 2 * math.pi * CRANK_HZ * time
    zeros, ones = np.zeros_like(time), np.ones_like(time)
    level = np.stack((ones, zeros, zeros, zeros), axis=-1)
    return PlantHistory(
        time=time,
        fish_position=np.stack((time, zeros, -1.4 + 0.012 * np.cos(turn)), axis=-1),
        fish_quaternion=level,
        depressor_position=np.stack((time, zeros, -1.1 + 0.05 * np.cos(turn)), axis=-1),
        top_tension=zeros,
        crank_angle=turn,
        crank_rate=2 * math.pi * CRANK_HZ * ones,
        carriage_position=time,
        carriage_speed=ones,
        fish_velocity=np.stack((ones, zeros, zeros), axis=-1),
        fish_angular_velocity=np.zeros((len(time), 3)),
        specific_force=np.stack((zeros, zeros, RIG.water.gravity.value * ones), axis=-1),
        depressor_velocity=np.stack((ones, zeros, zeros), axis=-1),
    )


@pytest.fixture(scope="module")
def told() -> dict[str, list[tuple[float, Health]]]:
    """What each sensor's node tells at each scan: s after the start, flags."""
    faults = parse_faults(",".join({fault: None for _, fault, _, _ in FAULTS}))
    errors = sensor_errors.draw(RIG, seed=4)
    frames = bench_frames(history(), RIG, errors, START_NS, faults)
    with VirtualBoard(
        ELF,
        crank_counts_per_revolution=RIG.sensors.crank_encoder.counts_per_revolution,
        carriage_counts_per_revolution=RIG.sensors.carriage_encoder.counts_per_revolution,
        noise_volts=conversion_noise(RIG),
        seed=4,
    ) as virtual:
        scans = acquire(virtual, BOARD, frames, DURATION_S)
    found: dict[str, list[tuple[float, Health]]] = {}
    for sensor in ("fish_pressure", "depressor_pressure"):
        health = PressureHealth(RIG, BOARD, sensor)
        found[sensor] = [(_time(s), health.update(s.codes, s.valid_mask, s.crank)) for s in scans]
    accelerometer = AccelerometerHealth(RIG, BOARD)
    found["accelerometer"] = [
        (_time(s), accelerometer.update(s.codes, s.valid_mask)) for s in scans
    ]
    return found


def _time(scan) -> float:
    return (scan.stamp_ns - START_NS) * 1e-9


@pytest.mark.parametrize("sensor, text, flags, delays", FAULTS, ids=[f[1] for f in FAULTS])
def test_fault_is_told_while_it_lasts(told, sensor, text, flags, delays):
    (fault,) = parse_faults(text)
    end = fault.stop - 0.02  # volts go from one bench frame to the next on a straight line
    during = [f for t, f in told[sensor] if fault.start + delays[0] <= t < end]
    assert len(during) > 30
    assert all(flags in f for f in during)


@pytest.mark.parametrize("sensor", ["fish_pressure", "depressor_pressure", "accelerometer"])
def test_nothing_is_told_of_sound_sensors(told, sensor):
    """From a second after the start, when the first block is full, and but for the faults and the
    blocks and turns that they reach into."""
    faults = [(*parse_faults(text), delays) for s, text, _, delays in FAULTS if s == sensor]
    sound = [
        (t, f)
        for t, f in told[sensor]
        if not any(fault.start - 0.05 <= t < fault.stop + d[1] for fault, d in faults)
    ]
    assert len(sound) > 300
    assert [(t, f) for t, f in sound if f] == []
