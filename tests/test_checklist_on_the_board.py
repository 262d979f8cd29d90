# SPDX-License-Identifier: Apache-2.0
"""The check list of a bring-up on the real firmware in the virtual board."""

from __future__ import annotations

import math

import numpy as np
from offline_trial import ELF
from towtank_bringup.plan import conversion_noise
from towtank_bringup.rigs import rig_path
from towtank_daq.board import AdcBoard
from towtank_daq.description import installed_description, load_description
from towtank_daq.doctor import REST_S, examine
from towtank_daq.noise import noise_margin
from towtank_daq.protocol import Protocol
from towtank_lab.virtual_sensors import VirtualSensors
from towtank_rig import load_rig
from towtank_uncertainty.sensor_errors import draw
from towtank_workshop.checklist import Step, as_recorded, check_list
from vboard import VirtualBoard
from virtual_line import MS, VirtualLine

RIG = as_recorded(load_rig(rig_path("nit_calicut_2012")))
BOARD = load_description(installed_description())
SECONDS = 2.0
WHEEL_M = RIG.sensors.carriage_encoder.wheel_circumference.value


def test_a_sound_board_reads_what_the_list_says():
    """Sensors drawn from the rig's errors, at rest in air: mean codes of each channel within the
    list's limits, and doctor's limits are the list's where the list says that doctor checks."""
    sensors = VirtualSensors(RIG, draw(RIG, 7), tuple(BOARD.channel_names))
    at_rest = [(volts, 0.0) for volts in sensors.terminal_volts()]
    with VirtualBoard(ELF, seed=7, noise_volts=conversion_noise(RIG)) as virtual:
        line = VirtualLine(virtual, at_rest, (0.0, 0.0))
        line.run(20 * MS)
        scans = []
        board = AdcBoard(
            line, Protocol(BOARD), scans.append, print, line.monotonic_ns, patience_s=0.0
        )

        def passed(passed_s: float) -> None:
            moving = REST_S <= passed_s < SECONDS
            line.crank_rate = line.carriage_rate = 2 * math.pi / (SECONDS - REST_S) * moving

        found = examine(
            board, scans, RIG, BOARD, seconds=SECONDS, turns=1.0, travel=WHEEL_M, passed=passed
        )
    steps = {step.title: step for step in check_list(RIG, BOARD)}
    codes = np.mean([scan.codes for scan in scans], axis=0)
    in_air = {item.what: item.readings[0] for item in steps["At rest in air"].items}
    assert list(in_air) == BOARD.channel_names
    for code, reading in zip(codes, in_air.values(), strict=True):
        assert reading.minimum <= code <= reading.maximum
    assert found.failures == []

    def limits_of(step: Step) -> list[tuple[float, float]]:
        return [(item.readings[-1].minimum, item.readings[-1].maximum) for item in step.items]

    judged = {(c.minimum, c.maximum) for c in found.checks["self-test"] if c.unit == "V"}
    assert judged == set(limits_of(steps["Self-test"]))
    margins = (1.0 + noise_margin(len(scans))) / (1.0 + noise_margin(1000))
    for check, (low, high) in zip(found.checks["noise"], limits_of(steps["Noise"]), strict=True):
        assert np.isclose(check.minimum, low) and np.isclose(check.maximum, high * margins)
    judged = {check.name: check for check in found.checks["encoders"]}
    by_hand = steps["Encoders and crank"].items
    for name, item, counts_per in zip(("crank", "carriage"), by_hand, (4096, 8192), strict=False):
        check, counts = judged[name], item.readings[0]
        assert item.doctor and item.what.startswith(name)
        slack = (check.maximum - check.minimum) * counts_per
        assert np.isclose(slack, counts.maximum - counts.minimum)
