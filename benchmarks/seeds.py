"""Means over seeds with 95 % intervals: by Student's t, and of interquartile means by bootstrap."""

import math
import statistics
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

T_QUANTILES = (
    12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228,
    2.201, 2.179, 2.160, 2.145, 2.131, 2.120, 2.110, 2.101, 2.093, 2.086,
)  # fmt: skip
"""Student's t at 97.5 % for 1, 2, ... degrees of freedom; beyond them the last is a little wide."""


def t_interval(values: Sequence[float]) -> dict[str, Any]:
    """Return the mean of one value a seed and its 95 % interval; no interval from one seed."""
    mean = statistics.fmean(values)
    found: dict[str, Any] = {"mean": mean, "low": None, "high": None, "n": len(values)}
    if len(values) > 1:
        quantile = T_QUANTILES[min(len(values) - 1, len(T_QUANTILES)) - 1]
        half = quantile * statistics.stdev(values) / math.sqrt(len(values))
        found |= {"low": mean - half, "high": mean + half}
    return found


def text(interval: dict[str, Any], form: str = ",.0f") -> str:
    """Return ``mean [low, high]``."""
    mean = format(interval["mean"], form)
    if interval["low"] is None:
        return mean
    return f"{mean} [{interval['low']:{form}}, {interval['high']:{form}}]"


class Interval(NamedTuple):
    """A value and its 95 % interval; none from one seed."""

    value: float
    low: float | None
    high: float | None


RESAMPLES = 10_000


def iqm_interval(values: Sequence[float]) -> Interval:
    """Return the mean of the middle half of one value a seed, as Agarwal et al. 2021 advise."""
    return _interval(float(_iqm(np.array(values))), _resampled(values, stream=0))


def ratio_interval(ours: Sequence[float], theirs: Sequence[float]) -> Interval:
    """Return the quotient of two interquartile means; seeds of either side are drawn apart."""
    value = float(_iqm(np.array(ours)) / _iqm(np.array(theirs)))
    return _interval(value, _resampled(ours, stream=1) / _resampled(theirs, stream=2))


def _iqm(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean without the lowest and the highest quarter, along the last axis."""
    out = values.shape[-1] // 4
    return np.sort(values, axis=-1)[..., out : values.shape[-1] - out].mean(axis=-1)


def _resampled(values: Sequence[float], stream: int) -> NDArray[np.float64]:
    rng = np.random.default_rng(stream)
    drawn = rng.integers(0, len(values), (RESAMPLES, len(values)))
    return _iqm(np.array(values)[drawn])


def _interval(value: float, resampled: NDArray[np.float64]) -> Interval:
    low, high = (float(it) for it in np.quantile(resampled, (0.025, 0.975)))
    return Interval(value, low, high) if low < high else Interval(value, None, None)
