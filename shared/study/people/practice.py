"""How skill grows with practice: the two laws that are argued about.

Power law: Newell & Rosenbloom 1981, in Anderson (ed.), Cognitive Skills and Their Acquisition.
Exponential law, which fits single people better: Heathcote, Brown & Mewhort 2000, Psychonomic
Bulletin & Review 7:185.
"""

import math
from typing import Literal

Law = Literal["exponential", "power"]


def learned(law: Law, rate: float, games: float) -> float:
    """Return how much of what can be learned has been learned, in [0, 1).

    Args:
        law: ``exponential``: 1 - exp(-rate n); ``power``: 1 - (1 + n)^-rate.
        rate: of learning, per game or as exponent; 0 learns nothing.
        games: of practice, n.
    """
    if law == "exponential":
        return -math.expm1(-rate * games)
    return -math.expm1(-rate * math.log1p(games))


def counting(specific: float, here: int, everywhere: int) -> float:
    """Return how many games of practice count against one opponent.

    Args:
        specific: share of what is learned that is of use against the same opponent only, in
            [0, 1]; 0: a change of opponent costs nothing (the null).
        here: games played against this opponent.
        everywhere: games played against anybody, these among them.
    """
    return specific * here + (1.0 - specific) * everywhere
