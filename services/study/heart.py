"""The heart rate of a session: rows of ``hr.tsv`` as they come, and the mean of a baseline."""

import dataclasses
import math
from collections.abc import Iterable

from shared.messages.play import HeartRate


@dataclasses.dataclass
class Window:
    """The measurements of a stretch of time."""

    began_at: float = math.inf
    """By the monotonic clock (s)."""
    beats: int = 0
    """Measurements, with skin at the sensor."""
    total: float = 0.0
    """Their sum (1/min)."""

    def add(self, beats: Iterable[HeartRate]) -> None:
        """Take measurements in."""
        for beat in beats:
            if beat.contact:
                self.beats += 1
                self.total += beat.beats_per_minute

    @property
    def beats_per_minute(self) -> float | None:
        """Return their mean, None without any."""
        return self.total / self.beats if self.beats else None
