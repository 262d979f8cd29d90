# SPDX-License-Identifier: Apache-2.0
"""Sections of the rig file that describe the tow: drive, lines, depressor and tow-fish."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from towtank_rig.quantity import SI, Quantity, Section, Vector, rig_fault

Length = Annotated[Quantity, SI("m", gt=0)]
Mass = Annotated[Quantity, SI("kg", gt=0)]
Inertia = Annotated[Quantity, SI("kg m^2", gt=0)]
Coefficient = Annotated[Quantity, SI("1", ge=0)]


class Motion(Section):
    """Law of the tow point's heave over the crank angle (see towtank_rig.motion)."""

    kind: Literal["sine", "slider_crank"]
    crank_radius: Annotated[Quantity, SI("m", ge=0)]
    rod_length: Length | None = None

    @model_validator(mode="after")
    def _rod_fits(self) -> "Motion":
        if self.kind == "sine" and self.rod_length is not None:
            raise rig_fault(
                "a sine motion has no rod", "remove it or use slider_crank", at="rod_length"
            )
        if self.kind == "slider_crank":
            if self.rod_length is None:
                raise rig_fault("a slider crank needs its rod", "add '<number> m'", at="rod_length")
            if self.rod_length.value <= self.crank_radius.value:
                raise rig_fault(
                    "the rod is not longer than the crank", "correct it", at="rod_length"
                )
        return self


class TowPoint(Section):
    """Upper end of the primary line.

    ``height`` is the z of the tow point (m, up from still water) at zero displacement of the
    motion law. A slider crank's mean lies about r²/4l above it.
    """

    height: Annotated[Quantity, SI("m")]
    motion: Motion


class Run(Section):
    """What the carriage and the crank do in one trial.

    ``settling_time``: steady running before the log, in which the tow comes up from where it hung
    at rest; where the tank is short it may be cut to the low end of its range. Rig files in old
    bags lack it.
    """

    carriage_speed: Annotated[Quantity, SI("m/s", ge=0)]
    crank_rate: Annotated[Quantity, SI("rad/s", ge=0)]
    ramp_time: Annotated[Quantity, SI("s", gt=0)]
    settling_time: Annotated[Quantity, SI("s", ge=0)] = Quantity(value=15.0, unit="s")


Point = Literal["tow_point", "junction", "depressor", "fish"]


class Line(Section):
    """A composite cable between two named points.

    Drag per length is ½ρ·Cn·d·|u_n|u_n normal and (π/2)·ρ·Ct·d·|u_t|u_t along the line; the
    transverse added mass per length is Ca·ρ·πd²/4. Without ``bending_stiffness`` the line is limp;
    with it, it bends between its ends, which carry no moment.
    """

    from_point: Point = Field(alias="from")
    to_point: Point = Field(alias="to")
    length: Length
    diameter: Length
    mass_per_length: Annotated[Quantity, SI("kg/m", gt=0)]
    weight_in_water_per_length: Annotated[Quantity, SI("kg/m")]
    axial_stiffness: Annotated[Quantity, SI("N", gt=0)]
    axial_damping: Annotated[Quantity, SI("N s", ge=0)]
    bending_stiffness: Annotated[Quantity, SI("N m^2", ge=0)] | None = None
    normal_drag: Coefficient
    tangential_drag: Coefficient
    added_mass: Coefficient
    segments: int = Field(ge=1, le=10_000)

    @model_validator(mode="after")
    def _displaces_water(self) -> "Line":
        if self.weight_in_water_per_length.value >= self.mass_per_length.value:
            raise rig_fault(
                "the line weighs as much in water as in air",
                "correct it or mass_per_length",
                at="weight_in_water_per_length",
            )
        if self.from_point == self.to_point:
            raise rig_fault("the line ends where it begins", "correct it", at="to")
        return self


class Lines(Section):
    """The three lines of a two-part tow; all three meet at the junction."""

    primary: Line
    depressor: Line
    secondary: Line

    @model_validator(mode="after")
    def _star_at_the_junction(self) -> "Lines":
        far_ends = {"primary": "tow_point", "depressor": "depressor", "secondary": "fish"}
        for name, far_end in far_ends.items():
            line: Line = getattr(self, name)
            if {line.from_point, line.to_point} != {"junction", far_end}:
                raise rig_fault(
                    f"line {name} runs from {line.from_point} to {line.to_point}",
                    f"it must join junction and {far_end}",
                    at=name,
                )
        return self


class Depressor(Section):
    """A heavy sphere. ``drag`` is on its frontal area, ``added_mass`` on its displaced mass."""

    diameter: Length
    mass: Mass
    apparent_mass_in_water: Mass
    drag: Coefficient
    added_mass: Coefficient

    @model_validator(mode="after")
    def _displaces_water(self) -> "Depressor":
        if self.apparent_mass_in_water.value >= self.mass.value:
            raise rig_fault(
                "the depressor weighs as much in water as in air",
                "correct it or mass",
                at="apparent_mass_in_water",
            )
        return self


class Fin(Section):
    """One plane tail fin. A horizontal fin lifts along z (pitch), a vertical one along y (yaw).

    Its aspect ratio, on which the induced drag depends, is that of a straight fin with this
    ``lift_slope`` (Helmbold), as sim_core takes it: one source for both.
    """

    name: str
    plane: Literal["horizontal", "vertical"]
    area: Annotated[Quantity, SI("m^2", gt=0)]
    position: Vector  # centre of pressure, fish axes
    lift_slope: Annotated[Quantity, SI("1/rad", gt=0)]  # on the fin's own area
    stall_angle: Annotated[Quantity, SI("rad", gt=0, le=1.6)]
    profile_drag: Coefficient  # on the fin's own area, at zero lift
    added_mass: Annotated[Quantity, SI("kg", ge=0)]  # for motion normal to the fin


class Fish(Section):
    """The tow-fish. Axes: x forward, y port, z up; origin at mid-hull, the centre of buoyancy.

    ``mass_in_water_filled`` is the mass that moves with the hull in water, enclosed water
    included; less ``apparent_mass_in_water`` it is the displaced mass. Inertias hold the enclosed
    water too and are about the centre of gravity. ``axial_drag`` is on the frontal area πd²/4,
    ``cross_flow_drag`` on strips of the hull's side, ``added_mass_*`` on the displaced mass.
    ``munk_moment`` scales the destabilising moment of an ideal fluid (1 full, 0 none).
    """

    length: Length
    diameter: Length
    dry_mass: Mass
    mass_in_water_filled: Mass
    apparent_mass_in_water: Annotated[Quantity, SI("kg")]
    pitch_inertia: Inertia
    yaw_inertia: Inertia
    roll_inertia: Inertia
    centre_of_gravity: Vector
    axial_drag: Coefficient
    cross_flow_drag: Coefficient
    added_mass_axial: Coefficient
    added_mass_lateral: Coefficient
    added_pitch_inertia: Annotated[Quantity, SI("kg m^2", ge=0)]  # and yaw: the hull is round
    munk_moment: Annotated[Quantity, SI("1", ge=0, le=1)]
    fins: tuple[Fin, ...] = ()
    tow_point: Vector

    @model_validator(mode="after")
    def _masses_agree(self) -> "Fish":
        if self.dry_mass.value > self.mass_in_water_filled.value:
            raise rig_fault("the dry fish is heavier than the filled", "correct it", at="dry_mass")
        if self.apparent_mass_in_water.value >= self.mass_in_water_filled.value:
            raise rig_fault(
                "the fish displaces no water", "correct it", at="apparent_mass_in_water"
            )
        return self

    @property
    def displaced_mass(self) -> float:
        """Return the mass of the water that the fish displaces, kg."""
        return self.mass_in_water_filled.value - self.apparent_mass_in_water.value
