# SPDX-License-Identifier: Apache-2.0
"""States are saved, restored and copied exactly."""

import pytest

import sim_core as sc

MOTION = sc.Sinusoid(mean=(0, 0, 0.2), velocity=(1, 0, 0), amplitude=0.06, period=2, ramp_time=2)


@pytest.fixture
def simulator(nit_model):
    model = nit_model()
    start = sc.steady_tow(model, position=(0, 0, 0.2), velocity=(1, 0, 0))
    simulator = sc.Simulator(model, start)
    simulator.step(1.003, MOTION)  # steps of a size of their own
    return simulator


def test_restored_run_continues_bit_for_bit(simulator):
    saved = simulator.save()
    simulator.step(3.0, MOTION)
    end = simulator.save()
    simulator.restore(saved)
    assert simulator.save() == saved
    simulator.step(3.0, MOTION)
    assert simulator.save() == end


def test_restored_in_a_new_simulator(simulator):
    other = sc.Simulator(simulator.model, sc.State(simulator.model))
    other.restore(simulator.save())
    for s in (simulator, other):
        s.step(2.0, MOTION)
    assert other.save() == simulator.save()
    assert other.tensions("primary").tolist() == simulator.tensions("primary").tolist()


def test_copy_is_independent_and_exact(simulator):
    copy = simulator.copy()
    before = copy.save()
    simulator.step(2.0, MOTION)
    assert copy.save() == before
    copy.step(2.0, MOTION)
    assert copy.save() == simulator.save()


def test_simulator_started_from_a_copied_state_continues_alike(simulator):
    other = sc.Simulator(simulator.model, simulator.state)
    for s in (simulator, other):
        s.step(2.0, MOTION)
    assert other.save() == simulator.save()


def test_continues_bit_for_bit_amid_snaps(nit_model):
    model = nit_model()
    motion = sc.Sinusoid(
        mean=(0, 0, 0.2),
        velocity=(1, 0, 0),
        amplitude=0.06,
        period=2,
        ramp_time=4,
        run_up_time=4,
    )
    simulator = sc.Simulator(model, sc.steady_tow(model, position=(0, 0, 0.2)))
    while simulator.snaps == 0:
        simulator.step(simulator.time + 0.005, motion)
        assert simulator.time < 4.0, "the slack secondary comes taut in the run-up"
    copy = sc.Simulator(model, sc.State(model))
    copy.restore(simulator.save())
    for s in (simulator, copy):
        s.step(s.time + 0.1, motion)
    assert copy.save() == simulator.save()


def test_refuses_the_state_of_another_model(simulator, wu_chwang_model):
    other = sc.State(wu_chwang_model())
    with pytest.raises(sc.InvalidInput, match="another model"):
        other.restore(simulator.save())
    with pytest.raises(sc.InvalidInput, match="cut short"):
        simulator.restore(simulator.save()[:-8])
    with pytest.raises(sc.InvalidInput, match="not a saved state"):
        simulator.restore(b"something else entirely")
