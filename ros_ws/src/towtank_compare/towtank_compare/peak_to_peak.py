# SPDX-License-Identifier: Apache-2.0
"""The reading of P. P. Lalu's thesis (section 8.6): half the peak-to-peak heave of a record from
which a tenth is trimmed at each end.

It stands beside the harmonic fit for comparison only. Noise, drift and the tow's slow modes all
add to it, so it exceeds the amplitude at the crank frequency.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from towtank_compare.series import Series

TRIM = 0.1


@dataclass(frozen=True)
class PeakToPeak:
    """Half of the peak-to-peak heave, m, and their ratio."""

    fish: float
    depressor: float
    ratio: float


def read_peak_to_peak(fish: Series, depressor: Series) -> PeakToPeak:
    """Reading over two series of heave, m, each trimmed by itself. Neither may be empty."""
    fish_half, depressor_half = _half_range(fish), _half_range(depressor)
    ratio = fish_half / depressor_half if depressor_half > 0 else float("nan")
    return PeakToPeak(fish_half, depressor_half, ratio)


def _half_range(heave: Series) -> float:
    time = heave.seconds_since(int(heave.stamp_ns[0]))
    inner = heave.values[(time >= TRIM * time[-1]) & (time <= (1 - TRIM) * time[-1])]
    return float(np.ptp(inner)) / 2
