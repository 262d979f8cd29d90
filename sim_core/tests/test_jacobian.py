# SPDX-License-Identifier: Apache-2.0
"""The analytic Jacobian against central differences on random states."""

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

import sim_core as sc
from sim_core import _core


def random_state(model, height, seed, stretch):
    rng = np.random.default_rng(seed)
    state = sc.steady_tow(model, position=(0, 0, height), velocity=(0.5, 0, 0))
    n = model.unknowns
    state = _core._displaced(state, stretch * rng.normal(size=n), (1, 0, 0))
    state = _core._displaced(state, 0.5 * rng.normal(size=n), (0, 1, 0))
    return _core._displaced(state, 2.0 * rng.normal(size=n), (0, 0, 1))


def central_differences(state, rates, h=1e-6):
    n = state.model.unknowns
    columns = []
    # h balances truncation h² and rounding 1e-16/h of the largest forces
    for column in range(n):
        step = np.zeros(n)
        step[column] = h
        up = _core._residual(_core._displaced(state, step, rates))
        down = _core._residual(_core._displaced(state, -step, rates))
        columns.append((up - down) / (2 * h))
    return np.column_stack(columns)


def full_added_mass():
    """A symmetric matrix without zeros: that of a body that is not symmetric."""
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(6, 6)))[0]
    scale = np.diag([1.0, 2.0, 2.2, 0.1, 0.5, 0.6])
    return scale @ turn @ np.diag([0.5, 0.7, 0.9, 1.0, 1.2, 1.5]) @ turn.T @ scale


def moving_water():
    """Current that varies over depth and time, and steep waves from several sides."""
    current = sc.Current(
        profile=[(0.5, (0.3, 0, 0)), (-0.4, (0.1, 0.1, 0)), (-2.0, (-0.1, 0, 0))],
        series=[(-1.0, (0, 0, 0)), (1.0, (0.4, -0.3, 0.1))],
    )
    sea = sc.Sea(
        amplitude=[0.05, 0.03],
        frequency=[3.0, 5.0],
        direction=[0.5, -1.0],
        phase=[0.2, 1.0],
        depth=4,
    )
    return sc.Water(current=current, waves=sea)


def narrow_tank():
    """So soft and smooth that the random states touch all around."""
    return sc.Tank(
        floor=-0.8, width=0.5, ends=(-0.5, 0.4), stiffness=50.0, damping=0.3, friction=0.4,
        onset=0.1, sliding_speed=0.5,
    )  # fmt: skip


@pytest.fixture(
    scope="module",
    params=[
        (sc.Water(current=(0.2, -0.1, 0.05)), None),
        (moving_water(), None),
        (sc.Water(), narrow_tank()),
    ],
    ids=["uniform", "moving water", "tank"],
)
def soft_model(request):
    """All terms in one system of soft lines, so that rounding of large axial forces hides
    nothing: moving water, damping, drag per axis, a weathervane, immersion, fins, Munk moment,
    added mass, a bridle (closed loop)."""
    water, tank = request.param
    b = sc.ModelBuilder(water)
    if tank:
        b.set_tank(tank)
    b.add_prescribed_point("top")
    b.add_free_point("junction", mass=0.2, drag_area=(1e-3, 2e-3, 3e-3), added_mass=(0.1, 0.2, 0.3))
    b.add_weathervane(
        "depressor",
        mass=2.0,
        volume=0.5e-3,
        drag_area=(0.002, 0.02, 0.01),
        added_mass=(0.1, 0.9, 0.5),
        turning_speed=0.4,
    )
    fins = [
        sc.Fin(position=(-0.4, 0.1, 0.02), normal=n, area=0.01, lift_slope=3.0, stall_angle=0.3)
        for n in ((0, 0, 1), (0.1, 1, 0.3))
    ]
    fish = sc.Body(
        mass=5.0,
        inertia=[[0.2, 0.03, -0.02], [0.03, 0.6, 0.01], [-0.02, 0.01, 0.7]],
        centre_of_gravity=(0.02, -0.01, -0.03),
        volume=5e-3,
        centre_of_buoyancy=(0.01, 0.005, 0.02),
        diameter=0.1,
        length=1.0,
        added_mass=full_added_mass(),
        axial_drag=0.5,
        cross_flow_drag=1.1,
        munk_moment=0.7,
        fins=fins,
        downwash=[sc.Downwash(front=0, rear=1, slope=0.5)],
        strips=5,
    )
    b.add_body("fish", fish)
    line = sc.LineProperties(
        length=0.6,
        diameter=0.02,
        mass_per_length=0.5,
        axial_stiffness=100.0,
        axial_damping=3.0,
        tangential_drag=0.1,
        displaced_area=4e-4,
        slack_tension=3.0,
    )
    b.add_line("primary", "top", "junction", line, segments=3)
    b.add_line("depressor_cable", "junction", "depressor", line, segments=1)
    b.add_line("leg", "junction", "fish", line, segments=2, attachment=(0.5, 0.02, 0.05))
    b.add_line("other_leg", "fish", "junction", line, segments=2, start_attachment=(-0.3, 0, 0.05))
    return b.build()


@settings(
    max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    height=st.floats(-0.5, 1.5),
    seed=st.integers(0, 2**32 - 1),
    stretch=st.sampled_from([0.003, 0.03, 0.1]),
    rates=st.sampled_from([(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 300.0, 1e5)]),
)
@example(height=0.0, seed=467, stretch=0.03, rates=(1, 300.0, 1e5))
def test_matches_differences_with_all_terms(soft_model, height, seed, stretch, rates):
    state = random_state(soft_model, height, seed, stretch)
    analytic = _core._jacobian(state, rates)
    # A state may lie within a step of where a fin stalls or a wall is met, with another slope
    # behind it; a tenth of the step then does not reach there.
    errors = [np.abs(analytic - central_differences(state, rates, h)) for h in (1e-6, 1e-7)]
    # Slopes of |u|u, the slack rounding and the waterline jump in their second derivative:
    # a difference quotient over such a point is off by h times that, about 1e-6 × 1e3.
    scale = max(rates[0] * 1e3, rates[1] * 10, rates[2] * 10)
    assert np.minimum(*errors).max() < 2e-6 * scale


#: A line, a point and a body with nothing but inertia and elasticity; lengths m.
BARE_LINE = {
    "length": 0.9, "diameter": 0.02, "mass_per_length": 0.5, "axial_stiffness": 100.0,
    "slack_tension": 3.0, "normal_drag": 0.0, "tangential_drag": 0.0, "added_mass": 0.0,
}  # fmt: skip
BARE_POINT = {"mass": 0.5}
BARE_BODY = {
    "mass": 5.0, "inertia": (0.2, 0.6, 0.7), "volume": 1e-9, "diameter": 0.1, "length": 1.0,
    "axial_drag": 0.0, "cross_flow_drag": 0.0, "munk_moment": 0.0, "strips": 5,
}  # fmt: skip
FIN = sc.Fin(position=(-0.4, 0.1, 0.02), normal=(0.1, 1, 0.3), area=0.01, lift_slope=3.0)
VANE = {"volume": 1e-9, "drag_area": (0.002, 0.02, 0.01), "turning_speed": 0.4}

#: One force each: what of the line, the point, the weathervane and the body it takes.
SINGLE_TERMS = {
    "elasticity": {},
    "tension table": {"line": {"axial_stiffness": [(0.0, 0.0), (0.1, 5.0), (0.4, 30.0)]}},
    "structural damping": {"line": {"axial_damping": 3.0}},
    "bending": {"line": {"bending_stiffness": 1.0}},
    "normal drag": {"line": {"normal_drag": 1.2}},
    "normal drag by Reynolds number": {"line": {"normal_drag": [(1e2, 1.5), (1e5, 0.3)]}},
    "tangential drag": {"line": {"tangential_drag": 0.5}},
    "lift of a fairing": {"line": {"lift": 0.4}},
    "added mass of a line": {"line": {"added_mass": 1.0}},
    "added mass along a line": {"line": {"tangential_added_mass": 0.7}},
    "drag of a point": {"point": {"drag_area": 0.01}},
    "drag of a point by axis": {"point": {"drag_area": (1e-3, 2e-2, 3e-2)}},
    "added mass of a point": {"point": {"added_mass": (0.1, 0.2, 0.3)}},
    "buoyancy of a point": {"point": {"volume": 1e-2}},
    "drag of a weathervane": {"vane": {}},
    "added mass of a weathervane": {"vane": {"added_mass": (0.1, 0.9, 0.5)}},
    "weight of a body": {"body": {"centre_of_gravity": (0.02, -0.01, -0.03)}},
    "buoyancy of a body": {"body": {"volume": 5e-3, "centre_of_buoyancy": (0.01, 0.005, 0.02)}},
    "axial drag": {"body": {"axial_drag": 0.5}},
    "cross-flow drag": {"body": {"cross_flow_drag": 1.1}},
    "added mass of a body": {"body": {"added_mass": full_added_mass()}},
    "added mass of a body in full": {"body": {"added_mass": full_added_mass(), "munk_moment": 1.0}},
    "Munk moment": {"body": {"added_mass": (0.5, 5.0, 5.0, 0.0, 0.3, 0.3), "munk_moment": 1.0}},
    "fin": {"body": {"fins": [FIN]}},
    "induced drag of a fin": {"body": {"fins": [FIN.replace(aspect_ratio=0.3)]}},
}


def bare_model(water, line=None, point=None, vane=None, body=None):
    """A line from the tow point to a point or weathervane, and on to a body if there is a force on
    it."""
    b = sc.ModelBuilder(water)
    b.add_prescribed_point("top")
    if vane is None:
        b.add_free_point("end", **BARE_POINT | (point or {}))
    else:
        b.add_weathervane("end", **BARE_POINT | VANE | vane)
    properties = sc.LineProperties(**BARE_LINE | (line or {}))
    b.add_line("line", "top", "end", properties, segments=3)
    if body is not None:
        b.add_body("fish", sc.Body(**BARE_BODY | body))
        attachment = (0.5, 0.02, 0.05)
        b.add_line("leg", "end", "fish", properties, segments=1, attachment=attachment)
    return b.build()


@pytest.mark.parametrize("water", [sc.Water(current=(0.2, -0.1, 0.05)), moving_water()])
@pytest.mark.parametrize("term", SINGLE_TERMS)
@settings(max_examples=4, deadline=None)
@given(
    height=st.floats(-1.0, 1.2),
    seed=st.integers(0, 2**32 - 1),
    rates=st.sampled_from([(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 300.0, 1e5)]),
)
def test_matches_differences_with_one_term(term, water, height, seed, rates):
    model = bare_model(water, **SINGLE_TERMS[term])
    rng = np.random.default_rng(seed)
    state = sc.State(model)
    state.set_point("top", (0, 0, height))
    for node in (1, 2):
        state.set_line_node("line", node, (0.1 * node, 0, height - 0.3 * node))
    state.set_point("end", (0.3, 0, height - 0.9))
    if "body" in SINGLE_TERMS[term]:
        state.set_body("fish", (-1.0, 0.1, height - 1.0), rng.normal(size=4))
    for size, order in ((0.03, (1, 0, 0)), (0.5, (0, 1, 0)), (2.0, (0, 0, 1))):
        state = _core._displaced(state, size * rng.normal(size=model.unknowns), order)
    analytic = _core._jacobian(state, rates)
    numeric = central_differences(state, rates)
    scale = max(rates[0] * 1e3, rates[1] * 10, rates[2] * 10)  # as above
    assert np.abs(analytic - numeric).max() < 2e-6 * scale


@pytest.fixture(scope="module")
def bending_model():
    """Springs at inner nodes and at clamped ends on a prescribed point and on bodies, a single
    segment between two bodies among them, in lines of unequal sections."""
    b = sc.ModelBuilder(sc.Water())
    b.add_prescribed_point("top")
    for name in ("fish", "other"):
        body = sc.Body(
            mass=5.0, inertia=(0.2, 0.6, 0.7), volume=5e-3, diameter=0.1, length=1.0,
            axial_drag=0.5, cross_flow_drag=1.1, strips=1,
        )  # fmt: skip
        b.add_body(name, body)

    def part(length, EI):
        return sc.LineProperties(
            length=length, diameter=0.02, mass_per_length=0.5, axial_stiffness=100.0,
            bending_stiffness=EI, slack_tension=3.0,
        )  # fmt: skip

    b.add_line(
        "line", "top", "fish", sections=[(part(0.5, 3.0), 2), (part(0.2, 1.0), 1)],
        attachment=(0.5, 0.02, 0.05), start_direction=(0.3, 0.1, -1), end_direction=(-1, 0.2, 0),
    )  # fmt: skip
    b.add_line(
        "link", "fish", "other", part(0.4, 2.0), segments=1,
        start_attachment=(-0.3, 0, 0.05), attachment=(0.5, 0, 0),
        start_direction=(-1, 0, 0.2), end_direction=(-1, 0.3, 0),
    )  # fmt: skip
    return b.build()


def straight_bodies(model):
    """Both lines of bending_model nearly unstrained and bodies level."""
    state = sc.State(model)
    state.set_point("top", (0, 0, -2))
    state.set_line_node("line", 1, (0.08, 0.03, -2.23))
    state.set_line_node("line", 2, (0.1, 0.05, -2.48))
    state.set_body("fish", (-0.5, 0, -2.7))
    state.set_body("other", (-1.6, 0.1, -2.6), (1, 0, 0.1, 0))
    return state


@settings(
    max_examples=10, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    seed=st.integers(0, 2**32 - 1),
    stretch=st.sampled_from([1e-4, 0.03, 0.3]),  # nearly straight, bent, folded
    rates=st.sampled_from([(1, 0, 0), (1, 300.0, 1e5)]),
)
def test_matches_differences_with_bending(bending_model, seed, stretch, rates):
    rng = np.random.default_rng(seed)
    n = bending_model.unknowns
    state = _core._displaced(straight_bodies(bending_model), rng.normal(size=n), (0, 0.5, 2.0))
    state = _core._displaced(state, stretch * rng.normal(size=n), (1, 0, 0))
    analytic = _core._jacobian(state, rates)
    numeric = central_differences(state, rates)
    # The curvature of the energy rises as the angle nears π, to a scale of the matrix itself
    scale = max(np.abs(analytic).max(), 1e4)
    assert np.abs(analytic - numeric).max() < 2e-6 * scale


@pytest.fixture(scope="module")
def curved_model():
    """Tension over strain, drag over Reynolds number (speeds lie within the tables) and lift."""
    b = sc.ModelBuilder(sc.Water(current=(0.2, -0.1, 0.05)))
    b.add_prescribed_point("top")
    b.add_free_point("end", mass=2.0)
    line = sc.LineProperties(
        length=1.0, diameter=0.02, mass_per_length=0.5, axial_damping=3.0, slack_tension=3.0,
        axial_stiffness=[(0.0, 0.0), (0.1, 5.0), (0.2, 20.0), (0.4, 30.0)],
        normal_drag=[(1e2, 1.5), (3e3, 1.0), (2e4, 1.2), (1e5, 0.3)],
        tangential_drag=[(1e2, 0.3), (1e4, 0.1), (1e5, 0.05)],
        lift=0.4,
    )  # fmt: skip
    b.add_line("line", "top", "end", line, segments=4)
    return b.build()


@settings(
    max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    height=st.floats(-2.0, 0.5),
    seed=st.integers(0, 2**32 - 1),
    stretch=st.sampled_from([0.003, 0.1]),
    rates=st.sampled_from([(1, 0, 0), (0, 1, 0), (1, 300.0, 1e5)]),
)
def test_matches_differences_with_tables_and_lift(curved_model, height, seed, stretch, rates):
    state = random_state(curved_model, height, seed, stretch)
    analytic = _core._jacobian(state, rates)
    numeric = central_differences(state, rates)
    scale = max(rates[0] * 1e3, rates[1] * 10, rates[2] * 10)  # as above
    assert np.abs(analytic - numeric).max() < 2e-6 * scale


def test_matches_differences_on_stiff_wire(nit_model):
    state = random_state(nit_model(segments=(3, 2, 3)), 0.2, 5, 0.02)
    for rates in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
        analytic = _core._jacobian(state, rates)
        numeric = central_differences(state, rates)
        assert np.abs(analytic - numeric).max() < 1e-8 * max(np.abs(analytic).max(), 1e4)
