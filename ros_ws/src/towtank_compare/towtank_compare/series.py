# SPDX-License-Identifier: Apache-2.0
"""Stamped samples of one quantity."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Series:
    """Samples in the order of their instants, each instant once.

    stamp_ns: int64, shape (n,), ns since the epoch; values: float64, shape (n,).
    """

    stamp_ns: np.ndarray
    values: np.ndarray

    @staticmethod
    def of(stamp_ns: Iterable[int], values: Iterable[float]) -> Series:
        """Series of samples in any order. Whatever order they came in, the same samples give the
        same series: of samples at one instant the smallest stays."""
        stamps = np.asarray(stamp_ns, dtype=np.int64)
        numbers = np.asarray(values, dtype=np.float64)
        order = np.lexsort((numbers, stamps))
        stamps, numbers = stamps[order], numbers[order]
        first = np.ones(len(stamps), dtype=bool)
        first[1:] = stamps[1:] != stamps[:-1]
        return Series(stamps[first], numbers[first])

    def between(self, start_ns: int, end_ns: int) -> Series:
        """Samples with start ≤ stamp ≤ end."""
        low = np.searchsorted(self.stamp_ns, start_ns, side="left")
        high = np.searchsorted(self.stamp_ns, end_ns, side="right")
        return Series(self.stamp_ns[low:high], self.values[low:high])

    def seconds_since(self, origin_ns: int) -> np.ndarray:
        """Instants in s after `origin_ns`."""
        return (self.stamp_ns - origin_ns) * 1e-9

    def __len__(self) -> int:
        return len(self.stamp_ns)
