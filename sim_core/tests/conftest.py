# SPDX-License-Identifier: Apache-2.0
"""Systems that several tests share."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import sim_core as sc

sys.path.append(str(Path(__file__).parent))  # for the modules beside this one


def composite_cable(
    length: float,
    mass_per_length: float,
    mass_in_water: float,
    stiffness: float,
    damping: float = 0.0,
) -> sc.LineProperties:
    """A cable whose diameter follows from the volume that it displaces in fresh water."""
    area = (mass_per_length - mass_in_water) / 1000.0
    return sc.LineProperties(
        length=length,
        diameter=math.sqrt(4.0 * area / math.pi),
        mass_per_length=mass_per_length,
        axial_stiffness=stiffness,
        axial_damping=damping,
        normal_drag=1.2,
        tangential_drag=0.01,
        added_mass=1.0,
    )


def sphere(builder: sc.ModelBuilder, name: str, mass: float) -> None:
    """The depressor of both rigs: 0.11 m in diameter, Cd 0.47, Ca 0.5."""
    volume = math.pi / 6.0 * 0.11**3
    builder.add_free_point(
        name,
        mass=mass,
        volume=volume,
        drag_area=0.47 * math.pi / 4.0 * 0.11**2,
        added_mass=0.5 * 1000.0 * volume,
    )


def cylinder_fish(
    mass: float,
    axial_drag: float,
    munk_moment: float,
    centre_of_gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    fins: list[sc.Fin] | None = None,
) -> sc.Body:
    """A neutrally buoyant cylinder of 1.3 m × 0.11 m filled evenly; added mass of a long cylinder
    (Ca 1 across, 0 along), no added inertia in roll."""
    length, radius = 1.3, 0.055
    across = mass * (length**2 / 12.0 + radius**2 / 4.0)
    along = mass * radius**2 / 2.0
    added = mass * length**2 / 12.0
    return sc.Body(
        mass=mass,
        inertia=(along, across, across),
        centre_of_gravity=centre_of_gravity,
        volume=mass / 1000.0,
        diameter=2.0 * radius,
        length=length,
        added_mass=(0.0, mass, mass, 0.0, added, added),
        axial_drag=axial_drag,
        cross_flow_drag=1.1,
        munk_moment=munk_moment,
        fins=fins or [],
    )


@pytest.fixture(scope="session")
def wu_chwang_model() -> Callable[..., sc.Model]:
    """The two-part tow of Wu & Chwang (2001)."""

    def make(
        axial_drag: float = 1.0,
        munk_moment: float = 0.0,
        segments: tuple[int, int, int] = (12, 2, 6),
    ) -> sc.Model:
        stiffness = 200e9 * math.pi / 4.0 * 0.002**2  # 2 mm steel wire: 628 kN
        b = sc.ModelBuilder(sc.Water(density=1000.0, gravity=9.81))
        b.add_prescribed_point("tow_point")
        b.add_free_point("junction")
        sphere(b, "depressor", mass=5.25)
        b.add_body("fish", cylinder_fish(12.5, axial_drag, munk_moment))
        lines = {
            "primary": ("tow_point", "junction", 2.84, 0.181, 0.104, None),
            "depressor_cable": ("junction", "depressor", 0.30, 0.063, 0.039, None),
            "secondary": ("junction", "fish", 1.5, 0.124, 0.065, (0.65, 0.0, 0.0)),
        }
        for count, (name, (start, end, length, air, water, place)) in zip(
            segments, lines.items(), strict=True
        ):
            cable = composite_cable(length, air, water, stiffness)
            b.add_line(name, start, end, cable, segments=count, attachment=place)
        return b.build()

    return make


@pytest.fixture(scope="session")
def nit_model() -> Callable[..., sc.Model]:
    """The tank rig of NIT Calicut: short cables on 3 mm wire, tow point above the water, fins."""

    def make(
        segments: tuple[int, int, int] = (10, 3, 7),
        with_fins: bool = True,
        munk_moment: float = 1.0,
        axial_damping: float = 0.0,
    ) -> sc.Model:
        stiffness = 200e9 * math.pi / 4.0 * 0.003**2
        fins = [
            sc.Fin(
                position=(-0.55, *place),
                normal=normal,
                area=0.012,
                lift_slope=3.0,
                drag=0.02,
                stall_angle=0.3,
            )
            for place, normal in (
                ((0.1, 0.0), (0, 0, 1)),
                ((-0.1, 0.0), (0, 0, 1)),
                ((0.0, 0.1), (0, 1, 0)),
                ((0.0, -0.1), (0, 1, 0)),
            )
        ]
        b = sc.ModelBuilder(sc.Water())
        b.add_prescribed_point("tow_point")
        b.add_free_point("junction")
        sphere(b, "depressor", mass=5.25)
        fish = cylinder_fish(
            12.354, 0.4, munk_moment, (0.0, 0.0, -0.01), fins if with_fins else None
        )
        b.add_body("fish", fish)
        lines = {
            "primary": ("tow_point", "junction", 1.2, 0.241, 0.154, None),
            "depressor_cable": ("junction", "depressor", 0.30, 0.083, 0.059, None),
            "secondary": ("junction", "fish", 1.0, 0.144, 0.075, (0.65, 0.0, 0.0)),
        }
        for count, (name, (start, end, length, air, water, place)) in zip(
            segments, lines.items(), strict=True
        ):
            cable = composite_cable(length, air, water, stiffness, axial_damping)
            b.add_line(name, start, end, cable, segments=count, attachment=place)
        return b.build()

    return make


@pytest.fixture(scope="session")
def harmonic() -> Callable[[np.ndarray, np.ndarray, float], complex]:
    """Complex amplitude of the first harmonic: least squares with mean, drift and two harmonics."""

    def fit(time: np.ndarray, values: np.ndarray, period: float) -> complex:
        angle = 2.0 * np.pi * time / period
        basis = np.column_stack(
            [np.ones_like(time), time - time.mean()]
            + [f(k * angle) for k in (1, 2, 3) for f in (np.cos, np.sin)]
        )
        c = np.linalg.lstsq(basis, values, rcond=None)[0]
        return complex(c[2], -c[3])

    return fit


@pytest.fixture(scope="session")
def free_sphere() -> Callable[..., sc.Model]:
    """A sphere on a line so long and light that it is free."""

    def make(mass: float, volume: float, drag_area: float, added_mass: float) -> sc.Model:
        b = sc.ModelBuilder(sc.Water())
        b.add_prescribed_point("far")
        b.add_free_point(
            "sphere", mass=mass, volume=volume, drag_area=drag_area, added_mass=added_mass
        )
        thread = sc.LineProperties(
            length=1000.0, diameter=1e-20, mass_per_length=1e-15, axial_stiffness=1.0
        )
        b.add_line("thread", "far", "sphere", thread, segments=1)
        return b.build()

    return make


@pytest.fixture(scope="session")
def free_body() -> Callable[..., sc.Model]:
    """A body on a line so long and light that it is free."""

    def make(body: sc.Body, water: sc.Water | None = None) -> sc.Model:
        b = sc.ModelBuilder(water or sc.Water())
        b.add_prescribed_point("far")
        b.add_body("fish", body)
        thread = sc.LineProperties(
            length=1000.0, diameter=1e-20, mass_per_length=1e-15, axial_stiffness=1.0
        )
        b.add_line("thread", "far", "fish", thread, segments=1, attachment=(0.0, 0.0, 0.0))
        return b.build()

    return make


@pytest.fixture(scope="session")
def fish_body() -> Callable[..., sc.Body]:
    return cylinder_fish
