"""How sure the sizes of what was found are, and causes of which the size may as well be nothing."""

from collections.abc import Sequence

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.fitting.whole import fit_to_all
from shared.identification.gate.certainty import CALIBRATED, half_widths, is_there
from shared.identification.search.fewer import doubtful, take_back, without
from shared.identification.search.searched import Search, Tried, is_open
from shared.identification.verdict import Unexplained


def widths_of(found: Search) -> Float64:
    """Return float64[n], half widths of the coordinates' intervals.

    What is no noise does not shrink with more recordings, so the wider one of two fits is told;
    but of a cause that only all recordings together show, what they say.
    """
    train = found.problem.of("train")
    first = half_widths(found.current, train)
    if found.final is None:
        return first
    last = half_widths(found.final, found.fitted_to)
    widths = np.maximum(first, last)
    for each in found.accepted:
        if not is_there(found.current, each.candidate, train):
            where = found.current.space.where(each.candidate)
            widths[where] = last[where]
    return widths


def take_back_sizeless(found: Search, left: Sequence[Unexplained]) -> None:
    """Take back what would be named with an interval that has nothing in it.

    A mass of which only its moment is known, as it may be anywhere: held-out motion follows
    something, and what that is nobody can say.

    Args:
        found: a search that is over, fitted to all recordings.
        left: what its model does not explain.
    """
    train, test = found.problem.of("train"), found.problem.of("test")
    for each in doubtful(found.accepted)[::-1]:
        is_told = not found.rivals[found.accepted.index(each)]
        if is_told and _may_be_nothing(found, each) and not is_open(found):
            take_back(found, each, without(found, each, train, test))
            fit_to_all(found, left)


def _may_be_nothing(found: Search, each: Tried) -> bool:
    """Return whether the interval of a cause's first number has nothing in it.

    If no other number is of the same unit: of the two angles of a tilt either may be nothing.
    """
    subject, candidate = found.problem.subject, each.candidate
    first, *others = candidate.effect.quantities(subject, candidate.place)
    if any(other.unit == first.unit for other in others):
        return False
    own = found.told.space.where(candidate).start
    return bool(abs(found.told.z[own]) < CALIBRATED * widths_of(found)[own])
