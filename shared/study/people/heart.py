"""A heart that follows effort: first order, faster up than down.

Highest rate by age, 208 - 0.7 age: Tanaka, Monahan & Seals 2001, J. Am. Coll. Cardiol. 37:153.
Effort in the middle of the reserve between the resting and the highest rate (Karvonen 1957). The
time constants are of the size of those of the on- and off-kinetics of moderate exercise, about
half a minute and a minute; the share of the reserve that walking takes is invented.
"""

import math
from typing import Final

RISE_SECONDS: Final = 25.0
FALL_SECONDS: Final = 50.0
WALKING: Final = 0.18
"""Share of the reserve that a slow walk takes."""
STANDING: Final = 0.06
"""The same of standing ready with a bat."""
FULL_SPEED: Final = 0.5
"""Mean speed of the hand that takes all that a game takes of a person (m/s; invented)."""


class Heart:
    """One person's heart."""

    def __init__(self, resting: float, age: float) -> None:
        """Be at rest.

        Args:
            resting: heart rate, seated (1/min).
            age: years.
        """
        self.resting = resting
        self._reserve = 208.0 - 0.7 * age - resting
        self.rate = resting
        """Now (1/min)."""

    def go_on(self, effort: float, seconds: float) -> float:
        """Return the heart rate after so long at an effort (share of the reserve, 0 to 1)."""
        wanted = self.resting + self._reserve * min(max(effort, 0.0), 1.0)
        constant = RISE_SECONDS if wanted > self.rate else FALL_SECONDS
        self.rate = wanted + (self.rate - wanted) * math.exp(-seconds / constant)
        return self.rate


def effort_of(hand_speed: float, exertion: float) -> float:
    """Return the effort of a game (share of the reserve).

    Args:
        hand_speed: lately, mean (m/s).
        exertion: of the person at full effort.
    """
    return STANDING + (exertion - STANDING) * min(hand_speed / FULL_SPEED, 1.0)
