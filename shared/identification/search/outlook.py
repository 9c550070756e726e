"""Says beforehand which candidates have no prospect of passing, so that nobody pays for a refit.

Where little more than noise is left, every candidate is small, and what the screen expects of it is
about where a refit ends. So what was held out can be asked before: a candidate that it does not
follow at all, though it could, and whose expected size takes nothing off its loss, is not refitted.
That only leaves candidates out; what passes is judged as ever.
"""

from collections.abc import Callable

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.fitting.linear import least_squares
from shared.identification.gate.held_out import stretches
from shared.identification.search.judging import held_of
from shared.identification.search.screen import Screened
from shared.identification.search.searched import Search

_SMALL = 0.02
"""Share of the training residual up to which what the screen expects is about what comes."""
_FOLLOWED = 1.0
"""Standard errors by which held-out residuals follow what has a prospect; 1.65 are to pass."""
_BEYOND_LINKS = 20.0
"""Of the cost, that a cause may take off which links could make up for on what was held out, so
that this cannot say if it is there; 100 are to pass, but a screen sees less of it than a refit."""
_GAINS = 0.01
"""Of the held-out loss, that has a prospect all the same; 0.04 at least are to pass."""


def hopeless(found: Search) -> Callable[[Screened], bool]:
    """Return what says of a candidate that was looked at that it has no prospect of passing.

    Args:
        found: the search so far.
    """
    if not found.problem.noise.is_white or not found.parts.is_near_noise:
        return lambda one: False
    # Where the base alone wants to go is far, along what hardly shows: no candidate is to blame.
    base = least_squares(found.parts.jacobian, -found.parts.residual)
    return lambda one: _is_hopeless(found, one, base)


def _is_hopeless(found: Search, one: Screened, base: Float64) -> bool:
    problem, current = found.problem, found.current
    quantities = one.candidate.effect.quantities(problem.subject, one.candidate.place)
    if one.candidate.recording is not None or one.share > _SMALL:
        return False
    if any(each.phase or not each.is_smooth for each in quantities):
        return False  # where it acts only from some size on, what is small there is not elsewhere
    space = current.space.grown(one.candidate)
    expected = space.clip(np.r_[current.z + one.shift - base, one.start])
    losses = stretches(problem, space.variant(expected), problem.of("test"))
    before = float(found.current_losses.mean())
    if before - float(losses.mean()) > _GAINS * before:
        return False
    # What the base makes up for is taken out there: it need not go along.
    alone = space.variant(space.clip(np.r_[current.z, one.start]))
    foretold = held_of(found, current).follow(current.variant, alone)
    is_slight = one.share * found.parts.cost < _BEYOND_LINKS
    return (foretold.is_told or is_slight) and foretold.errors < _FOLLOWED
