"""How far the robot's clock is from ours: the least that a stamp was old in the last ten seconds.

A message takes some time and never less than none, so the smallest difference between its arrival
and its stamp is the offset of the clocks plus the shortest way.
"""

import math
from collections import deque
from typing import Final

BIN_SECONDS: Final = 1.0
BINS: Final = 10


class ClockOffset:
    """The minimum of (arrival - stamp) over the last ten seconds."""

    def __init__(self) -> None:
        self._bins: deque[tuple[float, float]] = deque(maxlen=BINS)
        """Start by our monotonic clock, minimum (s)."""

    def offer(self, at: float, delay: float) -> None:
        """Take one message.

        Args:
            at: its arrival by our monotonic clock (s).
            delay: its arrival by our wall clock minus its stamp (s).
        """
        if not math.isfinite(delay):
            return
        if not self._bins or at - self._bins[-1][0] >= BIN_SECONDS:
            self._bins.append((at, delay))
        elif delay < self._bins[-1][1]:
            self._bins[-1] = (self._bins[-1][0], delay)

    def seconds(self, now: float) -> float | None:
        """Return the offset (s), positive where our clock is ahead; None without messages."""
        kept = [least for start, least in self._bins if now - start <= BINS * BIN_SECONDS]
        return min(kept) if kept else None
