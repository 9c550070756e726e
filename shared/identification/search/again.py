"""A second search, where something outside pushed the arm in what was held out."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from shared.identification.gate.held_out import FEWEST, stretches
from shared.identification.leftover.pushes import not_counted
from shared.identification.search.screen import Seen
from shared.identification.search.searched import Search
from shared.identification.verdict import Unexplained


def fresh(found: Search, seed: int) -> Search:
    """Return the same as one that has just begun, for one more try with other losses."""
    return replace(
        found,
        rng=np.random.default_rng([seed, 2]),
        seen=Seen(),
        screened=dict(found.screened),
        tried=dict(found.tried),
        accepted=list(found.accepted),
        rivals=list(found.rivals),
    )


def leave_out(found: Search, left: Sequence[Unexplained]) -> bool:
    """Judge without the held-out stretches in which something outside pushed; return if there are.

    Where nearly all of what is held out would go, all of it is kept.
    """
    problem = found.problem
    for segment in problem.of("test"):
        name = problem.dataset.trajectories[problem.segments[segment].trajectory].name
        spans = [
            (each.begin, each.end) for each in left if each.is_external and each.trajectory == name
        ]
        if spans:
            problem.uncounted[segment] = not_counted(problem, segment, spans)
    test = problem.of("test")
    losses = stretches(problem, found.base.variant, test)
    if len(losses) < FEWEST:
        problem.uncounted.clear()
    if not problem.uncounted:
        return False
    nothing = found.base.space.variant(np.zeros(found.base.space.size))
    found.nominal_losses = stretches(problem, nothing, test)
    found.base_losses = losses
    found.current_losses = stretches(problem, found.current.variant, test)
    return True
