"""How late things were lately: percentiles of the last minute."""

from collections import deque

import numpy as np

KEPT = 6000


class Timing:
    """The last times of one kind (ms)."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._times: deque[float] = deque(maxlen=KEPT)

    def add(self, milliseconds: float) -> None:
        """Take one more."""
        self._times.append(milliseconds)

    def percentiles(self) -> dict[str, float]:
        """Return median, 99th percentile and maximum by name; nothing before the first."""
        if not self._times:
            return {}
        p50, p99, largest = np.percentile(np.fromiter(self._times, np.float64), (50, 99, 100))
        return {
            f"{self._name}_p50_ms": float(p50),
            f"{self._name}_p99_ms": float(p99),
            f"{self._name}_max_ms": float(largest),
        }
