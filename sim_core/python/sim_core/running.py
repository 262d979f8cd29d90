# SPDX-License-Identifier: Apache-2.0
"""Whole runs."""

from __future__ import annotations

from collections.abc import Mapping

from sim_core._core import (
    Integrator,
    InvalidInput,
    Model,
    Motion,
    Payout,
    Simulator,
    State,
    _record_run,
    steady_tow,
)
from sim_core.result import Result, Snap, histories


def run(
    model: Model,
    motion: Motion | Mapping[str, Motion],
    *,
    t_end: float,
    output_step: float = 0.01,
    state: State | None = None,
    integrator: Integrator | None = None,
    max_step: float = 0.005,
    newton_tolerance: float | None = None,
    error_tolerance: float | None = None,
    energy_tolerance: float | None = None,
    inelastic_snaps: bool = False,
    balance: bool = False,
    payout: Mapping[str, Payout] | None = None,
) -> Result:
    """Simulate until ``t_end`` (s) and record every ``output_step`` (s).

    ``motion`` is the law of the prescribed point, or a mapping with one law for each. Without a
    ``state`` the run starts at time 0 from the steady tow at the laws' position and horizontal
    velocity there.
    With an ``error_tolerance`` (m, of a step at the worst node) steps are chosen by their error, up
    to ``max_step`` (s). With ``balance`` the result says where energy and momentum went; with an
    ``energy_tolerance`` (0.01: 1 %) it is kept within that share of the energy exchanged, or the
    run stops; what is lost where a line snaps and no step resolves it counts as well, unless
    ``inelastic_snaps`` says that in what is modelled it is lost.
    How well snaps are resolved is in the result's ``least_resolved_snap`` and ``warnings``.
    ``payout`` has the law of each line whose winch runs, by name.
    Raises ConvergenceError (place and time) and InvalidInput.
    """
    laws = _laws(model, motion)
    if state is None:
        state = _steady_start(model, laws)
    simulator = Simulator(
        model,
        state,
        integrator=integrator,
        max_step=max_step,
        error_tolerance=error_tolerance,
        energy_tolerance=energy_tolerance,
        inelastic_snaps=inelastic_snaps,
        **({} if newton_tolerance is None else {"newton_tolerance": newton_tolerance}),  # type: ignore[arg-type]
    )
    if balance:
        simulator.start_balance()
    for line, law in (payout or {}).items():
        simulator.set_payout(line, law)
    arrays = _record_run(simulator, laws, t_end, output_step)
    peaks = {name: simulator.peak_tensions(name) for name in model.lines}
    points, bodies, lines = histories(model, arrays, peaks)
    snap = simulator.least_resolved_snap
    return Result(
        time=arrays["time"],
        points=points,
        bodies=bodies,
        lines=lines,
        final_state=simulator.state,
        steps=simulator.steps,
        newton_iterations=simulator.newton_iterations,
        halvings=simulator.halvings,
        rejections=simulator.rejections,
        snaps=simulator.snaps,
        impacts=simulator.impacts,
        least_resolved_snap=None if snap is None else Snap(*snap),
        energy=arrays.get("energy", {}),
        momentum=arrays.get("momentum", {}),
        events=tuple(simulator.contacts),
    )


def _laws(model: Model, motion: object) -> Motion | dict[str, Motion]:
    """The motion as it was given, if that is a law or one for each prescribed point."""
    if isinstance(motion, Motion):
        return motion
    names = ", ".join(f"'{name}'" for name in model.prescribed_points)
    wanted = f"give a Motion (such as SteadyTow), or a dict with one for each of {names}"
    if not isinstance(motion, Mapping):
        raise InvalidInput(f"motion is {motion!r}: {wanted}")
    for name, law in motion.items():
        if not isinstance(law, Motion):
            raise InvalidInput(f"the motion of '{name}' is {law!r}: {wanted}")
    for name in model.prescribed_points:
        if name not in motion:
            raise InvalidInput(f"there is no motion for the prescribed point '{name}': {wanted}")
    return dict(motion)


def _steady_start(model: Model, laws: Motion | dict[str, Motion]) -> State:
    if isinstance(laws, Motion):
        sample = laws(0.0)
        vx, vy, _ = sample.velocity
        return steady_tow(model, position=sample.position.tolist(), velocity=(vx, vy, 0.0))
    samples = {name: law(0.0) for name, law in laws.items()}
    vx, vy, _ = next(iter(samples.values())).velocity
    positions = {name: sample.position.tolist() for name, sample in samples.items()}
    return steady_tow(model, position=positions, velocity=(vx, vy, 0.0))
