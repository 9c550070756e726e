"""Asks whether encoders may sit beyond the gears, where nobody said that they do not.

What gives or plays in a gear moves the motor beside the link. Which of both was logged changes what
is seen of it altogether.
"""

from shared.identification.dataset.types import Dataset
from shared.identification.search.screen import screen
from shared.identification.search.searched import Search

_IN_GEARS = ("joint_elasticity", "backlash")
"""Causes that encoders of the link see otherwise."""


def may_be_beyond(dataset: Dataset) -> bool:
    """Return whether nothing says on which side of its gears an arm's encoders are."""
    return dataset.source.kind == "mjcf" and dataset.source.encoders is None


def is_seen_beyond(found: Search, other: Search) -> bool:
    """Return whether what a gear does explains more than anything else, at first sight.

    Args:
        found: a search, over, for which the encoders sit at the motors.
        other: one that has just begun, for which they sit at the links.
    """
    gears = [each for each in other.candidates if each.effect.name in _IN_GEARS]
    shares = [each.share for each in found.screened.values()]
    pieces = other.parts.space.problem.of("train")
    seen = [each.share for each in screen(other.parts, gears, pieces)]
    return max(seen, default=0.0) > max(shares, default=0.0)


def is_of_gears(found: Search) -> bool:
    """Return whether a search that is over has named something in a gear."""
    return any(each.candidate.effect.name in _IN_GEARS for each in found.accepted)
