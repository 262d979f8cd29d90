# SPDX-License-Identifier: Apache-2.0
"""What looks wrong with a sensor: the flags of towtank_interfaces/SensorHealth."""

from __future__ import annotations

import enum

from towtank_interfaces.msg import SensorHealth


class Health(enum.IntFlag):
    """SensorHealth.msg gives the bits and says what each means."""

    OPEN = SensorHealth.OPEN
    SHORT = SensorHealth.SHORT
    SATURATED = SensorHealth.SATURATED
    STUCK = SensorHealth.STUCK
    EXCITATION = SensorHealth.EXCITATION
    NOISE = SensorHealth.NOISE

    @property
    def names(self) -> list[str]:
        """The flags that are set, in words."""
        return [str(flag.name).lower() for flag in self]
