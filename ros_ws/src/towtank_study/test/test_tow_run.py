# SPDX-License-Identifier: Apache-2.0
"""What is measured on a run."""

import math
from dataclasses import replace

import numpy as np
import pytest
from towtank_compare.harmonic import AnalysisError
from towtank_rig import load_rig
from towtank_rig.loading import replaced
from towtank_study.simulation import Simulation
from towtank_study.tow_run import OUTPUTS, Record, TowRun, largest_slack_time, measure, simulate


@pytest.fixture(scope="module")
def wu_chwang(rigs):
    return load_rig(rigs / "wu_chwang_2001.yaml")


def test_amplitudes_ratio_and_phase_of_a_made_up_run():
    angle = np.linspace(0.0, 8 * 2 * math.pi, 8 * 64 + 1)
    time = angle / (2 * math.pi * 0.5)
    drift = 1e-3 * time - 2e-4 * time**2
    record = Record(
        time=time,
        tow_point=0.1 * np.sin(angle),
        depressor=-3.0 + 0.08 * np.cos(angle - 0.3),
        fish={
            "nose": -2.0 + drift + 0.02 * np.cos(angle - 0.8) + 0.001 * np.cos(2 * angle),
            "port": -2.0 + 0.01 * np.cos(angle - 0.3),
            "middle": -2.1 + 0.01 * np.cos(angle),
        },
        pitch=0.1 + 0.05 * np.sin(angle),
        top_tension=50.0 + 9.0 * np.sin(angle),
        slack=np.zeros(len(time), dtype=bool),
    )
    half = replace(record, fish=record.fish | {"nose": record.depressor / 2})
    run = TowRun(
        periods=8,
        first=half,
        measured=record,
        crank_angle=angle,
        solver={"steps": 7, "newton_iterations": 9, "halvings": 0, "snaps": 0},
    )
    found = measure(run)
    assert list(found) == list(OUTPUTS)
    expected = {
        "crank_frequency": 0.5,
        "tow_point_heave": 0.1,
        "depressor_heave": 0.08,
        "fish_heave_nose": 0.02,
        "heave_ratio_nose": 0.25,
        "heave_phase_nose": -math.degrees(0.5),
        "heave_phase_port": 0.0,
        "heave_phase_middle": math.degrees(0.3),
        "peak_to_peak_ratio_port": 0.125,
        "first_40_s_ratio_nose": 0.5,
        "fish_pitch_amplitude": math.degrees(0.05),
        "top_tension_amplitude": 9.0,
        "newton_iterations": 9,
    }
    # The fit holds all of it: cubic drift, the harmonics. Extremes fall between samples by at most
    # 1 − cos(π/64) = 0.12 %.
    for name, value in expected.items():
        exact = not name.startswith(("peak_to_peak", "first_40_s", "top_tension_amplitude"))
        tolerance = {"abs": 1e-9, "rel": 1e-9} if exact else {"rel": 1.3e-3}
        assert found[name] == pytest.approx(value, **tolerance), name
    for name, value in {
        "depressor_depth": 3.0,
        "fish_depth": 2.1,
        "fish_pitch": math.degrees(0.1),
        "top_tension": 50.0,
    }.items():
        assert found[name] == pytest.approx(value, rel=1e-12), name


def test_largest_slack_time():
    time = np.arange(8) * 0.1
    slack = np.array([1, 0, 1, 1, 1, 0, 1, 1], dtype=bool)
    assert largest_slack_time(time, slack) == pytest.approx(0.3)
    assert largest_slack_time(time, np.zeros(8, dtype=bool)) == 0.0


def test_the_wu_chwang_tow_as_moordyn_has_it(wu_chwang):
    """MoorDyn 2.7.2: 75.4 mm, 10.1 mm at the nose, 2.54 mm at mid-hull, 54.4 N ± 9.3 N. The rig
    differs from that model by 0.4 % of the depressor's mass and 1 % of the fish's inertia."""
    found = measure(simulate(wu_chwang, Simulation()))
    assert found["depressor_heave"] == pytest.approx(75.4e-3, rel=0.01)
    assert found["fish_heave_nose"] == pytest.approx(10.1e-3, rel=0.025)
    assert found["fish_heave_middle"] == pytest.approx(2.54e-3, rel=0.025)
    assert found["top_tension"] == pytest.approx(54.4, rel=0.01)
    assert found["top_tension_amplitude"] == pytest.approx(9.3, rel=0.02)
    assert found["tow_point_heave"] == pytest.approx(0.1, rel=1e-6)
    assert found["largest_slack_time"] == found["snaps"] == found["halvings"] == 0


def test_a_crank_at_rest_is_refused(wu_chwang):
    with pytest.raises(AnalysisError, match="does not turn"):
        simulate(replaced(wu_chwang, {"run.crank_rate": 0.0}), Simulation())
