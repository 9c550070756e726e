"""What skill does: from the first game's character to that of somebody who has learned all."""

import dataclasses
from typing import Final

from shared.policy.scripted.person import CLEAREST, Character

BEGINNER: Final = Character(
    tactic=CLEAREST, sight_seconds=0.25, hearing_seconds=0.22, anticipation=0.0, lead=0.0,
    peak_speed=1.2, noise=0.25, spread=0.12, caution=0.0, pause=(0.3, 0.8),
)  # fmt: skip
"""Nothing learned of either faculty."""
MASTER: Final = Character(
    tactic=CLEAREST, sight_seconds=0.20, hearing_seconds=0.17, anticipation=1.0, lead=0.15,
    peak_speed=3.0, noise=0.08, spread=0.08, caution=0.12, pause=(0.3, 0.8),
)  # fmt: skip
"""Everything learned of both."""
READING: Final = ("sight_seconds", "anticipation", "lead", "caution")
"""What belongs to reading the opponent; the rest belongs to the own body and to the game."""


def character_at(body: float, reading: float) -> Character:
    """Return the character of a person who has learned so much.

    Args:
        body: share of what can be learned about moving and about the game, in [0, 1].
        reading: the same about the opponent.
    """

    def between(name: str, start: float, end: float) -> float:
        share = reading if name in READING else body
        return (1.0 - share) * start + share * end

    numbers = {
        name: between(name, getattr(BEGINNER, name), getattr(MASTER, name))
        for name in (
            "sight_seconds", "hearing_seconds", "anticipation", "lead", "peak_speed", "noise",
            "spread", "caution",
        )
    }  # fmt: skip
    return dataclasses.replace(BEGINNER, **numbers)
