# SPDX-License-Identifier: Apache-2.0
"""Payout and haul-in of a line over a winch."""

import numpy as np
import pytest

import sim_core as sc
from sim_core import _core

SEGMENTS, LONGEST, SPACING = 16, 8.0, 0.5
MASS = 5.0  # kg at the end
CABLE = {"diameter": 0.01, "mass_per_length": 0.1, "axial_stiffness": 1e5}
WEIGHT = 0.1 * 9.81  # N/m
STILL = sc.SteadyTow(position=(0, 0, 0))


def winch(paid_out, water=None, mass=MASS, segments=SEGMENTS, **changes):
    b = sc.ModelBuilder(water or sc.Water(density=0.0))
    b.add_prescribed_point("winch")
    b.add_free_point("end", mass=mass)
    line = sc.LineProperties(length=segments * SPACING, **CABLE | changes)
    b.add_line("line", "winch", "end", line, segments=segments, paid_out=paid_out)
    return b.build()


def middle_of_top_segment(paid_out):
    """Unstretched length below the middle of the segment that leaves the drum."""
    on_drum = np.ceil((LONGEST - paid_out) / SPACING - 0.5).clip(0, SEGMENTS - 1)
    changing = paid_out - LONGEST + (on_drum + 1) * SPACING
    return paid_out - 0.5 * changing


def lower(law, t_end, start, **changes):
    model = winch(start, **changes)
    return sc.run(model, STILL, t_end=t_end, payout={"line": law})


def test_line_on_the_drum_is_not_there():
    """With whole segments out the steady tow is that of a plain line of that length."""
    plain = sc.ModelBuilder()
    plain.add_prescribed_point("winch")
    plain.add_free_point("end", mass=MASS)
    line = sc.LineProperties(length=3.0, slack_tension=0.05, **CABLE)
    plain.add_line("line", "winch", "end", line, segments=6)
    steady = {"position": (0, 0, -1), "velocity": (1.5, 0, 0)}
    expected = sc.steady_tow(plain.build(), **steady).node_positions("line")
    state = sc.steady_tow(winch(3.0, sc.Water(), slack_tension=0.05), **steady)
    nodes = state.node_positions("line")
    assert nodes[10:] == pytest.approx(expected, abs=1e-7)  # the Newton tolerance
    assert nodes[:11] == pytest.approx(np.tile([0, 0, -1], (11, 1)))


def test_weight_lowered_in_still_air():
    """T = (M + m s)(g − s̈) with the s below the middle of the top segment, whatever the rate: all
    that is out moves as one, and what enters does so at the drum's velocity."""
    # M d²s̈/dt²/ω² of the axial mode at 53 rad/s, which the ramp excites, is 0.01 N
    law = sc.SteadyPayout(start_length=2.0, end_length=7.0, rate=1.0, start_time=0.5, ramp_time=2.0)
    result = lower(law, 9.0, 2.0, axial_damping=300.0)
    history = result.lines["line"]
    assert history.paid_out[0] == 2.0
    assert history.paid_out[-1] == pytest.approx(7.0, abs=1e-12)
    rates = np.array([law(t).rate for t in result.time])
    assert rates.max() == pytest.approx(1.0)
    pull = np.gradient(rates, result.time)
    below = middle_of_top_segment(history.paid_out)
    expected = (MASS + 0.1 * below) * (9.81 - pull)
    assert np.ptp(pull) > 1.8, "the ramps show: 15/8 of 1 m/s in 2 s, up and down"
    # A node released on a straight segment of 1.5 ℓ starts with one tension on both sides of it,
    # which at rest differ by ¾ w ℓ: each is off by w ℓ/2 at most, the wave that follows by w ℓ
    assert np.abs(history.tensions[:, 0] - expected).max() < WEIGHT * SPACING
    # and soon damped: a second after the end all is still
    assert history.tensions[-1, 0] == pytest.approx(expected[-1], rel=1e-4)
    # strains of 6e-4
    depth = -result.points["end"].position[:, 2]
    assert depth == pytest.approx(history.paid_out, rel=1e-3)


def test_the_winch_takes_the_energy_that_is_lost():
    """E falls by ∫ T ds at the drum; what enters brings its ½ m ṡ² and is stretched already."""
    law = sc.SteadyPayout(start_length=2.0, end_length=7.0, rate=0.5, ramp_time=1.0)
    model = winch(2.0)
    state = sc.steady_tow(model, position=(0, 0, 0))
    simulator = sc.Simulator(model, state)
    simulator.set_payout("line", law)
    energies, lengths, tensions, rates = [], [], [], []
    for i in range(1200):
        simulator.step(0.01 * (i + 1), STILL)
        out = simulator.paid_out("line")
        energies.append(sc.energy(simulator.state).total)
        lengths.append(out)
        rates.append(law(simulator.time).rate)
        tensions.append(simulator.end_tensions("line")[0])
    T, rate = np.array(tensions), np.array(rates)
    entering = 0.5 * 0.1 * rate**2 + T**2 / (2 * 1e5) - T * (1 + T / 1e5)
    work = np.trapezoid(entering, lengths)
    assert work < -200.0
    # exact but for the sampling of the ramps and the waves of ½ (w ℓ)² ℓ/EA that a release starts
    assert energies[-1] - energies[0] == pytest.approx(work, rel=2e-4)


def test_hauling_in_a_towed_line_keeps_its_tension():
    """At the end the steady tow of the shorter line; on the way no slack and no jump."""
    water = sc.Water()
    start = sc.steady_tow(winch(8.0, water), position=(0, 0, -1), velocity=(2, 0, 0))
    model = winch(8.0, water)
    law = sc.SteadyPayout(start_length=8.0, end_length=3.0, rate=0.5, ramp_time=2.0)
    tow = sc.SteadyTow(position=(0, 0, -1), velocity=(2, 0, 0))
    result = sc.run(model, tow, t_end=30.0, payout={"line": law})
    history = result.lines["line"]
    final = sc.steady_tow(winch(3.0, water), position=(0, 0, -1), velocity=(2, 0, 0))
    travelled = np.array([60.0, 0, 0])
    nodes = history.node_positions[-1] - travelled
    assert history.paid_out[-1] == pytest.approx(3.0, abs=1e-12)
    # what the corner of the last node taken in took with it may be left: ℓ θ²/8, θ < 0.1
    assert nodes == pytest.approx(final.node_positions("line"), abs=2e-3)
    simulator = sc.Simulator(final.model, final)
    assert history.tensions[-1, 0] == pytest.approx(simulator.tensions("line")[0], rel=2e-3)
    assert start.node_positions("line")[-1, 2] < final.node_positions("line")[-1, 2]
    # drag of 24 N/m at most and weight, over a segment, twice as above
    jumps = np.abs(np.diff(history.tensions[:, 0]))
    assert jumps.max() < 2 * (0.5 * 1000 * 1.2 * 0.01 * 2.5**2 + WEIGHT) * SPACING
    assert history.tensions[:, 0].min() > 0.5 * history.tensions[-1, 0]
    assert result.snaps == 0


def test_paid_out_faster_than_it_sinks():
    """The line goes slack, comes taut when the winch has stopped, and hangs as it should."""
    water = sc.Water()
    law = sc.SteadyPayout(start_length=2.0, end_length=7.0, rate=3.0, ramp_time=0.2)
    model = winch(2.0, water, mass=0.2)
    rest = sc.SteadyTow(position=(0, 0, -1))
    result = sc.run(model, rest, t_end=40.0, payout={"line": law}, integrator=sc.HHT(alpha=-0.3))
    history = result.lines["line"]
    assert history.tensions.min() == 0.0
    assert np.isfinite(history.node_positions).all()
    w = (0.1 - 1000 * np.pi / 4 * 0.01**2) * 9.81
    assert history.start_tension[-1] == pytest.approx(0.2 * 9.81 + w * 7.0, rel=1e-2)


def test_continues_bit_for_bit_across_a_release():
    law = sc.SteadyPayout(start_length=3.0, end_length=6.0, rate=1.0)
    model = winch(3.0)
    simulator = sc.Simulator(model, sc.steady_tow(model, position=(0, 0, 0)))
    simulator.set_payout("line", law)
    simulator.step(0.1, STILL)
    other = sc.Simulator(model, sc.State(model))
    other.restore(simulator.save())
    other.set_payout("line", law)
    copy = simulator.copy()
    for s in (simulator, other, copy):
        s.step(1.7, STILL)
    assert other.save() == simulator.save() == copy.save()
    assert simulator.paid_out("line") == pytest.approx(4.7)


def test_jacobian_of_a_running_winch():
    """The changing length enters stiffness, damping and mass; nodes on the drum stay with it."""
    model = winch(
        2.2, sc.Water(), axial_damping=50.0, axial_stiffness=1e3, slack_tension=1.0, segments=8
    )
    state = sc.steady_tow(model, position=(0, 0, -1), velocity=(1, 0, 0))
    simulator = sc.Simulator(model, state)
    simulator.set_payout("line", sc.SteadyPayout(start_length=2.2, end_length=4.0, rate=2.0))
    simulator.step(0.05, sc.SteadyTow(position=(0, 0, -1), velocity=(1, 0, 0)))
    state = simulator.state
    on_drum = 4  # 2.3 m out of 4 m in 8 segments: 3 whole ones below the one of 0.8 m … 0.3 m
    assert np.ptp(state.node_positions("line")[:on_drum], axis=0).max() == 0.0
    n = model.unknowns
    drum = np.zeros(n, dtype=bool)
    drum[3 : 3 * on_drum] = True  # the end point, then the inner nodes
    for rates in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
        analytic = _core._jacobian(state, rates)
        assert analytic[drum] == pytest.approx(np.eye(n)[drum])
        h = 1e-6
        numeric = np.column_stack(
            [
                _core._residual(_core._displaced(state, h * e, rates))
                - _core._residual(_core._displaced(state, -h * e, rates))
                for e in np.eye(n)[~drum]
            ]
        ) / (2 * h)
        assert np.abs(analytic[~drum][:, ~drum] - numeric[~drum]).max() < 1e-3


def test_ends_of_the_line_are_errors_with_place_and_time():
    model = winch(7.0)
    simulator = sc.Simulator(model, sc.steady_tow(model, position=(0, 0, 0)))
    simulator.set_payout(
        "line", sc.SteadyPayout(start_length=7.0, end_length=9.0, rate=1.0, start_time=1.0)
    )
    with pytest.raises(sc.InvalidInput, match=r"line 'line': 8.* m out at t = 2.* s is more than"):
        simulator.step(5.0, STILL)
    assert simulator.paid_out("line") == pytest.approx(8.0)
    assert simulator.time == pytest.approx(2.0, abs=0.006)
    simulator.set_payout("line", None)
    simulator.step(2.5, STILL)
    hauling = sc.PayoutSeries([(2.5, 8.0), (12.5, 0.1)])
    simulator.set_payout("line", sc.PayoutSeries([(2.5, simulator.paid_out("line")), (12.5, 0.1)]))
    with pytest.raises(sc.InvalidInput, match=r"less than its shortest length of 0\.25 m"):
        simulator.step(13.0, STILL)
    assert hauling(2.5).rate == 0.0


def test_a_model_tells_its_winch():
    line = sc.LineProperties(length=8.0, **CABLE)
    system = sc.System(
        points={"winch": sc.PrescribedPoint(), "end": sc.FreePoint(mass=MASS)},
        lines={"line": sc.Line("winch", "end", line, segments=SEGMENTS, paid_out=3.0)},
    )
    assert sc.System.of(system.build()) == system


def test_refuses_winches_that_cannot_be():
    with pytest.raises(sc.InvalidInput, match=r"paid_out must lie between 0\.25.* m and 8\.0* m"):
        winch(9.0)
    with pytest.raises(sc.InvalidInput, match="must be limp"):
        winch(2.0, bending_stiffness=1.0)
    b = sc.ModelBuilder()
    b.add_prescribed_point("top")
    b.add_free_point("end")
    with pytest.raises(sc.InvalidInput, match="must start at a prescribed point"):
        b.add_line(
            "l", "end", "top", sc.LineProperties(length=1.0, **CABLE), segments=2, paid_out=1
        )
    model = winch(2.0)
    simulator = sc.Simulator(model, sc.steady_tow(model, position=(0, 0, 0)))
    law = sc.SteadyPayout(start_length=3.0, end_length=4.0, rate=1.0)
    with pytest.raises(sc.InvalidInput, match=r"says 3.* m at t = 0.* s, but 2.* m are out"):
        simulator.set_payout("line", law)
    with pytest.raises(sc.InvalidInput, match="rate must be above 0"):
        sc.SteadyPayout(start_length=3.0, end_length=4.0, rate=0.0)
