"""How long something took lately: percentiles of its newest durations."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

MIDDLE: Mapping[str, float] = {"p50": 50.0, "p99": 99.0}
"""Percentiles by name: the median, and what one in a hundred is above."""
EXTREME: Mapping[str, float] = {**MIDDLE, "max": 100.0}
"""The same and the largest."""


class Durations:
    """The newest durations of one kind."""

    def __init__(self, pattern: str, kept: int, percentiles: Mapping[str, float] = MIDDLE) -> None:
        """Know none yet.

        Args:
            pattern: what a percentile is called, with the unit: ``took_{}_ms``.
            kept: how many are looked back on.
            percentiles: in percent, by name.
        """
        self._percents = {pattern.format(name): percent for name, percent in percentiles.items()}
        self._values: NDArray[np.float64] = np.zeros(kept)
        self._count = 0

    def add(self, value: float) -> None:
        """Enter one."""
        self._values[self._count % len(self._values)] = value
        self._count += 1

    def percentiles(self) -> dict[str, float]:
        """Return each percentile by its full name; nothing before the first duration."""
        if not self._count:
            return {}
        found = np.percentile(self._values[: self._count], list(self._percents.values()))
        return dict(zip(self._percents, found.tolist(), strict=True))
