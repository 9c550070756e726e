"""Fits what was named once more, to all recordings.

Which causes there are is judged on recordings that nothing was fitted to. Once that is done those
may say how large they are, too: of five recordings two would otherwise have no say in it.
"""

from collections.abc import Sequence

from shared.identification.fit import polish
from shared.identification.searched import Search
from shared.identification.verdict import Unexplained

_STEPS = 1
"""Derivatives after the first: it begins where three in five of the recordings lead."""


def fit_to_all(found: Search, left: Sequence[Unexplained]) -> None:
    """Fit a search's model to the held-out recordings, too, if a cause was accepted.

    Held-out recordings in which something pushed the arm, or in which blocks do not count, stay
    out of it.

    Args:
        found: the search, over.
        left: what its model does not explain.
    """
    problem, current = found.problem, found.current
    pushed = {each.trajectory for each in left if each.is_external}
    names = [each.name for each in problem.dataset.trajectories]
    more = tuple(
        segment
        for segment in problem.of("test")
        if segment not in problem.uncounted
        and names[problem.segments[segment].trajectory] not in pushed
    )
    if not found.accepted or not more:
        return
    segments = (*problem.of("train"), *more)
    found.final, found.fitted_to = polish(current.space, current.z, segments, _STEPS), segments
