# SPDX-License-Identifier: Apache-2.0
"""`towtank uncertainty`: what a rig's sensors can tell, from its file alone."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass, replace
from typing import Any

import click
from rich.console import Console
from rich.table import Table
from towtank_daq.description import BoardDescription, installed_description, load_description
from towtank_rig import Rig, RigError, load_rig
from towtank_uncertainty import appendix_three as thesis
from towtank_uncertainty.assumption_effects import AssumptionEffect, assumption_effects
from towtank_uncertainty.crank_budget import CrankBudget
from towtank_uncertainty.statement import (
    BoardNoise,
    Budget,
    Statement,
    as_json,
    deepest_reading,
    default_conditions,
    statements,
    trial_budgets,
)

from towtank_bringup.rigs import rig_path

_SHOWN = {"m": ("mm", 1e3), "rad": ("°", math.degrees(1.0)), "1": ("%", 1e2)}
_SHARE_SHOWN = 1e-3  # of the combined variance; smaller ones are in the JSON
_MOVE_SHOWN = 0.02  # of an interval; smaller ones are in the JSON


@click.command(name="uncertainty")
@click.argument("rig")
@click.option("--depth", type=click.FloatRange(min=0), help="Depth, m (the deepest that can be).")
@click.option("--zeroed-at", type=click.FloatRange(min=0), help="Zeroed at this depth, m (0).")
@click.option("--pitch", type=click.FloatRange(-80, 80), help="Pitch, degrees, bow down (0).")
@click.option(
    "--amplitude",
    type=click.FloatRange(min=0, min_open=True),
    help="Heave amplitude of the depressor, m (the crank's radius).",
)
@click.option(
    "--ratio", type=click.FloatRange(min=0, min_open=True), help="Heave ratio of the fish (0.22)."
)
@click.option("--draws", type=click.IntRange(1000), default=100_000, help="Random sensors (1e5).")
@click.option("--seed", type=int, default=1, help="Of the random sensors (1).")
@click.option("--json", "as_json_text", is_flag=True, help="Print JSON.")
def command(
    rig: str,
    depth: float | None,
    zeroed_at: float | None,
    pitch: float | None,
    amplitude: float | None,
    ratio: float | None,
    draws: int,
    seed: int,
    as_json_text: bool,
) -> None:
    """State the uncertainty of depth, pitch, heave ratio and crank that the sensors of RIG allow.

    To first order (GUM) and by Monte Carlo (GUM Supplement 1), from the errors that the rig file
    gives; beside it the figure of appendix III of P. P. Lalu's thesis, and what that leaves out.
    """
    try:
        loaded = load_rig(rig_path(rig))
    except RigError as error:
        raise click.ClickException(str(error)) from error
    wishes = {
        "depth": depth,
        "zeroed_at": zeroed_at,
        "pitch": None if pitch is None else math.radians(pitch),
        "depressor_amplitude": amplitude,
        "ratio": ratio,
    }
    given: dict[str, Any] = {key: value for key, value in wishes.items() if value is not None}
    conditions = replace(default_conditions(loaded), **given)
    if not conditions.depressor_amplitude > 0.0:
        raise click.ClickException(f"the crank of {loaded.name} does not move: give --amplitude")
    deepest = deepest_reading(loaded)
    for option, value in (("--depth", conditions.depth), ("--zeroed-at", conditions.zeroed_at)):
        if value > deepest:
            fault = f"{option} {value:g} m is beyond the {deepest:.3g} m where the sensors end"
            raise click.ClickException(f"{fault}: give less")
    fronts = front_ends(loaded, load_description(installed_description()))
    noise = BoardNoise(**{name: front.noise_volts for name, front in fronts.items()})
    found = statements(loaded, conditions, noise, draws=draws, seed=seed)
    assumptions = assumption_effects(loaded, conditions, noise)
    crank = CrankBudget(loaded).budgets()
    appendix = thesis.appendix_three(loaded)
    if as_json_text:
        result = {
            "rig": loaded.name,
            "conditions": asdict(conditions),
            "front_ends": {name: asdict(front) for name, front in fronts.items()},
            "monte_carlo": {"draws": draws, "seed": seed},
            "statements": [as_json(statement) for statement in found],
            "crank": [asdict(budget) for budget in crank],
            "assumptions": [asdict(assumption) for assumption in assumptions],
            "appendix_iii": {"depth": thesis.DEPTH, **asdict(appendix)},
        }
        click.echo(json.dumps(result, indent=2))
        return
    console = Console(highlight=False, markup=False)
    console.print(
        f"{loaded.name}: depth {conditions.depth:.3g} m, sensors zeroed at "
        f"{conditions.zeroed_at:.3g} m; depressor {1e3 * conditions.depressor_amplitude:.3g} mm, "
        f"ratio {conditions.ratio:.3g}"
    )
    _print_statements(console, found, draws)
    budgets = trial_budgets(loaded, conditions, noise)
    for budget in (*budgets, *crank):
        _print_budget(console, budget)
    _print_assumptions(console, assumptions, budgets)
    _print_front_ends(console, fronts, loaded)
    _print_appendix_three(console, appendix)


@dataclass(frozen=True)
class FrontEnd:
    """What the board makes of a sensor's signal, from its description.

    Attributes:
        gain: Volts between the ADC's inputs per volt at the terminals.
        pole_hz: Of its filter.
        noise_volts: Of one conversion, at the terminals.
        attenuation: Of an oscillation at the crank's rate, relative. The heave ratio does not feel
            it: both pressure channels have the same.
        lag: Of such an oscillation, rad. The stamps of the samples take it out.
    """

    gain: float
    pole_hz: float
    noise_volts: float
    attenuation: float
    lag: float


def front_ends(rig: Rig, board: BoardDescription) -> dict[str, FrontEnd]:
    """Return the front end of each sensor; one for the accelerometer, whose axes have the same."""
    sensors = rig.sensors
    channels = {
        "fish_pressure": sensors.fish_pressure.channel,
        "depressor_pressure": sensors.depressor_pressure.channel,
        "accelerometer": sensors.accelerometer.channels.x,
    }
    crank_hz = abs(rig.run.crank_rate.value) / (2.0 * math.pi)
    found = {}
    for sensor, name in channels.items():
        channel = board.channels[board.channel_names.index(name)]
        lag = math.atan(crank_hz / channel.pole_hz)
        found[sensor] = FrontEnd(
            gain=channel.gain,
            pole_hz=channel.pole_hz,
            noise_volts=board.terminal_noise(name, rig.board.excitation.value),
            attenuation=1.0 - math.cos(lag),
            lag=lag,
        )
    return found


def _print_statements(console: Console, found: list[Statement], draws: int) -> None:
    table = Table("", "practice", "u (k=1)", "2 u", "± 95 %", "Monte Carlo: u", "95 %", "")
    for statement in found:
        budget, drawn = statement.budget, statement.monte_carlo
        unit, scale = _SHOWN[budget.unit]
        figures = (
            budget.standard_uncertainty,
            budget.expanded,
            budget.u95,
            drawn.standard_uncertainty,
        )
        table.add_row(
            budget.quantity,
            budget.practice,
            *(f"{scale * figure:.3g}" for figure in figures),
            f"{scale * drawn.low:+.3g} … {scale * drawn.high:+.3g}",
            unit,
        )
    console.print(table)
    console.print(
        f"First order beside Monte Carlo with {draws} random sensors. One limit that dominates "
        "has 95 % within 1.65 u, not 2 u."
    )


def _print_budget(console: Console, budget: Budget) -> None:
    unit, scale = _SHOWN[budget.unit]
    variance = budget.standard_uncertainty**2
    title = f"{budget.quantity}, {budget.practice}"
    table = _table(title, "error", "u", f"effect, {unit}", "share")
    for line in budget.lines:
        share = line.effect**2 / variance
        if share >= _SHARE_SHOWN:
            effect = f"{scale * line.effect:.3g}"
            value = _figure(line.value, line.unit)
            table.add_row(line.name, value, effect, f"{100.0 * share:.1f} %")
    table.add_section()
    table.add_row("combined", "", f"{scale * budget.standard_uncertainty:.3g}", "")
    table.add_row("± 95 %", "", f"{scale * budget.u95:.3g}", "")
    console.print(table)


def _print_assumptions(
    console: Console, assumptions: list[AssumptionEffect], budgets: list[Budget]
) -> None:
    """One row for each assumption that moves an interval."""
    title = "± 95 % at the ends of what is assumed"
    units = [_SHOWN[budget.unit][0] for budget in budgets]
    headings = map(", ".join, zip(("depth", "pitch", "heave ratio"), units, strict=True))
    table = _table(title, "assumption", "value", "range", *headings)
    for assumption in assumptions:
        cells = []
        for budget in budgets:
            scale = _SHOWN[budget.unit][1]
            ends = assumption.u95[budget.unit]
            moved = max(abs(end - budget.u95) for end in ends) >= _MOVE_SHOWN * budget.u95
            cells.append(" … ".join(f"{scale * end:.3g}" for end in ends) if moved else "")
        if any(cells):
            value = _figure(assumption.value, assumption.unit)
            span = " … ".join(f"{end:g}" for end in assumption.range)
            table.add_row(assumption.path, value, span, *cells)
    console.print(table)


def _print_front_ends(console: Console, fronts: dict[str, FrontEnd], rig: Rig) -> None:
    crank_hz = abs(rig.run.crank_rate.value) / (2.0 * math.pi)
    headings = ("", "gain", "pole, Hz", "noise, µV", "attenuation", "lag")
    table = _table(f"front ends, at the crank's {crank_hz:.2g} Hz", *headings)
    for sensor, front in fronts.items():
        table.add_row(
            sensor,
            f"{front.gain:g}",
            f"{front.pole_hz:g}",
            f"{1e6 * front.noise_volts:.2g}",
            f"{100.0 * front.attenuation:.2g} %",
            f"{math.degrees(front.lag):.2g}°",
        )
    console.print(table)
    console.print(
        "Noise: of one conversion, at the terminals. The samples' stamps take the lag out."
    )


def _print_appendix_three(console: Console, found: thesis.AppendixThree) -> None:
    table = _table(f"appendix III of the thesis, {thesis.DEPTH:g} m", "error", "u, mm")
    table.add_row("span", f"{1e3 * found.span:.3g}")
    for name, effect in found.left_out.items():
        table.add_row(f"left out: {name}", f"{1e3 * effect:.2g}")
    table.add_section()
    table.add_row("combined, zeroed", f"{1e3 * found.combined:.3g}")
    console.print(table)
    console.print(
        f"The thesis: span 80 ± 1 mV, so ± {1e3 * found.span_tolerance:.1f} mm as a limit (it "
        f"prints {1e3 * thesis.PRINTED:.1f}). This rig's sensor by its data sheet, zeroed: "
        f"± {1e3 * found.u95:.3g} mm (95 %). It leaves out besides: what zeroing takes away, u "
        f"{1e3 * found.zero_offset:.3g} mm; {1e3 * found.weight_of_water:+.3g} mm for 9800 N/m³ in "
        "the place of the rig's weight of water; the flow past a port, "
        f"{1e3 * found.velocity_head:.3g} mm × Cp; {1e3 * found.excitation:.3g} mm for 1 % of "
        "excitation where the ADC's reference does not follow it; "
        f"{1e3 * found.unvented:.3g} mm/K for a capsule without a vent."
    )


def _table(title: str, *headings: str) -> Table:
    return Table(*headings, title=f"\n{title}", title_justify="left")


def _figure(value: float, unit: str) -> str:
    return f"{value:.3g}" if unit == "1" else f"{value:.3g} {unit}"
