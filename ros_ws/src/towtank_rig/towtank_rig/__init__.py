# SPDX-License-Identifier: Apache-2.0
"""Rig files of towtank: schema, loading, sensor conversion."""

from towtank_rig.errors import RigError
from towtank_rig.loading import load_rig, parse_rig
from towtank_rig.quantity import Quantity
from towtank_rig.schema import Rig

__all__ = ["Quantity", "Rig", "RigError", "load_rig", "parse_rig"]
