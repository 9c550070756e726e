"""Means with 95 % bootstrap intervals; the generator is an argument, so reports repeat exactly."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

RESAMPLES = 2000
_CHUNK = 1 << 22


@dataclasses.dataclass(frozen=True)
class Interval:
    """A mean and how well it is known."""

    mean: float
    low: float
    """2.5 % quantile of the resampled means."""
    high: float
    """97.5 % quantile."""
    count: int
    """Bouts it is the mean of; the smaller side's of a difference."""


def mean_interval(values: Sequence[float], generator: np.random.Generator) -> Interval | None:
    """Return the mean of some bouts, None when there are none."""
    if len(values) == 0:
        return None
    sample = np.asarray(values, np.float64)
    low, high = _quantiles(_means(sample, generator))
    return Interval(float(sample.mean()), low, high, len(sample))


def difference_interval(
    first: Sequence[float], second: Sequence[float], generator: np.random.Generator
) -> Interval | None:
    """Return mean(first) - mean(second) of independent bouts, None when either has none."""
    if len(first) == 0 or len(second) == 0:
        return None
    one, two = np.asarray(first, np.float64), np.asarray(second, np.float64)
    low, high = _quantiles(_means(one, generator) - _means(two, generator))
    return Interval(float(one.mean() - two.mean()), low, high, min(len(one), len(two)))


def _means(sample: NDArray[np.float64], generator: np.random.Generator) -> NDArray[np.float64]:
    """Return float64[RESAMPLES], means of samples drawn with replacement."""
    means = np.empty(RESAMPLES)
    step = max(1, _CHUNK // len(sample))
    for start in range(0, RESAMPLES, step):
        rows = min(step, RESAMPLES - start)
        drawn = generator.integers(0, len(sample), (rows, len(sample)))
        means[start : start + rows] = sample[drawn].mean(axis=1)
    return means


def _quantiles(means: NDArray[np.float64]) -> tuple[float, float]:
    low, high = np.quantile(means, [0.025, 0.975])
    return float(low), float(high)
