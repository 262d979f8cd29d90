# SPDX-License-Identifier: Apache-2.0
"""Uncertainty budget of the heave ratio, fish over depressor (GUM, JCGM 100:2008).

What both pressure sensors share (density, gravity, the ADC's reference) scales both amplitudes
alike and cancels.
"""

import math
from dataclasses import replace

from towtank_uncertainty.depth_budget import Component, SensorBudget, distributions
from towtank_uncertainty.intervals import Distribution


def ratio_components(fish: SensorBudget, depressor: SensorBudget) -> tuple[Component, ...]:
    """Return the components of fish amplitude over depressor amplitude, by their ``gain``.

    The name of what one sensor has for itself ends with the sensor's. A shared component acts by
    the difference of its two effects.
    """
    others = {c.name: c for c in depressor.components if c.shared}
    own = [
        replace(c, name=f"{c.name}, {budget.sensor}")
        for budget in (fish, depressor)
        for c in budget.components
        if not c.shared
    ]
    both = []
    for c in fish.components:
        if c.shared:
            other = others.pop(c.name, None)
            both.append(replace(c, gain=abs(c.gain - other.gain) if other else c.gain))
    return (*own, *both, *others.values())


def ratio_relative_uncertainty(fish: SensorBudget, depressor: SensorBudget) -> float:
    """Return the relative standard uncertainty of fish amplitude over depressor amplitude.

    Systematic components only; each amplitude's noise comes on top (``amplitude_noise``).
    """
    return math.hypot(*(c.gain for c in ratio_components(fish, depressor)))


def ratio_errors(fish: SensorBudget, depressor: SensorBudget) -> tuple[Distribution, ...]:
    """Return the distributions of the relative errors of the ratio."""
    return distributions(ratio_components(fish, depressor), lambda c: c.gain)
