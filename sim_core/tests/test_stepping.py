# SPDX-License-Identifier: Apache-2.0
"""The step interface, as real-time users need it."""

import threading

import numpy as np
import pytest

import sim_core as sc


@pytest.fixture
def start(nit_model):
    model = nit_model(segments=(6, 2, 4))
    return model, sc.steady_tow(model, position=(0, 0, 0.2), velocity=(1, 0, 0))


MOTION = sc.Sinusoid(mean=(0, 0, 0.2), velocity=(1, 0, 0), amplitude=0.06, period=2, ramp_time=2)


def test_live_samples_follow_the_law(start):
    """Cubic through samples every 10 ms: off by (ωΔt)⁴/384 of the amplitude, so by 1e-10 m."""
    model, state = start
    law, live = (sc.Simulator(model, state, max_step=0.005) for _ in range(2))
    for i in range(1, 401):
        t = 0.01 * i
        sample = MOTION(t)
        law.step(t, MOTION)
        live.step_to(t, sample.position, sample.velocity)
    assert live.time == law.time
    assert live.node_positions("primary") == pytest.approx(law.node_positions("primary"), abs=1e-7)
    # tension feels the cubic's jumps in the third derivative: h² × Δt × ω³ A of acceleration × mass
    assert live.tensions("primary") == pytest.approx(law.tensions("primary"), abs=2e-2)


def test_tow_point_moves_inside_the_step(wu_chwang_model):
    """The range of the top tension hardly depends on the step: the law is evaluated in each."""
    model = wu_chwang_model()
    motion = sc.SliderCrank(
        mean=(0, 0, -2), velocity=(1.75, 0, 0), crank_radius=0.1, rod_length=0.35, period=1.6,
        ramp_time=5,
    )  # fmt: skip
    ranges = []
    for step in (0.02, 0.0025):
        result = sc.run(model, motion, t_end=15.0, output_step=0.02, max_step=step)
        ranges.append(np.ptp(result.lines["primary"].start_tension[result.time > 10]))
    assert ranges[0] == pytest.approx(ranges[1], rel=0.01)


def test_ends_exactly_at_the_time_asked_for(start):
    model, state = start
    simulator = sc.Simulator(model, state, max_step=0.005)
    for t in (0.0123, 0.1, 0.1, 1 / 3):
        simulator.step(t, MOTION)
        assert simulator.time == t
    assert simulator.steps == 3 + 18 + 0 + 47
    assert simulator.point_position("tow_point") == pytest.approx(MOTION(1 / 3).position)


def test_other_threads_run_while_stepping(start):
    model, state = start
    simulator = sc.Simulator(model, state)
    done = threading.Event()

    def work():
        simulator.step(60.0, MOTION)
        done.set()

    thread = threading.Thread(target=work)
    thread.start()
    turns = 0
    while not done.is_set():
        turns += 1
    thread.join()
    # With the GIL held throughout, the loop would get one turn before the steps and one after.
    assert turns > 100


def test_run_records_what_the_simulator_shows(start):
    model, state = start
    result = sc.run(model, MOTION, t_end=1.0, output_step=0.3, state=state)
    assert result.time == pytest.approx([0, 0.3, 0.6, 0.9, 1.0])
    simulator = sc.Simulator(model, state)
    for t in result.time[1:]:
        simulator.step(t, MOTION)
    fish = result.bodies["fish"]
    assert fish.position[-1].tolist() == simulator.body_position("fish").tolist()
    assert fish.quaternion[-1].tolist() == simulator.body_quaternion("fish").tolist()
    assert fish.angular_velocity[-1].tolist() == simulator.body_angular_velocity("fish").tolist()
    assert (
        result.lines["secondary"].tensions[-1].tolist() == simulator.tensions("secondary").tolist()
    )
    assert (
        result.lines["primary"].node_positions[-1].tolist()
        == simulator.node_positions("primary").tolist()
    )
    nose = fish.position_of((0.65, 0, 0))[-1]
    assert nose == pytest.approx(result.lines["secondary"].node_positions[-1, -1], abs=1e-12)
    assert result.final_state.time == 1.0


def test_failure_names_place_and_time_and_keeps_the_last_good_state(start):
    model, state = start
    simulator = sc.Simulator(model, state)
    simulator.step(0.1, MOTION)
    saved = simulator.save()
    with pytest.raises(sc.ConvergenceError, match=r"(line|point|body) '.*' .*t = [0-9.e-]+ s"):
        simulator.step_to(0.11, (1e9, 0, 0), (0, 0, 0))
    assert simulator.time < 0.11
    assert np.isfinite(simulator.node_positions("primary")).all()
    simulator.restore(saved)
    simulator.step(0.2, MOTION)
    assert simulator.time == 0.2


def test_refuses_bad_arguments(start):
    model, state = start
    simulator = sc.Simulator(model, state)
    simulator.step(0.1, MOTION)
    with pytest.raises(ValueError, match="before the present time"):
        simulator.step(0.05, MOTION)
    with pytest.raises(ValueError, match="finite"):
        simulator.step_to(0.2, (float("nan"), 0, 0), (1, 0, 0))
    with pytest.raises(ValueError, match="t_end"):
        simulator.step_to(0.1, (0, 0, 0), (1, 0, 0))
    with pytest.raises(ValueError, match="no line 'secundary'; there are 'primary'"):
        simulator.tensions("secundary")
    with pytest.raises(ValueError, match="max_step"):
        sc.Simulator(model, state, max_step=0.0)
    assert simulator.time == 0.1
