"""Whether a series grows: a straight line through the means of equal blocks, with its interval."""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from benchmarks.seeds import T_QUANTILES

LEAST_BLOCKS = 4
BLOCKS = 20


@dataclasses.dataclass(frozen=True)
class Slope:
    """Growth of a series, in its unit a second."""

    value: float
    low: float
    """95 % interval, Student's, over the blocks."""
    high: float
    blocks: int
    mean: float
    """Of the series."""


def slope(times: Sequence[float], values: Sequence[float], blocks: int = BLOCKS) -> Slope | None:
    """Return the growth of a series, None when there is too little of it.

    Neighbouring samples of memory or lateness are not independent; means of blocks nearly are.

    Args:
        times: of the samples (s), rising.
        values: of the samples.
        blocks: of equal duration; fewer where some would be empty.
    """
    if len(times) < LEAST_BLOCKS:
        return None
    at, found = np.asarray(times, float), np.asarray(values, float)
    ends = np.linspace(at[0], at[-1], min(blocks, len(at)) + 1)
    place = np.clip(np.searchsorted(ends, at, side="right") - 1, 0, len(ends) - 2)
    filled = [number for number in range(len(ends) - 1) if np.any(place == number)]
    if len(filled) < LEAST_BLOCKS:
        return None
    x = np.array([at[place == number].mean() for number in filled])
    y = np.array([found[place == number].mean() for number in filled])
    spread = float(np.sum((x - x.mean()) ** 2))
    value = float(np.sum((x - x.mean()) * (y - y.mean()))) / spread
    rest = y - y.mean() - value * (x - x.mean())
    freedom = len(x) - 2
    error = math.sqrt(float(np.sum(rest**2)) / freedom / spread)
    half = T_QUANTILES[min(freedom, len(T_QUANTILES)) - 1] * error
    return Slope(value, value - half, value + half, len(x), float(found.mean()))
