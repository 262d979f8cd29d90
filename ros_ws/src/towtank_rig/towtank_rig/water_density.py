# SPDX-License-Identifier: Apache-2.0
"""Density of water by temperature and salinity (TEOS-10, by the library gsw)."""

from __future__ import annotations

import itertools

from towtank_rig.quantity import Quantity


def density(celsius: float, salinity: float) -> float:
    """Return the density in kg/m³ at atmospheric pressure.

    salinity: absolute, as a fraction of mass; 0 for fresh water, 0.0352 for standard sea water.
    """
    import gsw  # takes 60 ms, and most rigs state their density

    return float(gsw.rho_t_exact(1e3 * salinity, celsius, 0.0))


def density_of(temperature: Quantity, salinity: Quantity) -> Quantity:
    """Return the density that follows, with the range that theirs give it."""
    value = density(temperature.value, salinity.value)
    corners = itertools.product(*(q.range or (q.value,) for q in (temperature, salinity)))
    around = [value, *(density(*corner) for corner in corners)]
    source = f"TEOS-10 at {temperature} and a salinity of {salinity}"
    return Quantity(
        value=value,
        unit="kg/m^3",
        range=(min(around), max(around)),
        basis="derived",
        source=source,
    )
