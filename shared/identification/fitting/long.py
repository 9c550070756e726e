"""Fits to long recordings: to some of their parts first.

What the first steps of a fit are after shows in a part of the motion, at a part of the cost; all of
it says where the fit ends.
"""

from dataclasses import replace

from shared.identification.arm.segments import ENOUGH_SECONDS, seconds_of, thinned
from shared.identification.dataset.types import Float64
from shared.identification.fitting.fit import Fit, polish
from shared.identification.fitting.problem import Problem
from shared.identification.fitting.space import Space

_LONG = 2.5
"""Times what shows enough, from which a fit begins with some parts: of fewer it takes as many
derivatives of all to go on from there."""


def some_of(problem: Problem, segments: tuple[int, ...]) -> tuple[int, ...]:
    """Return the parts of recordings that a fit begins with: all, unless there are many.

    Of each recording there is one: what only one of them shows is not left out.
    """
    if seconds_of(problem.segments, segments) < _LONG * ENOUGH_SECONDS:
        return segments
    some = thinned(problem.segments, segments)
    recordings, seen = (
        {problem.segments[index].trajectory for index in each} for each in (segments, some)
    )
    return some if seen == recordings else segments


def polish_on_some(fit: Fit, segments: tuple[int, ...], steps: int) -> tuple[Fit, tuple[int, ...]]:
    """Return where a fit to some recordings leads to on :func:`some_of` their parts, and on which.

    Args:
        fit: where it begins, with the derivative there.
        segments: of the fit.
        steps: the most derivatives.
    """
    problem = fit.space.problem
    some = some_of(problem, segments)
    if some == segments:
        return polish(fit.space, fit, some, steps), some
    begun = replace(fit.on(problem.rows_of(segments, some)), is_rough=fit.is_rough)
    return polish(fit.space, begun, some, steps), some


def polish_by_parts(space: Space, start: Float64, segments: tuple[int, ...], steps: int) -> Fit:
    """Return :func:`polish`, of long recordings by way of some of their parts.

    Args:
        space: what is fitted.
        start: float64[n].
        segments: recordings to fit to.
        steps: the most derivatives, each time.
    """
    some = some_of(space.problem, segments)
    if some != segments:
        start = polish(space, start, some, steps).z
    return polish(space, start, segments, steps)
