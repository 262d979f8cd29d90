# SPDX-License-Identifier: Apache-2.0
"""Heave samples out of a tow that was simulated without ROS, for the analysis of bags."""

from __future__ import annotations

import numpy as np
from towtank_compare.heave import HeaveSamples
from towtank_compare.places import pressure_port
from towtank_compare.series import Series
from towtank_node.names import PLANT, TWIN
from towtank_rig import Rig
from towtank_sim.offline import PlantHistory, TowHistory


def plant_samples(rig: Rig, history: PlantHistory, begin_ns: int = 0) -> HeaveSamples:
    """The plant's own heave and crank. begin_ns: instant of the history's time 0."""
    crank = Series.of(_stamps_ns(history, begin_ns), history.crank_angle)
    return _samples(PLANT, rig, crank, history, begin_ns)


def twin_samples(rig: Rig, crank: Series, history: TowHistory, begin_ns: int = 0) -> HeaveSamples:
    """The heave of a twin that followed a measured crank (rad). begin_ns: as for the plant."""
    return _samples(TWIN, rig, crank, history, begin_ns)


def _samples(
    source: str, rig: Rig, crank: Series, history: TowHistory, begin_ns: int
) -> HeaveSamples:
    stamps = _stamps_ns(history, begin_ns)
    port = history.fish_place(pressure_port(rig).position)
    return HeaveSamples(
        source,
        crank,
        Series.of(stamps, port[:, 2]),
        Series.of(stamps, history.depressor_position[:, 2]),
    )


def _stamps_ns(history: TowHistory, begin_ns: int) -> np.ndarray:
    return begin_ns + np.round(history.time * 1e9).astype(np.int64)
