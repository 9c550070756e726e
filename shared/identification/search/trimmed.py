"""Parts of recordings in which something happened that led a base astray.

Nothing holds an arm under torque control, so a push in one of a hundred parts weighs more in a sum
of squares than all the others: links bend to make up for it, until what the base was to be fitted
to is worse than with the model as its file has it. A fit of the best three quarters of the parts is
not led by what is in the others (least trimmed squares, Rousseeuw 1984), and shows which they are.
"""

import numpy as np

from shared.identification.arm.parts import CUTS
from shared.identification.dataset.types import Float64
from shared.identification.fitting.fit import polish
from shared.identification.fitting.problem import Problem, Span, Variant
from shared.identification.gate.held_out import stretches
from shared.identification.search.searched import Search

_KEPT = 0.75
"""Share of the parts that is fitted to at least."""
_STANDS_OUT = 8.0
"""Mean square residual of a part, in the usual one's, from which something happened in it: noise
makes a part's three times as much as the usual one's, what a base does not explain five times."""
_ROUNDS = 4
_STEPS = 3
"""Derivatives of each round."""
_BETTER = 0.5
"""Of what a base leaves of what is held out, that one which is not led astray may leave."""


def led_astray(found: Search) -> tuple[Span, ...]:
    """Return what a base had better not be fitted to, since something happened there.

    Args:
        found: a search that has just begun.

    Returns:
        Nothing where a base does no better on what was held out without some parts.
    """
    problem, space = found.problem, found.base.space
    if problem.subject.control != "torque" or problem.noise.is_torque:
        return ()
    train = problem.of("train")
    z, kept = np.zeros(space.size), train
    for _ in range(_ROUNDS):
        happened = _happened(_losses(problem, space.variant(z), train))
        kept, before = tuple(np.array(train)[~happened].tolist()), kept
        if kept == before:
            break
        z = polish(space, z, kept, _STEPS).z
    gone = [each for each in train if each not in kept]
    if not gone:
        return ()
    left = float(stretches(problem, space.variant(z), problem.of("test")).mean())
    return _spans(problem, gone) if left < _BETTER * float(found.base_losses.mean()) else ()


def _losses(problem: Problem, variant: Variant, segments: tuple[int, ...]) -> Float64:
    """Return float64[S], the mean square residual of each part."""
    found = problem.residuals([variant], segments)[0]
    return np.array([float(np.mean(each**2)) for each in found])


def _happened(losses: Float64) -> np.ndarray:
    """Return bool[S], in which parts something happened: the worst, if they are few."""
    least = max(_STANDS_OUT * float(np.median(losses)), float(np.quantile(losses, _KEPT)))
    return losses > least


def _spans(problem: Problem, segments: list[int]) -> tuple[Span, ...]:
    """Return when parts are, those that follow each other as one.

    And the part after them, which begins with a state from readings that are partly of them.
    """
    after = CUTS["torque"].smooth
    out: list[Span] = []
    for index in segments:
        recorded = problem.segments[index].recorded
        name = problem.dataset.trajectories[problem.segments[index].trajectory].name
        end = recorded.begin + float(recorded.joints_at[-1]) + after
        if out and out[-1].trajectory == name and index - 1 in segments:
            out[-1] = out[-1]._replace(end=end)
        else:
            out.append(Span(name, recorded.begin, end))
    return tuple(out)
