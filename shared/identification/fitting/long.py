"""Fits to long recordings: to some of their parts first.

What the first steps of a fit are after shows in a part of the motion, at a part of the cost; all of
it says where the fit ends.
"""

from collections.abc import Sequence
from dataclasses import replace

from shared.identification.arm.segments import ENOUGH_SECONDS, seconds_of, thinned
from shared.identification.dataset.types import Float64
from shared.identification.fitting.fit import ENOUGH, Fit, polish
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


def polish_better(
    fit: Fit, parts: Problem, starts: Sequence[Float64], segments: tuple[int, ...], steps: int
) -> Fit:
    """Return a fit, or a better one that another start leads to.

    Of long recordings it is told on some short parts which start leads furthest down, and only that
    one is followed.

    Args:
        fit: to recordings.
        parts: the same recordings in short parts.
        starts: float64[n] each.
        segments: of the fit.
        steps: the most derivatives, each time.
    """
    space, pieces = fit.space, parts.of("train")
    some = some_of(parts, pieces)
    if some == pieces or parts is space.problem:
        fits = [polish_by_parts(space, start, segments, steps) for start in starts]
    else:
        short = Space(parts, space.candidates)
        own, *others = (polish(short, start, some, steps) for start in (fit.z, *starts))
        best = min(others, key=lambda each: each.cost)
        if best.cost > own.cost * (1 - ENOUGH):
            return fit
        fits = [polish(space, best.z, segments, steps)]
    return min(fit, *fits, key=lambda each: each.cost)
