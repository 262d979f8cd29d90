# SPDX-License-Identifier: Apache-2.0
"""States are saved, restored and copied exactly."""

import copy
import json
import pickle
import struct
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from damaged_states import checksum

import sim_core as sc

CABLE = sc.LineProperties(length=3.0, diameter=0.01, mass_per_length=0.2, axial_stiffness=6e5)
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


EVERYTHING = sc.System(
    water=sc.Water(
        current=sc.Current(
            uniform=(0.1, 0, 0),
            profile=[(-3.0, (0, 0, 0)), (0.0, (0.2, 0, 0))],
            series=[(0.0, (0, 0, 0)), (9.0, (0, 0.1, 0))],
        ),
        waves=sc.regular_waves(height=0.1, period=1.5, depth=9.0, ramp_time=3.0),
    ),
    tank=sc.Tank(floor=-9.0, width=4.0, ends=(-50.0, 50.0), stiffness=1e4, bed_stiffness=1e3),
    points={
        "bow": sc.PrescribedPoint(),
        "stern": sc.PrescribedPoint(),
        "clump": sc.FreePoint(mass=3.0, drag_area=(0.1, 0.2, 0.3), added_mass=1.0),
        "vane": sc.Weathervane(mass=5.0, volume=1e-3, drag_area=(0.01, 0.1, 0.02)),
    },
    bodies={
        "fish": sc.Body(
            mass=5.0, inertia=(0.1, 0.5, 0.5), volume=5e-3, diameter=0.1, length=1.0,
            added_mass=(0.1, 5, 5, 0, 1, 1), axial_drag=0.3, cross_flow_drag=1.1, munk_moment=0.7,
            places={"nose": (0.5, 0, 0)},
            drag_area=(0.01, 0.02, 0.03), turning_drag=(0.1, 0.1, 0.1),
            fins=[
                sc.Fin(
                    position=(x, 0, 0), normal=(0, 0, 1), area=0.01, lift_slope=3.0,
                    aspect_ratio=2.0,
                )
                for x in (0.3, -0.5)
            ],
            downwash=[sc.Downwash(front=0, rear=1, slope=0.4)],
        ),
        "wing": sc.Body(
            mass=5.0, inertia=(0.1, 0.5, 0.5), volume=5e-3, diameter=0.1, length=1.0,
            axial_drag=0.0, cross_flow_drag=1.1, munk_moment=0.0, added_mass=(0.1, 5, 5, 0.1, 1, 1),
            drag_area=(0.01, 0.02, 0.03), turning_drag=(0.1, 0.1, 0.1),
            hull_table=sc.HullTable(
                attack=(-0.5, 0, 0.5), sideslip=(-0.5, 0, 0.5),
                coefficients=[[(0.3, 0.1, 0.2, 0.1, 0.2, 0.1)] * 3] * 3, area=0.01, length=1.0,
            ),
        ),
    },
    lines={
        "main": sc.Line("bow", "clump", CABLE, segments=4, paid_out=2.2),
        "stiff": sc.Line(
            "stern", "fish", CABLE.replace(bending_stiffness=0.1, slack_tension=0.1, lift=0.1),
            segments=3, attachment=(0.5, 0, 0), start_direction=(0, 0, -2.0),
            end_direction=(-1.0, 0.1, 0),
        ),
        "table": sc.SectionedLine(
            "clump", "vane",
            sections=((CABLE.replace(
                axial_stiffness=[(0, 0), (0.1, 1e3)], normal_drag=[(1e3, 1.2), (1e6, 0.8)],
                displaced_area=1e-4,
            ), 2),),
        ),
    },
    joints={"hinge": sc.Joint(
        "fish", "wing", stiffness=1e5, damping=10.0, start_attachment=(-0.5, 0, 0),
        attachment=(0.5, 0, 0),
    )},
)  # fmt: skip


def varied(value):
    """Copies of a description, each with one number changed in its last digits: the path, tries."""
    if isinstance(value, float):
        tries = [value * (1 - 1e-12), value * (1 + 1e-12), value + 1e-12, value - 1e-12]
        yield "", [other for other in tries if other != value]
    elif isinstance(value, np.ndarray):
        yield from varied(value.tolist())
    elif isinstance(value, dict):
        for key, item in value.items():
            for path, tries in varied(item):
                yield f".{key}{path}", [{**value, key: other} for other in tries]
    elif isinstance(value, list | tuple):
        for i, item in enumerate(value):
            for path, tries in varied(item):
                yield f".{i}{path}", [(*value[:i], other, *value[i + 1 :]) for other in tries]
    elif hasattr(value, "replace") and not isinstance(value, str):
        fields = getattr(value, "__dict__", None) or {
            name: getattr(value, name)
            for name, item in vars(type(value)).items()
            if isinstance(item, property)
        }
        for name, item in fields.items():
            for path, tries in varied(item):
                changed = [partial(type(value), **{**fields, name: other}) for other in tries]
                yield f".{name}{path}", changed


def test_refuses_the_state_of_a_model_that_differs_in_any_value():
    """Replay with another mass, drag or current is an error: it would silently be another run."""
    model = EVERYTHING.build()
    saved = sc.State(model).save()
    same = sc.State(pickle.loads(pickle.dumps(model)))
    same.restore(saved)
    count, fixed = 0, set()
    for path, tries in varied(EVERYTHING):
        other = first_that_builds(tries)
        if other is None:
            fixed.add(path)
            continue
        assert other != model, path
        with pytest.raises(sc.InvalidInput, match="another model"):
            sc.State(other).restore(saved)
        with pytest.raises(sc.InvalidInput, match="another model"):
            sc.Simulator(other, sc.State(model))
        count += 1
    assert count > 300
    # What a hull table leaves at zero, what a winch winds, and where a table of tension begins
    assert fixed == {
        ".bodies.wing.axial_drag",
        ".bodies.wing.munk_moment",
        ".lines.main.properties.bending_stiffness",
        ".lines.table.sections.0.0.axial_stiffness.0.0",
        ".lines.table.sections.0.0.axial_stiffness.0.1",
    }


def first_that_builds(tries):
    for make in tries:
        try:
            return made(make).build()
        except sc.InvalidInput:
            continue
    return None


def made(description):
    """Parts are made from the inside to the outside only here, where what is refused is skipped."""
    if isinstance(description, partial):
        values = {name: made(item) for name, item in description.keywords.items()}
        return description.func(**values)
    if isinstance(description, dict):
        return {key: made(item) for key, item in description.items()}
    if isinstance(description, list | tuple):
        return tuple(made(item) for item in description)
    return description


def test_the_state_of_an_equal_model_is_taken(simulator):
    """Model and state may have come from another process one by one."""
    state = pickle.loads(pickle.dumps(simulator.state))
    other = sc.Simulator(simulator.model, state)
    for s in (simulator, other):
        s.step(1.2, MOTION)
    assert other.save() == simulator.save()
