# SPDX-License-Identifier: Apache-2.0
"""The set of drawings of a rig."""

from __future__ import annotations

from collections.abc import Callable

from towtank_rig import Rig

from towtank_workshop import crank, depressor, junction, tow_fish, whole_tow
from towtank_workshop.sheet import Sheet

SHEETS: dict[str, Callable[[Rig, int, int], Sheet]] = {
    "1_tow_fish": tow_fish.draw,
    "2_depressor": depressor.draw,
    "3_crank": crank.draw,
    "4_junction": junction.draw,
    "5_whole_tow": whole_tow.draw,
}


def draw(rig: Rig) -> dict[str, Sheet]:
    """Return all sheets by the name of their file. DrawingError where one cannot be drawn."""
    count = len(SHEETS)
    return {name: make(rig, n, count) for n, (name, make) in enumerate(SHEETS.items(), 1)}
