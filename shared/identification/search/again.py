"""A second search, where something outside pushed the arm: without what it did."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from shared.identification.arm.segments import seconds_of
from shared.identification.fitting.problem import Span
from shared.identification.gate.held_out import FEWEST, stretches
from shared.identification.leftover.pushes import not_counted
from shared.identification.search.once import is_named
from shared.identification.search.screen import Seen
from shared.identification.search.searched import Search
from shared.identification.verdict import Unexplained

_KEPT = 0.5
"""Share of what was fitted to that has to be left without what was pushed."""


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


def pushed_in(found: Search, left: Sequence[Unexplained]) -> tuple[Span, ...]:
    """Return what something outside pushed of what was fitted to, to be fitted to no more.

    A push at the hand is one at many joints. If it was not named, the base has been bent to make
    up for it, and nothing else can be seen beside that.

    Args:
        found: the search, over.
        left: what its model does not explain.

    Returns:
        Nothing where nothing was pushed, or too little would be left to fit to.
    """
    spans = tuple(
        Span(each.trajectory, each.begin, each.end)
        for each in left
        if each.is_external and not is_named(found, each)
    )
    problem = found.problem
    without = replace(problem, aside=(*problem.aside, *spans))
    kept, all_of_it = (seconds_of(each.segments, each.of("train")) for each in (without, problem))
    return without.aside if _KEPT * all_of_it <= kept < all_of_it else ()
