# SPDX-License-Identifier: Apache-2.0
"""Ballast and trim of a tow-fish from weighings in air and in water.

Axes are the fish's: x forward, z up, the origin at mid-hull. All forces are counted as masses, for
gravity cancels. Weighed drained in air on supports at x_i with readings m_i, and hung in water, the
hull flooded, from scales at x_i with readings w_i (below zero: held down),

    mass m = Σ m_i,  x_G = Σ m_i x_i / m;   apparent mass w = Σ w_i,  moment X = Σ w_i x_i,

and what the hull's parts displace is m − w at x_B = (m x_G − X)/(m − w). The enclosed water weighs
as much as it displaces and shifts nothing.

Hung in water by its tow point (x_T, z_T), the fish comes to rest at the pitch θ (positive bow down)
at which all apparent masses balance: X_T + tan θ · Z_T = 0, X_T = X − w x_T, and Z_T the same
moment upwards. A mass of apparent mass p, hung on at (x_p, z_p), adds p (x_p − x_T) and
p (z_p − z_T): inclinations by known masses give Z_T, by least squares over the tests.

With the enclosed water the fish has the mass M = w + ρ V, V the envelope's volume with its centre
at the origin, and its centre of gravity, that of the rig file, lies at (X/M, Z/M).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field, model_validator
from towtank_rig.quantity import SI, Quantity, Section, rig_fault
from towtank_uncertainty.combination import Estimate

from towtank_lab.errors import ProcedureError
from towtank_lab.propagation import Propagated, propagate, within_range

Place = Annotated[Quantity, SI("m")]
ApparentMass = Annotated[Quantity, SI("kg")]
Density = Annotated[Quantity, SI("kg/m^3", gt=0)]
Pitch = Annotated[Quantity, SI("rad", ge=-1.5, le=1.5)]


class Reading(Section):
    """A scale under or above the fish: where it holds, and what it shows."""

    x: Place
    reading: ApparentMass


class Inclination(Section):
    """Pitch at which the fish hangs in water with a mass on it; ``apparent_mass`` in water."""

    apparent_mass: ApparentMass
    x: Place
    z: Place
    pitch: Pitch


class TowPoint(Section):
    """Where the fish hangs from."""

    x: Place
    z: Place


class Wanted(Section):
    """The fish as it should be, and the ballast to get there.

    ``z`` is where the ballast sits, ``forward`` and ``aft`` the ends of where there is room for it.
    """

    apparent_mass: ApparentMass
    pitch: Pitch
    density: Density
    z: Place
    forward: Place
    aft: Place

    @model_validator(mode="after")
    def _room(self) -> Wanted:
        if self.aft.value >= self.forward.value:
            raise rig_fault("the aft end lies before the forward end", "exchange them", at="aft")
        return self


class Weighings(Section):
    """A file of `towtank trim`. A quantity's range is the limits of its uncertainty."""

    name: str
    description: str = ""
    water_density: Density
    envelope_volume: Annotated[Quantity, SI("m^3", gt=0)] | None = None
    tow_point: TowPoint
    in_air: tuple[Reading, ...] = Field(min_length=1)
    in_water: tuple[Reading, ...] = Field(min_length=1)
    inclinations: tuple[Inclination, ...] = ()
    wanted: Wanted | None = None


@dataclass(frozen=True)
class Ballast:
    """One piece: mass (kg, in air) at x (m), and the same as two pieces at the ends of the room.

    A negative mass means that so much is to be taken away there.
    """

    mass: Propagated
    x: Propagated
    forward_mass: Propagated
    aft_mass: Propagated


@dataclass(frozen=True)
class Trim:
    """What the weighings tell, by name with its unit, and the ballast if one is wanted."""

    results: Mapping[str, tuple[Propagated, str]]
    ballast: Ballast | None
    notes: tuple[str, ...]


def evaluate(weighings: Weighings) -> Trim:
    """Return masses, volume, centres, resting pitch and ballast, each with its uncertainty.

    Raises ProcedureError where the readings do not carry what is wanted.
    """
    inputs = _inputs(weighings)
    balance = _Balance(weighings)
    formulas = {
        "mass": (balance.mass, "kg"),
        "apparent_mass_in_water": (balance.apparent_mass, "kg"),
        "displaced_volume": (balance.volume, "m^3"),
        "centre_of_gravity_x": (balance.gravity_x, "m"),
        "centre_of_buoyancy_x": (balance.buoyancy_x, "m"),
    }
    if weighings.inclinations:
        formulas["moment_upwards"] = (balance.moment_z, "kg m")
        formulas["resting_pitch"] = (balance.resting_pitch, "rad")
    if weighings.envelope_volume is not None:
        formulas["filled_mass"] = (balance.filled_mass, "kg")
        formulas["filled_centre_of_gravity_x"] = (balance.filled_x, "m")
        if weighings.inclinations:
            formulas["filled_centre_of_gravity_z"] = (balance.filled_z, "m")
    values = {name: estimate.value for name, estimate in inputs.items()}
    if balance.mass(values) <= balance.apparent_mass(values):
        raise ProcedureError("the fish weighs as much in water as in air: check the readings")
    results = {name: (propagate(f, inputs), unit) for name, (f, unit) in formulas.items()}
    ballast = _ballast(weighings, balance, inputs) if weighings.wanted else None
    return Trim(results, ballast, tuple(_notes(weighings, results, ballast)))


def _ballast(weighings: Weighings, balance: _Balance, inputs: Mapping[str, Estimate]) -> Ballast:
    wanted = weighings.wanted
    assert wanted is not None
    if wanted.pitch.value != 0.0 and not weighings.inclinations:
        raise ProcedureError(
            "a pitch is wanted, but how stiff the fish is in pitch is not known: add inclinations"
        )
    values = {name: estimate.value for name, estimate in inputs.items()}
    added = balance.added(values)
    lightness = 1.0 - weighings.water_density.value / wanted.density.value
    if added == 0.0 or added * lightness <= 0.0:
        kind = "denser" if lightness <= 0.0 else "less dense"
        raise ProcedureError(
            f"{added:+.3f} kg of apparent mass are wanted, which a ballast of "
            f"{wanted.density.value:g} kg/m^3 cannot give: take one {kind} than water"
        )
    return Ballast(
        propagate(balance.ballast_mass, inputs),
        propagate(balance.ballast_x, inputs),
        propagate(lambda given: balance.share(given, forward=True), inputs),
        propagate(lambda given: balance.share(given, forward=False), inputs),
    )


def _inputs(weighings: Weighings) -> dict[str, Estimate]:
    """Return all quantities of the file by dotted path."""
    inputs: dict[str, Estimate] = {}

    def collect(node: object, path: str) -> None:
        if isinstance(node, Quantity):
            inputs[path] = within_range(node)
        elif isinstance(node, Section):
            for name in type(node).model_fields:
                collect(getattr(node, name), f"{path}.{name}" if path else name)
        elif isinstance(node, tuple):
            for index, item in enumerate(node):
                collect(item, f"{path}.{index}")

    collect(weighings, "")
    return inputs


class _Balance:
    """The formulas of the module's docstring over the file's quantities by dotted path."""

    def __init__(self, weighings: Weighings) -> None:
        self._air, self._water = len(weighings.in_air), len(weighings.in_water)
        self._tests = len(weighings.inclinations)

    def mass(self, given: Mapping[str, float]) -> float:
        return sum(given[f"in_air.{i}.reading"] for i in range(self._air))

    def apparent_mass(self, given: Mapping[str, float]) -> float:
        return sum(given[f"in_water.{i}.reading"] for i in range(self._water))

    def volume(self, given: Mapping[str, float]) -> float:
        return (self.mass(given) - self.apparent_mass(given)) / given["water_density"]

    def gravity_x(self, given: Mapping[str, float]) -> float:
        moments = (given[f"in_air.{i}.reading"] * given[f"in_air.{i}.x"] for i in range(self._air))
        return sum(moments) / self.mass(given)

    def moment_x(self, given: Mapping[str, float]) -> float:
        return sum(
            given[f"in_water.{i}.reading"] * given[f"in_water.{i}.x"] for i in range(self._water)
        )

    def buoyancy_x(self, given: Mapping[str, float]) -> float:
        displaced = self.mass(given) - self.apparent_mass(given)
        moment = self.mass(given) * self.gravity_x(given) - self.moment_x(given)
        return moment / displaced

    def _about_tow_point_x(self, given: Mapping[str, float]) -> float:
        return self.moment_x(given) - self.apparent_mass(given) * given["tow_point.x"]

    def _about_tow_point_z(self, given: Mapping[str, float]) -> float:
        """Z_T of tan θ_k · Z_T = −(X_T + p_k Δx_k) − tan θ_k p_k Δz_k over all tests."""
        x = self._about_tow_point_x(given)
        numerator = denominator = 0.0
        for k in range(self._tests):
            test = f"inclinations.{k}"
            slope = math.tan(given[f"{test}.pitch"])
            p = given[f"{test}.apparent_mass"]
            along = x + p * (given[f"{test}.x"] - given["tow_point.x"])
            up = p * (given[f"{test}.z"] - given["tow_point.z"])
            numerator += slope * (-along - slope * up)
            denominator += slope**2
        if denominator == 0.0:
            raise ProcedureError(
                "the fish stays level in every inclination: hang on a greater mass, further out"
            )
        return numerator / denominator

    def moment_z(self, given: Mapping[str, float]) -> float:
        hung = self.apparent_mass(given) * given["tow_point.z"]
        return self._about_tow_point_z(given) + hung

    def resting_pitch(self, given: Mapping[str, float]) -> float:
        return math.atan(-self._about_tow_point_x(given) / self._about_tow_point_z(given))

    def filled_mass(self, given: Mapping[str, float]) -> float:
        return self.apparent_mass(given) + given["water_density"] * given["envelope_volume"]

    def filled_x(self, given: Mapping[str, float]) -> float:
        return self.moment_x(given) / self.filled_mass(given)

    def filled_z(self, given: Mapping[str, float]) -> float:
        return self.moment_z(given) / self.filled_mass(given)

    def added(self, given: Mapping[str, float]) -> float:
        """Apparent mass that the ballast must add."""
        return given["wanted.apparent_mass"] - self.apparent_mass(given)

    def ballast_mass(self, given: Mapping[str, float]) -> float:
        return self.added(given) / self._lightness(given)

    def ballast_x(self, given: Mapping[str, float]) -> float:
        return given["tow_point.x"] + self._moment_needed(given) / self.added(given)

    def share(self, given: Mapping[str, float], *, forward: bool) -> float:
        fore, aft = given["wanted.forward"], given["wanted.aft"]
        x = self.ballast_x(given)
        part = (x - aft if forward else fore - x) / (fore - aft)
        return part * self.ballast_mass(given)

    def _lightness(self, given: Mapping[str, float]) -> float:
        return 1.0 - given["water_density"] / given["wanted.density"]

    def _moment_needed(self, given: Mapping[str, float]) -> float:
        """Moment p (x_b − x_T) of the ballast about the tow point for the wanted pitch."""
        slope = math.tan(given["wanted.pitch"])
        if slope == 0.0:
            return -self._about_tow_point_x(given)
        up = self.added(given) * (given["wanted.z"] - given["tow_point.z"])
        return -self._about_tow_point_x(given) - slope * (self._about_tow_point_z(given) + up)


def _notes(
    weighings: Weighings,
    results: Mapping[str, tuple[Propagated, str]],
    ballast: Ballast | None,
) -> list[str]:
    notes = []
    if "moment_upwards" in results and results["moment_upwards"][0].value >= 0.0:
        notes.append("the fish capsizes: its weight acts above its buoyancy; put ballast lower")
    if ballast is not None and weighings.wanted is not None:
        aft, forward = weighings.wanted.aft.value, weighings.wanted.forward.value
        if not aft <= ballast.x.value <= forward:
            notes.append(
                f"the ballast's place {ballast.x.value:+.3f} m lies outside of the room "
                f"{aft:+g} to {forward:+g} m: shift something heavy first, or take the two pieces "
                "and cut away where the mass is negative"
            )
    return notes
