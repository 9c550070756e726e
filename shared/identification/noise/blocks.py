"""Means over blocks of time."""

from dataclasses import dataclass

import numpy as np

from shared.identification.dataset.types import Float64


@dataclass(frozen=True)
class Bins:
    """Which readings are averaged."""

    starts: np.ndarray
    """int[B], the first reading of each block."""
    counts: Float64
    """float64[B], how many readings each has."""

    @staticmethod
    def of(at: Float64, block: float) -> "Bins":
        """Return blocks that follow each other from the first instant.

        Args:
            at: float64[T] (s), rising.
            block: length (s); one without a reading is left out.
        """
        number = np.floor((at - at[0]) / block + 1e-6).astype(np.int64)
        starts = np.flatnonzero(np.r_[True, np.diff(number) > 0])
        return Bins(starts, np.diff(np.r_[starts, len(at)]).astype(np.float64))

    def mean(self, values: Float64) -> Float64:
        """Return float64[B, ...] of float64[T, ...]."""
        counts = self.counts.reshape(-1, *(1,) * (values.ndim - 1))
        return np.add.reduceat(values, self.starts, axis=0) / counts


def block_means(at: Float64, values: Float64, block: float) -> Float64:
    """Return float64[B, ...]: means over blocks that follow each other from the first instant.

    Args:
        at: float64[T] (s), rising.
        values: float64[T', ...] of the first T' instants.
        block: length (s); one without a reading is left out.
    """
    return Bins.of(at[: len(values)], block).mean(values)


def beside(joints: Float64, tracker: Float64) -> Float64:
    """Return float64[B, C, ...], joints first, then a tracker, of the blocks that both have."""
    rows = min(len(joints), len(tracker))
    return np.concatenate([joints[:rows], tracker[:rows]], axis=1)
