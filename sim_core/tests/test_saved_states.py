# SPDX-License-Identifier: Apache-2.0
"""States are saved, restored and copied exactly."""

import copy
import json
import pickle
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from damaged_states import checksum

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


INTEGRATORS = [
    sc.BackwardEuler(),
    sc.Newmark(beta=0.3025, gamma=0.6),
    sc.HHT(alpha=-0.2),
    sc.GeneralizedAlpha(rho_inf=0.6),
    sc.SingleStepHoubolt(),
    sc.Box(),
    sc.ForwardEuler(),
]


@pytest.mark.parametrize("integrator", INTEGRATORS, ids=lambda i: type(i).__name__)
def test_every_integrator_continues_bit_for_bit(nit_model, integrator):
    """From saved bytes, a copy, a pickle; some keep an acceleration of their own in the state."""
    model = nit_model(segments=(2, 1, 2))
    start = sc.steady_tow(model, position=(0, 0, 0.2), velocity=(1, 0, 0))
    # Forward Euler is stable only below 2ζ/ω of the stiffest wire: it goes a few steps of 1 µs.
    explicit = isinstance(integrator, sc.ForwardEuler)
    step, time = (1e-6, 1e-5) if explicit else (0.005, 0.1)
    simulator = sc.Simulator(model, start, integrator=integrator, max_step=step)
    simulator.step(time, MOTION)
    state = simulator.state
    restored = sc.State(model)
    restored.restore(simulator.save())
    simulator.step(2 * time, MOTION)
    for twin in (
        restored,
        copy.copy(state),
        copy.deepcopy(state),
        pickle.loads(pickle.dumps(state)),
    ):
        other = sc.Simulator(twin.model, twin, integrator=integrator, max_step=step)
        other.step(2 * time, MOTION)
        assert other.save() == simulator.save()


def test_prescribed_points_are_restored_with_their_motion():
    """Live input goes on from where each prescribed point is and how it moves."""
    cable = sc.LineProperties(length=3, diameter=0.01, mass_per_length=0.2, axial_stiffness=1e5)
    system = sc.System(
        points={
            "bow": sc.PrescribedPoint(),
            "stern": sc.PrescribedPoint(),
            "clump": sc.FreePoint(mass=2),
        },
        lines={
            "fore": sc.Line("bow", "clump", cable, segments=3),
            "aft": sc.Line("stern", "clump", cable, segments=3),
        },
    )
    model = system.build()
    laws = {
        name: sc.Sinusoid(mean=(x, 0, -1), velocity=(1, 0, 0), amplitude=0.1, period=1, phase=x)
        for name, x in (("bow", 0.0), ("stern", -4.0))
    }
    start = sc.steady_tow(
        model, position={"bow": (0, 0, -1), "stern": (-4, 0, -1)}, velocity=(1, 0, 0)
    )
    simulator = sc.Simulator(model, start)
    simulator.step(0.3, laws)
    twin = pickle.loads(pickle.dumps(simulator.state))
    for name, law in laws.items():
        sample = law(0.3)
        assert twin.point_position(name) == pytest.approx(sample.position, abs=1e-15)
        assert twin.point_velocity(name) == pytest.approx(sample.velocity, abs=1e-15)
        assert twin.point_acceleration(name) == pytest.approx(sample.acceleration, abs=1e-13)
    other = sc.Simulator(twin.model, twin)
    for s in (simulator, other):
        s.step(0.6, laws)
    assert other.save() == simulator.save()


def test_copies_are_independent(simulator):
    state = simulator.state
    twin = copy.deepcopy(state)
    twin.set_point("depressor", (0, 0, -2))
    assert twin.point_position("depressor")[2] != state.point_position("depressor")[2]
    assert copy.deepcopy(state.model).points == state.model.points
    twin.restore(state.save())  # the model is constant: a copy has the same


def test_results_are_pickled_whole(nit_model):
    result = sc.run(nit_model(segments=(2, 1, 2)), MOTION, t_end=0.05)
    twin = pickle.loads(pickle.dumps(result))
    assert twin.final_state.save() == result.final_state.save()
    assert np.array_equal(twin.lines["primary"].tensions, result.lines["primary"].tensions)
    assert sc.System.of(twin.final_state.model) == sc.System.of(result.final_state.model)


def test_damage_is_refused_and_never_ends_the_interpreter():
    """Every byte of a saved state and of a pickle, in a process of its own."""
    program = Path(__file__).with_name("damaged_states.py")
    done = subprocess.run([sys.executable, program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["as it is"] == {"runs": 1}
    # FNV-1a maps the sums before a byte one to one for each of its values: no single one escapes
    assert set(found["bytes"]) == {"InvalidInput"}
    # with the right checksum another state may be as good as the saved one
    for kind in ("bytes, checksum mended", "words, checksum mended"):
        assert set(found[kind]) == {"InvalidInput", "ConvergenceError", "runs"}
    assert found["pickle"]["InvalidInput"] > 1000  # what is in the state; the rest is Python's


def test_says_what_is_damaged():
    cable = sc.LineProperties(length=3, diameter=0.01, mass_per_length=0.2, axial_stiffness=1e5)
    system = sc.System(
        points={"top": sc.PrescribedPoint(), "weight": sc.FreePoint(mass=5.0)},
        lines={"wound": sc.Line("top", "weight", cable, segments=6, paid_out=2.0)},
    )
    model = system.build()
    saved = sc.State(model).save()
    start = 32  # bytes: format, layout, two marks; then the segments on the drum, then the time
    for place, word, what in (
        (start, struct.pack("<Q", 10**6), "segments on the drum of the winch of line 'wound'"),
        (start, struct.pack("<Q", 0), "length of the segment at the drum"),
        (start + 8, struct.pack("<d", float("nan")), "not finite"),
        (start + 16, struct.pack("<d", -1.0), "a step is below 0"),
        (24, struct.pack("<Q", 3), "a mark is out of its range"),
    ):
        data = saved[:place] + word + saved[place + 8 : -8]
        with pytest.raises(sc.InvalidInput, match=f"damaged: .*{what}"):
            sc.State(model).restore(data + checksum(data))


def test_a_simulator_keeps_its_state_where_another_is_refused(simulator):
    before = simulator.save()
    with pytest.raises(sc.InvalidInput, match="checksum"):
        simulator.restore(before[:100] + bytes([before[100] ^ 1]) + before[101:])
    simulator.restore(before)
    assert simulator.save() == before


def test_refuses_the_state_of_another_model(simulator, wu_chwang_model):
    other = sc.State(wu_chwang_model())
    with pytest.raises(sc.InvalidInput, match="another model"):
        other.restore(simulator.save())
    with pytest.raises(sc.InvalidInput, match="cut short"):
        simulator.restore(simulator.save()[:-8])
    with pytest.raises(sc.InvalidInput, match="not a saved state"):
        simulator.restore(b"something else entirely")
