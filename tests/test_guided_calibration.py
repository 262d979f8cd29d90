# SPDX-License-Identifier: Apache-2.0
"""Guided calibrations at the virtual board without a clock: the guide's questions, the real
firmware, the driver, least squares, the dated file, and a rig that is better for it."""

from __future__ import annotations

import datetime
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from offline_trial import ELF, VirtualBoard
from towtank_bag.recorder import bag_attachments
from towtank_bringup.plan import conversion_noise
from towtank_bringup.rigs import rig_path
from towtank_daq.board import Transport
from towtank_daq.description import installed_description, load_description
from towtank_lab import procedures
from towtank_lab.accelerometer_calibration import specific_force
from towtank_lab.board_readings import BoardReadings
from towtank_lab.calibration_record import (
    Circumstances,
    make_record,
    write_record,
    write_referring_rig,
)
from towtank_lab.errors import ProcedureError
from towtank_lab.guide import Station, Terminal, accelerometer_rows, crank_rows, pressure_rows
from towtank_lab.virtual_sensors import VirtualSensors
from towtank_rig import load_rig, parse_rig
from towtank_rig.check import calibration_warnings
from towtank_rig.conversion import (
    accelerometer_conversion,
    pitch,
    pressure_conversion,
    pressure_from_depth,
)
from towtank_rig.loading import replaced
from towtank_sim.bench_frame import bench_frame
from towtank_uncertainty import sensor_errors
from vboard import ResetCause

BARE = replaced(load_rig(rig_path("nit_calicut_2012")), {"calibrations": {}})
DESCRIPTION = load_description(installed_description())
_FRAME_NS = 5_000_000
_LEAD_NS = 20_000_000
_QUANTUM_NS = 200_000


class VirtualLine(Transport):
    """Transport and clock on a virtual board, and its bench: reading lets their time pass."""

    def __init__(self, board: VirtualBoard, sensors: VirtualSensors) -> None:
        self._board, self._sensors = board, sensors
        self._frames = 0
        board.run_until(_LEAD_NS)

    def monotonic_ns(self) -> int:
        return self._board.now_ns

    def write(self, data: bytes) -> None:
        self._board.write(data)

    def read(self, timeout_s: float) -> bytes:
        end_ns = self._board.now_ns + round(1e9 * timeout_s)
        while True:
            data = self._board.read()
            if data or self._board.now_ns >= end_ns:
                return data
            while self._frames * _FRAME_NS < self._board.now_ns + _LEAD_NS:
                self._frames += 1
                self._board.push_bench(
                    bench_frame(
                        self._frames,
                        self._frames * _FRAME_NS,
                        self._sensors.terminal_volts(),
                        self._sensors.crank_shaft(),
                        0.0,
                    )
                )
            self._board.run_until(min(end_ns, self._board.now_ns + _QUANTUM_NS))


class Laboratory:
    """A virtual board with drawn sensors, and somebody who answers every question in turn."""

    def __init__(self, board: VirtualBoard, answers: dict[int, str] | None = None) -> None:
        self.errors = sensor_errors.draw(BARE, seed=5)
        self.sensors = VirtualSensors(BARE, self.errors, tuple(DESCRIPTION.channel_names))
        line = VirtualLine(board, self.sensors)
        self.readings = BoardReadings(line, BARE, DESCRIPTION, print, line.monotonic_ns)
        noise = {
            channel.name: volts / channel.gain
            for channel, volts in zip(DESCRIPTION.channels, conversion_noise(BARE), strict=True)
        }
        self.asked: list[str] = []
        self.said: list[str] = []
        self._answers = answers or {}
        self.desk = Terminal(self._answer, self.said.append, lambda line: None)
        self.station = Station(self.sensors.move, self.readings.take, noise)

    def _answer(self, question: str) -> str:
        self.asked.append(question)
        return self._answers.get(len(self.asked), "")


@pytest.fixture(scope="module")
def board() -> Iterator[VirtualBoard]:
    with VirtualBoard(ELF, noise_volts=conversion_noise(BARE), seed=9) as virtual:
        yield virtual


@pytest.fixture(scope="module")
def laboratory(board) -> Laboratory:
    return Laboratory(board, {1: "nothing", 2: "0.01"})


@pytest.fixture(scope="module")
def immersed(laboratory):
    """Five immersions of one second, the first answered wrongly, then with the true depth."""
    depths = (0.0, 1.0, 2.0, 1.0, 0.0)
    args = (BARE, "fish_pressure", depths, 1.0, laboratory.desk, laboratory.station)
    return list(pressure_rows(*args)), list(laboratory.asked), list(laboratory.said)


def test_guide_asks_step_by_step_and_tells_what_it_reads(immersed):
    rows, asked, said = immersed
    assert [row["depth_m"] for row in rows] == [0.01, 1.0, 2.0, 1.0, 0.0]
    assert len(asked) == 6  # the first was answered by a word, and asked again
    assert "1/5: bring the port of fish_pressure 0.000 m below still water" in asked[0]
    assert "'nothing' is no number" in said[0]
    assert said[1].endswith(f"over {rows[0]['volts_samples']} samples")
    assert all(95 <= row["volts_samples"] <= 105 for row in rows)
    channel = DESCRIPTION.adc_channel("fish_pressure", BARE.board.excitation.value)
    for row in rows:  # the mean of codes is the code of the mean, but for rounding it to a whole
        assert channel.codes(row["volts"]) == pytest.approx(row["volts_code"], abs=1.0)


def test_calibrated_rig_reads_the_drawn_sensor(laboratory, immersed, tmp_path):
    """From data sheet to record to rig. Truth: what the drawn sensor gives at 1.5 m, where no
    immersion was. Its bend of at most 0.25 % of full scale, 125 Pa, stays."""
    rows, *_ = immersed
    evaluation = procedures.evaluate_pressure(
        BARE, "fish_pressure", rows, tape_limit=5e-4, zero_limit=2e-3
    )
    made = datetime.datetime(2026, 11, 25, 10, 15, tzinfo=datetime.UTC)
    circumstances = Circumstances(
        made, "A. Tester", "the bench itself", datetime.timedelta(days=30),
        laboratory.readings.identity, laboratory.readings.conditions("excitation"),
    )  # fmt: skip
    record = make_record(BARE, evaluation, rows, circumstances)
    source = tmp_path / "bare.yaml"
    source.write_text(BARE.text)
    path, plot = write_record(record, evaluation.residuals, tmp_path / "calibrations")
    assert path.name == "fish_pressure-20261125T101500Z.yaml"
    assert plot.read_text().startswith("<?xml") and "depth, m" in plot.read_text()
    new = tmp_path / "calibrated.yaml"
    write_referring_rig(source, record, path, new)

    rig = load_rig(new)
    assert rig.name == "calibrated"
    laboratory.sensors.move({"depth_m": 1.5})
    volts = laboratory.sensors.terminal_volts()[0]
    true = float(pressure_from_depth(1.5, BARE.water))
    ratio = BARE.board.excitation.value / laboratory.errors.excitation  # what the ADC does
    errors = [
        abs(float(pressure_conversion(r, "fish_pressure").pressure(volts * ratio)) - true)
        for r in (BARE, rig)
    ]
    assert errors[1] < 125.0 < errors[0]

    # Everything is in the bag: the rig's text stands alone, the record lies beside it
    assert dict(parse_rig(rig.text).quantities()) == dict(rig.quantities())
    attached = {a.name: a.data.decode() for a in bag_attachments(rig)}
    assert attached[f"calibrations/{path.name}"] == path.read_text()
    assert "made_by: A. Tester" in path.read_text()
    measured = record.conditions["excitation_V"]
    assert measured == pytest.approx(laboratory.errors.excitation, rel=1e-3)
    assert 0.0 < record.conditions["adc_temperature_degC"] < 60.0
    assert record.board is not None and len(record.board.schema_hash) == 8
    warnings = calibration_warnings(rig, datetime.date(2026, 12, 26))
    assert any("fish_pressure" in line and "was due on 2026-12-25" in line for line in warnings)

    # Nothing is written twice, nothing half
    before = path.read_bytes()
    with pytest.raises(ProcedureError, match="exists"):
        write_record(record, evaluation.residuals, tmp_path / "calibrations")
    with pytest.raises(ProcedureError, match="exists"):
        write_referring_rig(source, record, path, new)
    assert path.read_bytes() == before
    assert not list(tmp_path.rglob("*.part"))


def _dated(section: dict[str, object]) -> dict[str, object]:
    return {"id": "six-positions", "date": "2026-11-25", **section}


def test_six_positions_at_the_board(laboratory):
    """Zeros within their intervals; the non-linearity of up to 0.5 % of 2 g is not fitted, and what
    it does is even in the force: it shows in the zero, by at most its size."""
    rows = list(accelerometer_rows(BARE, [(10.0, 20.0)], 1.0, laboratory.desk, laboratory.station))
    assert "7/7: tilt the upright fish to roll 10, pitch 20" in laboratory.asked[-1]
    evaluation = procedures.evaluate_accelerometer(BARE, rows, level_limit=1e-6)
    found = {f.name: f for f in evaluation.findings}
    # Three positions and their opposites tell the directions of the axes, bend or not
    read = replaced(BARE, {"calibrations": {"accelerometer": _dated(evaluation.section)}})
    tilted = laboratory.errors.accelerometer.volts(specific_force(0.1, 0.2, 9.782))
    angles = [
        abs(float(pitch(accelerometer_conversion(rig).specific_force(tilted))) - 0.2)
        for rig in (BARE, read)
    ]
    assert angles[1] < 0.01 < angles[0]  # the bend of 0.098 m/s² over g
    sensor = laboratory.errors.accelerometer
    true_zero = sensor.conversion.zero_g + sensor.zero_g
    true_slope = sensor.conversion.sensitivity * (1.0 + sensor.sensitivity)
    bend = np.abs(sensor.nonlinearity) * true_slope
    for index, axis in enumerate("xyz"):
        assert abs(found[f"{axis}: zero"].value - true_zero[index]) < 1.1 * bend[index] + 1e-4
        # Second order of coupling and misalignment, 2 % and 0.02 rad, and of the bend
        assert found[f"{axis}: sensitivity"].value == pytest.approx(true_slope[index], rel=3e-3)


def test_crank_at_the_board(laboratory):
    angles = (0, 90, 180, 270, 360, 450)
    rows = list(crank_rows(angles, False, 1.0, laboratory.desk, laboratory.station))
    evaluation = procedures.evaluate_crank(BARE, rows, mark_limit=0.0)
    assert evaluation.section["counts_per_revolution"] == 4096
    assert evaluation.section["direction"] == 1
    assert [row["counts"] - rows[0]["counts"] for row in rows] == pytest.approx(
        [0, 1024, 2048, 3072, 4096, 5120], abs=1
    )


def test_crank_of_a_board_that_was_reset_between_marks(laboratory, board):
    rows = crank_rows((0, 90), False, 1.0, laboratory.desk, laboratory.station)
    next(rows)
    board.reset(ResetCause.BROWN_OUT)
    with pytest.raises(ProcedureError, match="the board was reset since the mark before"):
        next(rows)


def test_unsteady_sensor_is_read_again(laboratory):
    """Somebody still lowers the sensor during the first reading."""
    taken = []

    def take(seconds, show):
        reading = laboratory.readings.take(seconds, show)
        taken.append(reading)
        if len(taken) == 1:
            moved = {
                name: replace(channel, scatter=1e3 * channel.scatter)
                for name, channel in reading.channels.items()
            }
            return replace(reading, channels=moved)
        return reading

    at = Station(laboratory.sensors.move, take, laboratory.station.noise)
    asked = len(laboratory.asked)
    rows = list(pressure_rows(BARE, "fish_pressure", (0.5,), 1.0, laboratory.desk, at))
    assert len(taken) == 2 and len(rows) == 1
    assert "unsteady: fish_pressure scatters by" in laboratory.asked[asked + 1]
