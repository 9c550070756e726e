"""Noise that is carried on from one block to the next.

A disturbance of 0.1 s moves a joint for longer, so neighbouring blocks of a residual say nearly the
same. Taken as independent they count a slow error for more, and what is fast for far less, than
they say of it. What is new in each block is white: least squares of that weigh every frequency by
how little noise has of it (Cochrane and Orcutt 1949).

A tracker drifts as well, by a third of its noise and for as long as a recording lasts. That hardly
shows in neighbouring blocks, but it is what a mean over a recording is off by: by four times as
much as the rest of the noise would have it. Its level is followed as one that wanders at random
(Muth 1960), and what is new is what that does not foretell.
"""

# pyright: basic
# (scipy's types are partial)

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.signal import lfilter

from shared.identification.dataset.types import Float64
from shared.identification.noise.quiet import level_of

_MOST = 0.95
"""Of a block's noise in the next one: what is slow counts for something all the same."""
_GAINS = (0.0, 0.003, 0.006, 0.01, 0.015, 0.02, 0.03, 0.05, 0.08)
"""Shares of what is new in a block, that a level may go along with it."""


@dataclass(frozen=True)
class Memory:
    """How much of a block's noise is in the next one (an AR(1) process)."""

    kept: Float64
    """float64[C], that share, of each channel (1)."""
    fresh: Float64
    """float64[C], standard deviation of the rest, in noise floors."""
    wanders: Float64 = field(default_factory=lambda: np.zeros(0))
    """float64[C], share of what is new in a block, that the level of those after it goes along with
    (1); empty where none does."""

    def news(self, residuals: Float64) -> Float64:
        """Return what is new in each block: float64[B, C], of variance 1 where all is noise.

        Args:
            residuals: float64[B, C], in noise floors, of one recording or part.
        """
        fresh = _beyond_last(residuals, self.kept) / self.fresh
        for gain in np.unique(self.wanders[self.wanders > 0.0]):
            own = self.wanders == gain
            fresh[:, own] = _beyond_level(fresh[:, own], float(gain))
        return np.concatenate([residuals[:1], fresh])

    def beside(self, other: "Memory") -> "Memory":
        """Return that of these channels, then of others."""
        wanders = np.r_[self._of_each, other._of_each]
        return Memory(np.r_[self.kept, other.kept], np.r_[self.fresh, other.fresh], wanders)

    @property
    def _of_each(self) -> Float64:
        return self.wanders if len(self.wanders) else np.zeros_like(self.kept)


def _beyond_last(residuals: Float64, kept: Float64) -> Float64:
    """Return float64[B - 1, C] without what each block has of the one before it."""
    return residuals[1:] - kept * residuals[:-1]


def _beyond_level(fresh: Float64, gain: float) -> Float64:
    """Return float64[B, C] without a level from 0 on, which goes along with what is new."""
    if gain == 0.0:
        return fresh
    return np.asarray(lfilter([1.0, -1.0], [1.0, gain - 1.0], fresh, axis=0), np.float64)


def wandering(
    memory: Memory, series: Sequence[Float64], scale: float, alike: Sequence[slice]
) -> Memory:
    """Return the same of a noise whose level wanders, if it does.

    Args:
        memory: of its neighbouring blocks alone.
        series: float64[B, C] each, as in :func:`memory_of`.
        scale: the same.
        alike: channels of one kind, which wander alike: one by itself says too little.
    """
    long = [each for each in series if len(each) > 1]
    if not long:
        return memory
    wanders, fresh = np.zeros_like(memory.kept), memory.fresh.copy()
    for own in alike:
        new = [_beyond_last(each[:, own], memory.kept[own]) for each in long]
        levels: list[tuple[float, float, Float64]] = []
        for gain in _GAINS:
            level, _ = level_of([_beyond_level(each, gain) for each in new], scale)
            levels.append((float(np.log(level).mean()), gain, level))
        _, wanders[own], fresh[own] = min(levels, key=lambda one: one[0])
    return replace(memory, fresh=fresh, wanders=wanders)


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
    fresh, _ = level_of([_beyond_last(each, kept) for each in long], scale)
    return Memory(kept, np.maximum(fresh, rounding * np.sqrt(1.0 + kept**2)))
