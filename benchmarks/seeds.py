"""Means over seeds with 95 % t-intervals."""

import math
import statistics
from collections.abc import Sequence
from typing import Any

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
