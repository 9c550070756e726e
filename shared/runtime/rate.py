"""How fast something goes: counts over a sliding stretch of time."""

from collections import deque

from shared.clock import Clock


class Rate:
    """Events per second over the last few seconds."""

    def __init__(self, clock: Clock, seconds: float = 5.0) -> None:
        """Start counting.

        Args:
            clock: measures the stretch.
            seconds: its length.
        """
        self._clock = clock
        self._seconds = seconds
        self._started_at = clock.now()
        self._counts: deque[tuple[float, int]] = deque(maxlen=4096)

    def add(self, count: int) -> None:
        """Count so many events now."""
        self._counts.append((self._clock.now(), count))

    def per_second(self) -> float:
        """Return the mean rate over the stretch, shorter right after the start."""
        now = self._clock.now()
        while self._counts and self._counts[0][0] < now - self._seconds:
            self._counts.popleft()
        elapsed = min(now - self._started_at, self._seconds)
        return sum(count for _, count in self._counts) / elapsed if elapsed > 0.0 else 0.0
