# SPDX-License-Identifier: Apache-2.0
"""Properties of fresh water at atmospheric pressure that depend on its temperature alone."""

from __future__ import annotations

import math

ATMOSPHERE = 101_325.0
"""Standard atmospheric pressure, Pa."""


def viscosity(celsius: float) -> float:
    """Return the dynamic viscosity in Pa s; within 1 % from 253 K to 383 K.

    J. Pátek et al., Reference correlations for thermophysical properties of liquid water at
    0.1 MPa, J. Phys. Chem. Ref. Data 38 (2009), 21, equation 8.
    """
    reduced = (celsius + 273.15) / 300.0
    terms = ((280.68, -1.9), (511.45, -7.7), (61.131, -19.6), (0.45903, -40.0))
    return 1e-6 * sum(factor * reduced**power for factor, power in terms)


def surface_tension(celsius: float) -> float:
    """Return the surface tension against air in N/m (IAPWS release R1-76, revised 2014)."""
    below_critical = 1.0 - (celsius + 273.15) / 647.096
    return 0.2358 * below_critical**1.256 * (1.0 - 0.625 * below_critical)


def vapour_pressure(celsius: float) -> float:
    """Return the saturation pressure over water in Pa (A. L. Buck 1981, as revised in 1996)."""
    return 611.21 * math.exp((18.678 - celsius / 234.5) * celsius / (257.14 + celsius))
