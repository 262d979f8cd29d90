# SPDX-License-Identifier: Apache-2.0
"""Encoder counts, and whether they are still those of before: the one judge of a reset.

A reset of the board is told in several ways (its boot frame, its boot count, a time that does not
go on), of which any may get lost. Whatever tells first, the counts begin a new epoch, once.
"""

from __future__ import annotations

from towtank_daq.clock import unwrap


class Counts:
    """Counts of both shafts, unwrapped from 0, where a reset of the board begins them."""

    def __init__(self) -> None:
        self.epoch = 0
        """Counts of different epochs have no known relation."""
        self.boot_count: int | None = None
        """Resets of the board since its power-on, as it has told last."""
        self._epoch_of_last_scan = 0
        self._crank = self._carriage = 0

    @property
    def known(self) -> bool:
        """Whether a scan has come: else there is nothing that a reset could break off."""
        return self._epoch_of_last_scan > 0

    def found(self, boot_count: int) -> None:
        """A board was connected to. The first epoch is its boot count, so that a host that is
        started again goes on in the epoch of the counts."""
        self.boot_count = boot_count
        self.epoch = max(self.epoch, boot_count)

    def tells_of_reset(self, boot_count: int) -> bool:
        """Whether the boot count is another than the one known: of a reset without a boot frame."""
        known, self.boot_count = self.boot_count, boot_count
        return known not in (None, boot_count)

    def begin_anew(self) -> None:
        """The board was reset. However often one reset is told, the epoch is the next one after
        the last scan's, or the boot count if that is more."""
        self._crank = self._carriage = 0
        self.epoch = max(self._epoch_of_last_scan + 1, self.boot_count or 0)

    def scan(self, crank: int, carriage: int) -> tuple[int, int]:
        """Unwrap the 32-bit counts of crank and carriage of the next scan."""
        self._epoch_of_last_scan = self.epoch
        self._crank = unwrap(crank, 32, self._crank)
        self._carriage = unwrap(carriage, 32, self._carriage)
        return self._crank, self._carriage
