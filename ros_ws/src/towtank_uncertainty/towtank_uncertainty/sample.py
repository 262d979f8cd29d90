# SPDX-License-Identifier: Apache-2.0
"""Uncertainty of one sample, as it goes with the sample through the graph."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SampleUncertainty:
    """Standard uncertainties (k = 1) by scatter (A) and by the rig's budget (B), and the half-width
    of the 95 % interval; in the sample's unit."""

    type_a: float
    type_b: float
    u95: float

    @property
    def combined(self) -> float:
        """Standard uncertainty, type A and B."""
        return math.hypot(self.type_a, self.type_b)


UNKNOWN = SampleUncertainty(math.nan, math.nan, math.nan)
"""Of a sample that is not known, or whose circumstances are not."""
