"""How long a learner could have learned and had too few samples; what actors are scaled by."""

from shared.clock import Clock


class Starvation:
    """Adds up the time between ticks that was spent without enough samples."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._seconds = 0.0
        self._since: float | None = None

    @property
    def milliseconds(self) -> int:
        """Return the time so far; never less than before."""
        return round(self._seconds * 1e3)

    def end(self) -> None:
        """A tick begins: what the learner waited for may have come."""
        if self._since is not None:
            self._seconds += self._clock.now() - self._since
        self._since = None

    def begin(self, *, is_starved: bool) -> None:
        """A tick is over."""
        self._since = self._clock.now() if is_starved else None
