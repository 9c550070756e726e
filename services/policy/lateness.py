"""How late answers are: the newest of them, by their percentiles."""

import numpy as np
from numpy.typing import NDArray

KEPT = 1000
"""Answers that are looked back on: 10 s at 100 Hz."""


class Lateness:
    """The newest durations."""

    def __init__(self, name: str) -> None:
        """Know nothing yet; ``name`` is that of the quantity, with its unit."""
        self._name = name
        self._values: NDArray[np.float64] = np.zeros(KEPT)
        self._count = 0

    def add(self, value: float) -> None:
        """Enter one."""
        self._values[self._count % KEPT] = value
        self._count += 1

    def percentiles(self) -> dict[str, float]:
        """Return median and 99th percentile by name; nothing before the first value."""
        if not self._count:
            return {}
        values = self._values[: min(self._count, KEPT)]
        p50, p99 = np.percentile(values, [50.0, 99.0])
        return {f"{self._name}_p50": float(p50), f"{self._name}_p99": float(p99)}
