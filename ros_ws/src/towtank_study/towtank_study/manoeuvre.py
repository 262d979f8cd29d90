# SPDX-License-Identifier: Apache-2.0
"""The schema of a manoeuvre study: a single tow behind a ship that turns or stops.

One file says all: water, cable, towed body, manoeuvre, and further cases that change some of it.
Quantities are written as in rig files.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from towtank_rig.quantity import SI, Quantity, Section, rig_fault

Metres = Annotated[Quantity, SI("m", gt=0)]
Kilograms = Annotated[Quantity, SI("kg", gt=0)]
Seconds = Annotated[Quantity, SI("s", gt=0)]
SomeSeconds = Annotated[Quantity, SI("s", ge=0)]
Speed = Annotated[Quantity, SI("m/s", gt=0)]
Coefficient = Annotated[Quantity, SI("1", ge=0)]


class Water(Section):
    """Still water."""

    density: Annotated[Quantity, SI("kg/m^3", gt=0)]
    gravity: Annotated[Quantity, SI("m/s^2", gt=0)]


class Cable(Section):
    """The tow cable, from the ship to the body. Coefficients as in rig files: Cn on the diameter,
    Ct on the skin, Ca of the displaced mass."""

    length: Metres
    diameter: Metres
    mass_per_length: Annotated[Quantity, SI("kg/m", gt=0)]
    weight_in_water_per_length: Annotated[Quantity, SI("N/m", ge=0)]
    axial_stiffness: Annotated[Quantity, SI("N", gt=0)]
    normal_drag: Coefficient
    tangential_drag: Coefficient
    added_mass: Coefficient
    segments: int = Field(ge=2, le=10_000)


class TowedBody(Section):
    """What hangs at the end, a point with mass. drag_area: Cd A, the same in all directions."""

    mass: Kilograms
    apparent_mass_in_water: Annotated[Quantity, SI("kg")]
    drag_area: Annotated[Quantity, SI("m^2", ge=0)]
    added_mass: Annotated[Quantity, SI("kg", ge=0)]

    @model_validator(mode="after")
    def _displaces_something(self) -> Self:
        if self.apparent_mass_in_water.value > self.mass.value:
            raise rig_fault(
                "it weighs more in water than in air", "exchange the two", "apparent_mass_in_water"
            )
        return self


class Turn(Section):
    """Straight, turn to port at constant speed, straight again (sim_core's Turn)."""

    kind: Literal["turn"]
    speed: Speed
    start: Seconds
    angle: Annotated[Quantity, SI("rad", gt=0)]
    circle_time: Seconds
    entry_time: SomeSeconds
    end: Seconds


class Stop(Section):
    """Straight, then to rest within `stopping_time` (sim_core's EmergencyStop)."""

    kind: Literal["stop"]
    speed: Speed
    start: Seconds
    stopping_time: SomeSeconds
    end: Seconds


class Manoeuvre(Section):
    """One manoeuvre study.

    step: longest time step; sample_interval: of the recorded histories. cases: by name, what each
    changes, dotted path to value as it would stand here. statement: what somebody said about it.
    """

    name: str = Field(pattern=r"^[\w.-]+$")
    description: str
    water: Water
    cable: Cable
    body: TowedBody
    manoeuvre: Annotated[Turn | Stop, Field(discriminator="kind")]
    step: Seconds = Quantity(value=0.1, unit="s")
    sample_interval: Seconds = Quantity(value=1.0, unit="s")
    cases: dict[str, dict[str, float | str]] = Field(default={})
    statement: str = ""

    @model_validator(mode="after")
    def _begins_before_it_ends(self) -> Self:
        if self.manoeuvre.end.value <= self.manoeuvre.start.value:
            raise rig_fault("it ends before it starts", "give a later end", "manoeuvre.end")
        return self
