# SPDX-License-Identifier: Apache-2.0
"""One simulated run of a rig's tow, and the numbers that a study takes from it."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from towtank_compare.harmonic import AnalysisError, Harmonic, fit_first_harmonic
from towtank_compare.heave import MIN_AMPLITUDE_M
from towtank_compare.kinematics import bow_up_pitch
from towtank_compare.peak_to_peak import read_peak_to_peak
from towtank_compare.places import mid_hull, nose, pressure_port
from towtank_compare.series import Series
from towtank_rig import Rig
from towtank_sim.model import LINES, build_model

import sim_core as sc
from towtank_study.simulation import Simulation

Array = NDArray[np.float64]

PLACES = {"nose": nose, "port": pressure_port, "middle": mid_hull}
"""Places on the fish at which its heave is taken; `port` is that of the pressure sensor."""

OUTPUTS: dict[str, str] = {
    "crank_frequency": "Hz",
    "tow_point_heave": "m",
    "depressor_heave": "m",
    **{f"fish_heave_{place}": "m" for place in PLACES},
    **{f"heave_ratio_{place}": "1" for place in PLACES},
    **{f"heave_phase_{place}": "deg" for place in PLACES},
    **{f"peak_to_peak_ratio_{place}": "1" for place in PLACES},
    **{f"first_40_s_ratio_{place}": "1" for place in PLACES},
    "depressor_depth": "m",
    "fish_depth": "m",
    "fish_pitch": "deg",
    "fish_pitch_amplitude": "deg",
    "top_tension": "N",
    "top_tension_amplitude": "N",
    "largest_slack_time": "s",
    "steps": "1",
    "newton_iterations": "1",
    "halvings": "1",
    "snaps": "1",
}
"""Names and units of all outputs.

Heaves are amplitudes of the first harmonic at the crank frequency; a ratio is that of the fish over
that of the depressor, its phase that of the fish less that of the depressor. `peak_to_peak_ratio`
is read as the thesis does. Depths, pitch (bow up) and tension are means over the measured periods,
`fish_pitch_amplitude` is a first harmonic, `top_tension_amplitude` half of peak to peak.
`largest_slack_time` is the longest time for which some segment is slack. The statistics of the
solver count the whole run.
"""

SLACK_SHARE = 0.01
"""A segment with less tension than this share of its line's weight in air is slack: below it
sim_core rounds the tension off to zero."""


FIRST_S = 40.0
"""Length of the record that the thesis reads."""


@dataclass(frozen=True)
class Record:
    """Samples of one stretch of a run.

    time: s, shape (n,). tow_point, depressor: height, m, (n,). fish: height by place, m, (n,).
    pitch: bow up, rad, (n,). top_tension: of the primary line at the tow point, N, (n,). slack:
    whether some segment is, (n,).
    """

    time: Array
    tow_point: Array
    depressor: Array
    fish: dict[str, Array]
    pitch: Array
    top_tension: Array
    slack: NDArray[np.bool_]


@dataclass(frozen=True)
class TowRun:
    """A simulated run. first: its first FIRST_S, or None. measured: `periods` whole crank periods
    after the settling time, both ends included. crank_angle: of the samples of measured, rad."""

    periods: int
    first: Record | None
    measured: Record
    crank_angle: Array
    solver: dict[str, int]


def simulate(rig: Rig, simulation: Simulation) -> TowRun:
    """Run the rig's tow from its steady state and record the beginning and the measured periods.

    Raises sim_core's InvalidInput and ConvergenceError, ModelError, and AnalysisError for a crank
    that does not turn, or not yet evenly.
    """
    rate = rig.run.crank_rate.value
    if rate == 0.0 or rig.tow_point.motion.crank_radius.value == 0.0:
        raise AnalysisError("the crank does not turn")
    settling = simulation.settling_time.value
    if settling < rig.run.ramp_time.value:
        raise AnalysisError("settling_time ends before the crank's ramp")
    period = 2 * math.pi / rate
    model = build_model(rig, simulation.segments)
    motion, angle = _tow_point_law(rig, period)
    integrator = sc.parse_integrator(simulation.integrator)()
    results: list[sc.Result] = []

    def run_to(end: float, output_step: float) -> sc.Result:
        result = sc.run(
            model,
            motion,
            state=results[-1].final_state if results else None,
            t_end=end,
            output_step=output_step,
            integrator=integrator,
            max_step=simulation.step.value,
        )
        results.append(result)
        return result

    sampling = period / simulation.samples_per_period
    first = _record(rig, run_to(FIRST_S, sampling)) if settling >= FIRST_S else None
    run_to(settling, FIRST_S)
    measured = _record(rig, run_to(settling + simulation.periods * period, sampling))
    return TowRun(
        periods=simulation.periods,
        first=first,
        measured=measured,
        crank_angle=angle(measured.time),
        solver={
            name: sum(getattr(result, name) for result in results)
            for name in ("steps", "newton_iterations", "halvings", "snaps")
        },
    )


def _record(rig: Rig, result: sc.Result) -> Record:
    fish = result.bodies["fish"]
    return Record(
        time=result.time,
        tow_point=result.points["tow_point"].position[:, 2],
        depressor=result.points["depressor"].position[:, 2],
        fish={name: fish.position_of(place(rig).position)[:, 2] for name, place in PLACES.items()},
        pitch=bow_up_pitch(np.roll(fish.quaternion, -1, axis=1)),
        top_tension=result.lines["primary"].start_tension,
        slack=np.any([_is_slack(rig, name, result.lines[name]) for name in LINES], axis=0),
    )


def measure(run: TowRun) -> dict[str, float]:
    """Return all OUTPUTS of a run; AnalysisError where its heave allows no result."""
    record, start = run.measured, float(run.crank_angle[0])

    def harmonic(values: Array) -> Harmonic:
        return fit_first_harmonic(values, run.crank_angle, start, run.periods)

    depressor = harmonic(record.depressor)
    if depressor.amplitude < MIN_AMPLITUDE_M:
        raise AnalysisError("the depressor does not heave: there is no ratio")
    outputs = {
        "crank_frequency": (run.crank_angle[-1] - start) / (2 * math.pi) / np.ptp(record.time),
        "tow_point_heave": harmonic(record.tow_point).amplitude,
        "depressor_heave": depressor.amplitude,
        "depressor_depth": -_mean(record.depressor),
        "fish_depth": -_mean(record.fish["middle"]),
        "fish_pitch": math.degrees(_mean(record.pitch)),
        "fish_pitch_amplitude": math.degrees(harmonic(record.pitch).amplitude),
        "top_tension": _mean(record.top_tension),
        "top_tension_amplitude": np.ptp(record.top_tension) / 2,
        "largest_slack_time": largest_slack_time(record.time, record.slack),
        **run.solver,
    }
    for place in PLACES:
        fish = harmonic(record.fish[place])
        outputs[f"fish_heave_{place}"] = fish.amplitude
        outputs[f"heave_ratio_{place}"] = fish.amplitude / depressor.amplitude
        outputs[f"heave_phase_{place}"] = math.degrees(cmath.phase(fish.value / depressor.value))
        outputs[f"peak_to_peak_ratio_{place}"] = _peak_to_peak_ratio(record, place)
        outputs[f"first_40_s_ratio_{place}"] = (
            _peak_to_peak_ratio(run.first, place) if run.first else math.nan
        )
    return {name: float(outputs[name]) for name in OUTPUTS}


def _peak_to_peak_ratio(record: Record, place: str) -> float:
    stamps = np.round(record.time * 1e9).astype(np.int64)
    fish, depressor = Series(stamps, record.fish[place]), Series(stamps, record.depressor)
    return read_peak_to_peak(fish, depressor).ratio


def _mean(values: Array) -> float:
    return float(values[:-1].mean())  # the last sample begins another period


def largest_slack_time(time: Array, slack: NDArray[np.bool_]) -> float:
    """Return the longest time, s, over which samples in a row are slack.

    time: s, (n,), evenly spaced; each slack sample counts for one interval.
    """
    changes = np.diff(np.concatenate(([0], slack, [0])).astype(int))
    lengths = np.flatnonzero(changes == -1) - np.flatnonzero(changes == 1)
    return float(lengths.max(initial=0) * (time[1] - time[0]))


def _is_slack(rig: Rig, name: str, history: sc.LineHistory) -> NDArray[np.bool_]:
    line = getattr(rig.lines, name)
    weight = line.mass_per_length.value * line.length.value * rig.water.gravity.value
    return np.any(history.tensions < SLACK_SHARE * weight, axis=1)


def _tow_point_law(rig: Rig, period: float) -> tuple[sc.Motion, Callable[[Array], Array]]:
    """Return the tow point's motion and its crank angle (rad) over time (s) after the start."""
    motion, run = rig.tow_point.motion, rig.run
    common = {
        "mean": (0.0, 0.0, rig.tow_point.height.value),
        "velocity": (run.carriage_speed.value, 0.0, 0.0),
        "period": period,
        "ramp_time": run.ramp_time.value,
    }
    rate = 2 * math.pi / period
    if motion.kind == "sine":
        law = sc.Sinusoid(amplitude=motion.crank_radius.value, **common)
        return law, lambda time: rate * time
    assert motion.rod_length is not None  # the schema demands it of a slider crank
    law = sc.SliderCrank(
        crank_radius=motion.crank_radius.value, rod_length=motion.rod_length.value, **common
    )
    # The crank speeds up from rest within the ramp.
    return law, lambda time: rate * (time - run.ramp_time.value / 2)
