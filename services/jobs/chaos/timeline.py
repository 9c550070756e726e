"""How fast the learner learns, before a fault and after it."""

import bisect
import itertools
import statistics

WINDOW = 2.0
"""Seconds over which samples are counted for a rate."""
FULL = 0.8
"""Share of the median before at which a rate is full again."""
STEP = 0.1
"""Seconds between the beginnings of the windows that are looked at."""
CALM_WINDOWS = 30
"""Newest undisturbed windows whose median is the rate before a fault."""


class Timeline:
    """Samples that the learner has learned from, by the moment at which that was entered."""

    def __init__(self) -> None:
        """Know nothing yet."""
        self._at: list[float] = []
        self._totals: list[int] = [0]
        self._calm: list[float] = []

    def add(self, at: float, samples: int) -> None:
        """Count samples; instants never go back (s)."""
        self._at.append(at)
        self._totals.append(self._totals[-1] + samples)

    def rate(self, begin: float, end: float) -> float:
        """Return samples a second after ``begin`` and until ``end`` (s)."""
        first, last = (bisect.bisect_right(self._at, moment) for moment in (begin, end))
        return (self._totals[last] - self._totals[first]) / (end - begin)

    def note_calm(self, begin: float, end: float) -> None:
        """Take the windows of a stretch in which nobody disturbed anything."""
        count = int((end - begin) / WINDOW)
        edges = [begin + index * WINDOW for index in range(count + 1)]
        self._calm += [self.rate(*pair) for pair in itertools.pairwise(edges)]

    @property
    def base(self) -> float:
        """Return the median rate of the newest calm windows, 0 before the first."""
        return statistics.median(self._calm[-CALM_WINDOWS:]) if self._calm else 0.0

    def full_from(self, earliest: float, now: float) -> float | None:
        """Return where the first window begins whose rate is full.

        Args:
            earliest: no window begins before (s).
            now: every window has ended by then (s).
        """
        wanted = FULL * self.base
        begin = earliest
        while begin + WINDOW <= now:
            if self.rate(begin, begin + WINDOW) >= wanted:
                return begin
            begin += STEP
        return None
