# SPDX-License-Identifier: Apache-2.0
"""Lines that go slack and come taut again."""

import numpy as np
import pytest

import sim_core as sc


def run_up():
    """Carriage and crank of the tank rig start together: 1 m/s and 30 turns a minute at 6 cm."""
    return sc.Sinusoid(
        mean=(0, 0, 0.2),
        velocity=(1, 0, 0),
        amplitude=0.06,
        period=2.0,
        ramp_time=4.0,
        run_up_time=4.0,
    )


@pytest.mark.parametrize("with_fins", [True, False])
@pytest.mark.parametrize("segments", [(1, 1, 1), (10, 3, 7), (20, 5, 15)])
def test_rest_at_zero_speed_with_almost_no_tension(nit_model, with_fins, segments):
    """The neutral fish hangs straight below the junction at the end of the slightly heavy cable."""
    model = nit_model(segments=segments, with_fins=with_fins)
    start = run_up()(0.0).position
    state = sc.steady_tow(model, position=start)
    # 1.2 m of primary, 1.0 m of secondary, nose 0.65 m before the middle; strains below 1e-4
    assert state.body_position("fish") == pytest.approx([-0.65, 0, start[2] - 2.2], abs=1e-3)
    simulator = sc.Simulator(model, state)
    # half of the last segment's weight in water hangs on the nose; the rounding of
    # the tension at slack (below 1 % of the line's weight) does not reach it
    w = 0.075 * 9.81 * 1.0 / segments[2]
    assert simulator.tensions("secondary")[-1] == pytest.approx(w / 2, rel=1e-3)
    simulator.step(20.0, sc.SteadyTow(position=start))
    assert simulator.body_position("fish") == pytest.approx(state.body_position("fish"), abs=1e-4)


def test_run_up_from_rest(nit_model):
    """Through the snap of the slack secondary cable to the steady motion, all in bounds."""
    result = sc.run(nit_model(), run_up(), t_end=44.0, max_step=0.005)
    assert result.snaps > 0
    tensions = np.concatenate([line.tensions for line in result.lines.values()], axis=1)
    assert np.isfinite(tensions).all()
    assert tensions.min() >= 0.0
    # Of the order of the static load (49 N): an unphysical snap made 1e4 N and more
    assert tensions.max() < 150.0
    steady = result.time > 24.0
    depressor = result.points["depressor"].position[steady, 2]
    assert 0.055 < 0.5 * np.ptp(depressor) < 0.066  # a hanging weight follows the crank
    w, x, y, z = result.bodies["fish"].quaternion[steady].T
    assert np.abs(np.degrees(2 * np.arctan2(np.hypot(np.hypot(x, y), z), w))).max() < 10.0


def test_snap_does_not_depend_on_step_and_scheme(nit_model):
    """The fish after the snap: much the same whatever resolves or damps the impact."""
    ends = []
    for step, rho in ((0.005, 0.8), (0.0025, 0.8), (0.001, 0.5)):
        result = sc.run(
            nit_model(),
            run_up(),
            t_end=5.0,
            max_step=step,
            integrator=sc.GeneralizedAlpha(rho_inf=rho),
        )
        assert result.snaps > 0
        ends.append(result.bodies["fish"].position[-1] - result.points["tow_point"].position[-1])
    travelled = 0.5  # m, how far the fish has risen by then, at least
    for end in ends[1:]:
        assert np.abs(end - ends[0]).max() < 0.05 * travelled


@pytest.mark.parametrize("frequency", [1.2, 2.0])
def test_low_drag_at_high_frequency_goes_slack_and_recovers(wu_chwang_model, frequency):
    """The secondary cable of the Wu & Chwang tow slackens at low fish drag above 1 Hz."""
    model = wu_chwang_model(axial_drag=0.1)
    motion = sc.Sinusoid(
        mean=(0, 0, -2), velocity=(1.75, 0, 0), amplitude=0.1, period=1 / frequency, ramp_time=2
    )
    result = sc.run(model, motion, t_end=20.0, max_step=0.005)
    secondary = result.lines["secondary"].tensions
    assert secondary.min() == 0.0
    assert np.isfinite(secondary).all()
    assert np.abs(result.bodies["fish"].position[:, 2]).max() < 6.5  # within the cables' reach


def test_weight_dropped_on_a_slack_wire_stops_at_its_length():
    """Energy is only lost when a stiff wire comes taut; the mass ends up hanging."""
    b = sc.ModelBuilder(sc.Water(density=0.0))
    b.add_prescribed_point("top")
    b.add_free_point("weight", mass=2.0)
    wire = sc.LineProperties(length=1.0, diameter=0.002, mass_per_length=0.02, axial_stiffness=6e5)
    b.add_line("wire", "top", "weight", wire, segments=1)
    model = b.build()
    state = sc.State(model)
    state.set_point("top", (0, 0, 3))
    state.set_point("weight", (0, 0, 2.5))
    start = sc.energy(state).total
    simulator = sc.Simulator(model, state)
    highest = -np.inf
    for i in range(1, 401):
        simulator.step(0.005 * i, sc.SteadyTow(position=(0, 0, 3)))
        assert sc.energy(simulator.state).total < start + 1e-6 * 2.0 * 9.81
        if simulator.snaps:
            highest = max(highest, simulator.point_position("weight")[2])
    assert simulator.snaps >= 1
    assert highest < 2.5
    # stretched by W/EA = 3e-5
    assert simulator.point_position("weight")[2] == pytest.approx(2.0, abs=1e-3)


def test_light_fish_folds_its_cable_at_rest():
    """A fish whose lift is less than its cable's weight floats above the cable's lowest point and
    carries as much of it as its lift."""
    lift = 0.05 * 9.81  # N
    b = sc.ModelBuilder(sc.Water())
    b.add_prescribed_point("tow_point")
    fish = sc.Body(
        mass=5.95, inertia=(0.02, 0.6, 0.6), centre_of_gravity=(0, 0, -0.01), volume=6e-3,
        diameter=0.1, length=1.0, axial_drag=0.3, cross_flow_drag=1.1,
    )  # fmt: skip
    b.add_body("fish", fish)
    cable = sc.LineProperties(length=3.0, diameter=0.008, mass_per_length=0.15, axial_stiffness=6e5)
    b.add_line("cable", "tow_point", "fish", cable, segments=13, attachment=(0.5, 0, 0))
    model = b.build()
    state = sc.steady_tow(model, position=(0, 0, -1))
    simulator = sc.Simulator(model, state)
    z = simulator.node_positions("cable")[:, 2]
    assert z.min() < z[-1] < z[0]
    weight = (0.15 - 1000 * np.pi / 4 * 0.008**2) * 9.81 * 3.0  # of the cable in water
    nodes = 13
    # the fish holds its lift's worth of cable, all but half a node's weight at its nose
    assert simulator.tensions("cable")[-1] == pytest.approx(lift - weight / nodes / 2, rel=1e-3)
    simulator.step(5.0, sc.SteadyTow(position=(0, 0, -1)))
    assert simulator.body_position("fish") == pytest.approx(state.body_position("fish"), abs=1e-4)
