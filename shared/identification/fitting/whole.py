"""Fits what a search came to once more, to all recordings.

Which causes there are is judged on recordings that nothing was fitted to. Once that is done those
may say how large they are, too: of five recordings two would otherwise have no say in it. They may
also say how much of what is left comes of what the others did not show of the base, a friction
that only one of them begins with: that is no cause.
"""

from collections.abc import Sequence

import numpy as np

from shared.identification.fitting.fit import Fit, go_down, is_foretold
from shared.identification.fitting.together import with_all_together
from shared.identification.gate.held_out import plain_stretches
from shared.identification.search.searched import ByAll, Search, is_open
from shared.identification.verdict import Unexplained

_LONG = (1e-7, 1e-3, 1.0)
"""Factors of damping: the first lets go of all that hardly shows."""


def fit_to_all(found: Search, left: Sequence[Unexplained]) -> None:
    """Fit a search's model to the held-out recordings, too.

    If a cause was accepted, for its size; if much is left, for how much of that remains. Held-out
    recordings in which something pushed the arm, or in which blocks do not count, stay out of it:
    if all do, sizes are of those that it was fitted to before.

    Args:
        found: the search, over.
        left: what its model does not explain.
    """
    found.final, found.fitted_to, found.by_all = None, (), None
    problem, current = found.problem, found.current
    pushed = {each.trajectory for each in left if each.is_external}
    names = [each.name for each in problem.dataset.trajectories]
    more = tuple(
        segment
        for segment in problem.of("test")
        if segment not in problem.uncounted
        and names[problem.segments[segment].trajectory] not in pushed
    )
    is_asked = is_open(found) and problem.noise.is_measured and bool(more)
    if not (found.accepted or is_asked):
        return
    train, fit = problem.of("train"), current
    segments = (*train, *more)
    if more:
        fit = go_down(_with_more(current, more), segments)
    if found.accepted:
        fit = _settled(fit, segments)
        found.final, found.fitted_to = fit, segments
    if is_asked:
        both = [_left(fit, segments, of) for of in (train, more)]
        found.by_all = ByAll(max(one.new for one in both), max(one.plain for one in both))


def _settled(fit: Fit, segments: tuple[int, ...]) -> Fit:
    """Return a fit with sizes, and intervals, where only what is known of links has a say."""
    begun = _anew(fit, segments)
    found = go_down(begun, segments, _LONG)
    return found if is_foretold(begun, found) else _anew(found, segments)


def _anew(fit: Fit, segments: tuple[int, ...]) -> Fit:
    return with_all_together(Fit.at(fit.space, fit.z, segments), segments)


def _with_more(fit: Fit, more: tuple[int, ...]) -> Fit:
    """Return a fit as it is on more segments after those that it has."""
    residual, jacobian = fit.space.jacobian(fit.z, more)
    rows = len(fit.residual) - fit.space.size
    return Fit.of(
        fit.space,
        fit.z,
        np.concatenate([fit.residual[:rows], residual]),
        np.concatenate([fit.jacobian[:rows], jacobian]),
    )


def _left(fit: Fit, segments: tuple[int, ...], of: tuple[int, ...]) -> ByAll:
    """Return the mean square residuals of some of the segments of a fit."""
    problem = fit.space.problem
    rows = problem.rows_of(segments, of)
    plain = plain_stretches(problem, fit.variant, of)
    return ByAll(float(np.mean(fit.residual[: len(rows)][rows] ** 2)), float(plain.mean()))
