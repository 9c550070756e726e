"""Noise that is carried on from one block to the next.

A disturbance of 0.1 s moves a joint for longer, so neighbouring blocks of a residual say nearly the
same. Taken as independent they count a slow error for more, and what is fast for far less, than
they say of it. What is new in each block is white: least squares of that weigh every frequency by
how little noise has of it (Cochrane and Orcutt 1949).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.noise.quiet import level_of

_MOST = 0.95
"""Of a block's noise in the next one: what is slow counts for something all the same."""


@dataclass(frozen=True)
class Memory:
    """How much of a block's noise is in the next one (an AR(1) process)."""

    kept: Float64
    """float64[C], that share, of each channel (1)."""
    fresh: Float64
    """float64[C], standard deviation of the rest, in noise floors."""

    def news(self, residuals: Float64) -> Float64:
        """Return what is new in each block: float64[B, C], of variance 1 where all is noise.

        Args:
            residuals: float64[B, C], in noise floors, of one recording or part.
        """
        fresh = (residuals[1:] - self.kept * residuals[:-1]) / self.fresh
        return np.concatenate([residuals[:1], fresh])

    def beside(self, other: "Memory") -> "Memory":
        """Return that of these channels, then of others."""
        return Memory(np.r_[self.kept, other.kept], np.r_[self.fresh, other.fresh])


def memory_of(series: Sequence[Float64], scale: float, rounding: Float64) -> Memory:
    """Return how much of a noise is carried on.

    Args:
        series: float64[B, C] each, blocks that follow each other.
        scale: of what they are, to be noise in noise floors.
        rounding: float64[C], what the steps of a reading hide, in noise floors.
    """
    long = [each for each in series if len(each) > 1]
    if not long:
        return Memory(np.zeros_like(rounding), np.ones_like(rounding))
    kept = np.minimum(level_of(long, scale)[1], _MOST)
    fresh, _ = level_of([each[1:] - kept * each[:-1] for each in long], scale)
    return Memory(kept, np.maximum(fresh, rounding * np.sqrt(1.0 + kept**2)))
