# SPDX-License-Identifier: Apache-2.0
"""Masses of a rig, what its cables must bear, and the ballast that its fish may need.

Cable loads are the twin's: towed at the rig's speed, the crank brought to its rate over two turns,
then two turns more, over which the least and the greatest tension of each line are taken.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from towtank_lab.trim import Ballast, Reading, TowPoint, Wanted, Weighings, evaluate
from towtank_rig import Quantity, Rig
from towtank_rig.motion import tow_point_motion
from towtank_rig.tow import Line
from towtank_sim.tow import Tow

STEEL, FOAM = 7900.0, 100.0
"""Densities of ballast and of foam, kg/m³: stainless steel 1.4301, a closed-cell foam."""

_ROOM = 0.38  # of the fish's length, to which ballast can be put on either side of mid-hull
_STEP_S = 0.005
_TURNS = 4  # of the crank: as many to bring it up as are looked at
_SCALES = 0.3  # of the length: where the scales of the imagined weighing hold


@dataclass(frozen=True)
class Body:
    """Masses of one part, kg: in air, displaced, and the difference."""

    name: str
    mass: float
    displaced: float

    @property
    def apparent(self) -> float:
        return self.mass - self.displaced


@dataclass(frozen=True)
class Load:
    """What one cable bears, N: steadily towed at its top, and while the crank turns anywhere."""

    name: str
    steady: float
    least: float
    peak: float


@dataclass(frozen=True)
class BallastCase:
    """Ballast for a fish with these figures: kg in water before it, m, and what the trim says."""

    apparent: float
    centre_x: float
    density: float
    ballast: Ballast


def bodies(rig: Rig) -> list[Body]:
    """Return all parts of the tow; the fish with the water that it encloses."""
    fish, depressor = rig.fish, rig.depressor
    found = [
        Body("tow-fish, filled", fish.mass_in_water_filled.value, fish.displaced_mass),
        Body(
            "depressor",
            depressor.mass.value,
            depressor.mass.value - depressor.apparent_mass_in_water.value,
        ),
    ]
    for name, line in _lines(rig):
        length = line.length.value
        mass = length * line.mass_per_length.value
        found.append(
            Body(f"{name} cable", mass, mass - length * line.weight_in_water_per_length.value)
        )
    return found


def loads(rig: Rig) -> list[Load]:
    """Return what the cables bear, towed at the rig's speed with its crank turning.

    Errors of sim_core (ConvergenceError) name place and time.
    """
    speed, rate = rig.run.carriage_speed.value, abs(rig.run.crank_rate.value)
    motion = tow_point_motion(rig.tow_point)
    tow = Tow(rig, 0, _STEP_S)
    tow.start((0.0, 0.0, motion.mean_height), (speed, 0.0, 0.0))
    shapes = tow.line_shapes()
    ends = np.cumsum(shapes.segments)
    tensions = [np.array(shapes.tension)]
    turn = 2.0 * math.pi / rate if rate else 1.0
    for time in np.arange(1, round(_TURNS * turn / _STEP_S) + 1) * _STEP_S:
        share, grows = _begun(float(time) / (_TURNS * turn / 2.0))
        heave, heave_rate = motion.heave_of(rate * float(time), rate)
        rising = share * heave_rate + grows * heave / (_TURNS * turn / 2.0)
        place = (speed * float(time), 0.0, motion.mean_height + share * heave)
        tow.step_to(float(time), place, (speed, 0.0, rising))
        if share == 1.0:
            tensions.append(np.array(tow.line_shapes().tension))
    found = []
    for name, begin, end in zip(shapes.names, (0, *ends), ends, strict=False):
        steadily, moving = tensions[0][begin], np.array(tensions[1:])[:, begin:end]
        found.append(Load(name, float(steadily), float(moving.min()), float(moving.max())))
    return found


def _begun(share: float) -> tuple[float, float]:
    """Return how far a motion that begins smoothly has come, 0 to 1, and the slope of that."""
    if share >= 1.0:
        return 1.0, 0.0
    return share**2 * (3.0 - 2.0 * share), 6.0 * share * (1.0 - share)


def _lines(rig: Rig) -> list[tuple[str, Line]]:
    return [(name, getattr(rig.lines, name)) for name in ("primary", "depressor", "secondary")]


def resting_pitch(rig: Rig, centre_x: float) -> float:
    """Return the pitch, rad (bow down is positive), at which the fish hangs from its tow point.

    centre_x: of gravity, m, in place of the rig's.
    """
    fish = rig.fish
    apparent, mass = fish.apparent_mass_in_water.value, fish.mass_in_water_filled.value
    along = mass * centre_x - apparent * fish.tow_point.x.value
    upwards = mass * fish.centre_of_gravity.z.value - apparent * fish.tow_point.z.value
    return math.atan2(along, -upwards)


def ballast_cases(rig: Rig) -> list[BallastCase]:
    """Return the ballast to neutral and level for the ends of what the rig says of the fish.

    For each end of the apparent mass that is not zero: with the centre of gravity, x, at both ends
    and as stated. A fish that is too heavy gets foam.
    """
    mass, place = rig.fish.apparent_mass_in_water, rig.fish.centre_of_gravity.x
    cases = []
    for apparent in _ends(mass):
        if abs(apparent) < 1e-6:
            continue
        density = STEEL if apparent < 0.0 else FOAM
        for centre_x in _ends(place):
            trim = evaluate(imagined_weighings(rig, apparent, centre_x, density))
            assert trim.ballast is not None
            cases.append(BallastCase(apparent, centre_x, density, trim.ballast))
    return cases


def _ends(quantity: Quantity) -> list[float]:
    low, high = quantity.range or (quantity.value, quantity.value)
    return sorted({low, quantity.value, high})


def imagined_weighings(rig: Rig, apparent: float, centre_x: float, density: float) -> Weighings:
    """Return what `towtank trim` would be given of a fish with these figures, exact."""
    fish = rig.fish
    aside = _SCALES * fish.length.value
    moment = (fish.displaced_mass + apparent) * centre_x
    room = _ROOM * fish.length.value
    zero = _quantity(0.0, "rad")
    return Weighings(
        name=rig.name,
        water_density=rig.water.density,
        tow_point=TowPoint(x=fish.tow_point.x, z=fish.tow_point.z),
        in_air=(Reading(x=_quantity(centre_x, "m"), reading=fish.dry_mass),),
        in_water=tuple(
            Reading(
                x=_quantity(sign * aside, "m"),
                reading=_quantity((apparent + sign * moment / aside) / 2.0, "kg"),
            )
            for sign in (1.0, -1.0)
        ),
        wanted=Wanted(
            apparent_mass=_quantity(0.0, "kg"),
            pitch=zero,
            density=_quantity(density, "kg/m^3"),
            z=_quantity(0.0, "m"),
            forward=_quantity(room, "m"),
            aft=_quantity(-room, "m"),
        ),
    )


def _quantity(value: float, unit: str) -> Quantity:
    return Quantity(value=value, unit=unit)


def markdown(rig: Rig, factor: float) -> str:
    """Return all tables; factor: of safety of a rope's breaking load over its peak load."""
    lines = [
        f"# Masses of {rig.name}",
        "",
        f"Rig file SHA-256 {rig.sha256[:16]}…; made by `towtank masses`.",
        "",
        *_body_tables(rig),
        *_cable_tables(rig, factor),
        *_trim_tables(rig),
    ]
    return "\n".join(lines) + "\n"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    yield f"| {' | '.join(head)} |"
    yield "|---" * len(head) + "|"
    for row in rows:
        yield f"| {' | '.join(cell.replace('-0.000', '0.000') for cell in row)} |".replace(
            " -", " −"
        )


def _body_tables(rig: Rig) -> Iterator[str]:
    parts = bodies(rig)
    parts.append(Body("all", sum(p.mass for p in parts), sum(p.displaced for p in parts)))
    rows = [
        [
            part.name,
            f"{part.mass:.3f}",
            f"{part.displaced:.3f}",
            f"{part.apparent:.3f}",
            f"{part.apparent * rig.water.gravity.value:.2f}",
        ]
        for part in parts
    ]
    yield "## Parts"
    yield ""
    yield from _table(("", "mass, kg", "displaces, kg", "in water, kg", "weight in water, N"), rows)
    fish = rig.fish
    enclosed = fish.mass_in_water_filled.value - fish.dry_mass.value
    gravity = ", ".join(f"{1e3 * q:g}" for q in fish.centre_of_gravity.value)
    yield ""
    yield (
        f"Tow-fish: {fish.dry_mass.value:g} kg drained, {enclosed:.2f} kg of water enclosed; "
        f"centre of gravity, filled, at ({gravity}) mm from mid-hull, the centre of buoyancy."
    )
    yield ""


def _cable_tables(rig: Rig, factor: float) -> Iterator[str]:
    yield "## Cables"
    yield ""
    rows = []
    for (name, line), load in zip(_lines(rig), loads(rig), strict=True):
        rows.append(
            [
                name,
                f"{line.length.value:g}",
                f"{1e3 * line.diameter.value:.1f}",
                f"{line.weight_in_water_per_length.value * rig.water.gravity.value:.2f}",
                f"{load.steady:.1f}",
                f"{load.least:.1f}",
                f"{load.peak:.1f}",
                f"{factor * load.peak:.0f}",
            ]
        )
    head = (
        "",
        "length, m",
        "⌀, mm",
        "N/m in water",
        "steady, N",
        "least, N",
        "peak, N",
        "to bear, N",
    )
    yield from _table(head, rows)
    yield ""
    yield (
        "Steady tension at the top, then least and peak with the crank turning, as simulated; a "
        "line whose least is not above zero goes slack and snatches. To bear: "
        f"{factor:g} times the peak, for rope, terminals, swivels and shackles alike. The rig file "
        "knows no breaking load: hold the rope's certificate against it. Launching and a carriage "
        "that stops pull more."
    )
    yield ""


def _trim_tables(rig: Rig) -> Iterator[str]:
    fish = rig.fish
    x = fish.centre_of_gravity.x.value
    righting = fish.mass_in_water_filled.value * -fish.centre_of_gravity.z.value
    righting *= rig.water.gravity.value * math.radians(1.0)
    yield "## Trim and ballast"
    yield ""
    if righting > 0.0:
        pitch, further = (math.degrees(resting_pitch(rig, place)) for place in (x, x + 1e-3))
        yield (
            f"At rest the fish hangs at a pitch of {pitch:.1f}° (bow down is positive). A degree "
            f"of pitch is held by {righting:.4f} N m; a centre of gravity 1 mm further forward "
            f"turns the bow down by {further - pitch:.1f}°. Under way flow and fins decide."
        )
    else:
        yield (
            "The centre of gravity does not lie below that of buoyancy: at rest nothing rights the "
            "fish, it stays at any pitch or capsizes. Put ballast lower."
        )
    yield ""
    cases = ballast_cases(rig)
    if not cases:
        yield "The rig states a neutral fish without a range: no ballast follows. Weigh it."
        return
    yield (
        "Ballast to neutral and level, by `towtank trim`, at the ends of what the rig says; after "
        "the real weighings that command gives the real ones. Pieces: the same as two, at "
        f"±{_ROOM * fish.length.value:.2f} m; a negative one is to be taken away there."
    )
    yield ""
    rows = [
        [
            f"{case.apparent:+.3f}",
            f"{1e3 * case.centre_x:+.0f}",
            "steel" if case.density == STEEL else "foam",
            f"{case.ballast.mass.value:.3f}",
            f"{case.ballast.x.value + 0.0:+.3f}",
            f"{case.ballast.forward_mass.value:+.3f}",
            f"{case.ballast.aft_mass.value:+.3f}",
        ]
        for case in cases
    ]
    yield from _table(
        ("in water, kg", "centre x, mm", "", "mass, kg", "at x, m", "forward, kg", "aft, kg"), rows
    )
