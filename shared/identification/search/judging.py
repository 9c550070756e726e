"""What speaks for a cause: what was held out, and all recordings together."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import Fit
from shared.identification.gate.certainty import sureness
from shared.identification.gate.foretold import SURELY, Foretold, Held
from shared.identification.gate.held_out import Gain, Taken, compare
from shared.identification.gate.left_out import left_out
from shared.identification.search.searched import STANDS_OUT, TAKEN_AWAY, Model, Search

_NO_LINKS = 100.0
"""Of the cost, that links cannot make up for: where theirs are 10 % off, the best of all candidates
takes off some 30."""
_PLAINLY, _PLAINLY_EACH = 20.0, 4.0
"""Twice what a cause takes off the cost, at least, and more for each of its numbers: of a hundred
candidates where there is none, the best takes off some 15."""
_WORSE = 1.65
"""Standard errors by which a cause may make all that was held out worse."""


class Judged(NamedTuple):
    """What speaks for a cause."""

    gain: Gain
    """On what was held out."""
    fitted: Float64
    """float64[R], see :class:`Tried`."""
    foretold: Foretold | None
    """The same."""


def judged(found: Search, candidate: Candidate, before: Model, after: Model) -> Judged:
    """Return what a cause takes off what was held out, and how sure that is.

    All recordings make it surer, those that were fitted to with the size that the others give it;
    what nothing was fitted to has to speak for it by more than its standard error all the same.
    So it has to if a cause foretells what stands out there. Of what happened once in a recording
    that was fitted to nothing is sure, see ``search.py``, nor of what explains that worse than
    nothing does.
    """
    gain = compare(before.losses, after.losses, found.rng)
    is_foretold = foretells(before.losses, after.losses)
    more = left_out(before.fit, after.fit, candidate, found.problem.of("train"))
    whole = compare(
        np.concatenate([before.losses, more.before]),
        np.concatenate([after.losses, more.after]),
        found.rng,
    )
    beyond = gain.gain - gain.error
    surely = max(gain.surely, beyond if is_foretold else min(whole.surely, beyond))
    is_once = candidate.recording is not None
    if is_once or after.fit.cost > before.fit.cost:
        surely = -np.inf  # it only frees the base, or has bent it
    foretold = None if is_once else _foretold(found, before.fit, after.fit)
    if foretold is not None and foretold.is_refuted:
        surely = -np.inf  # what goes there the base could do as well
    gain = replace(
        gain,
        surely=surely,
        is_measured=found.problem.noise.is_measured,
        apart=None if _is_surely_worse(gain) else _apart(found, candidate, after.fit, foretold),
        is_far_from_links=_is_far_from_links(before.fit, after.fit, foretold),
    )
    return Judged(gain, more.after, foretold)


def _foretold(found: Search, before: Fit, after: Fit) -> Foretold | None:
    """Return how what was held out follows a cause, if what was fitted to speaks for it at all."""
    if not _is_fitted(before, after):
        return None
    return held_of(found, before).follow(before.variant, after.variant)


def _is_far_from_links(before: Fit, after: Fit, foretold: Foretold | None) -> bool:
    """Return whether recordings that were fitted to say of a cause that it is no link's error.

    What is known of links is part of the cost there. Of what was held out links may make up for
    anything that they could.
    """
    if foretold is None or foretold.is_told:
        return False
    return before.cost - after.cost >= _NO_LINKS


def _is_surely_worse(gain: Gain) -> bool:
    """Return whether held-out motion gets surely worse (95 %): then no small part of it counts."""
    return gain.gain < -_WORSE * gain.error


def _apart(
    found: Search, candidate: Candidate, after: Fit, foretold: Foretold | None
) -> Taken | None:
    """Return what a cause takes off that what was held out surely follows, however little.

    Not where base and links could make up for nearly all of it: of that nothing is followed. The
    surer it is, the less sure the recordings need to be that were fitted to, and the other way
    round.
    """
    if foretold is None or not foretold.is_seen:
        return None
    fitted = sureness(after, candidate, found.problem.of("train"))
    if fitted + foretold.errors < SURELY:
        return None
    before = float(foretold.before.mean())
    return Taken(before, before - float(foretold.after.mean()))


def held_of(found: Search, before: Fit) -> Held:
    """Return held-out recordings without what a fit's base could make up for there."""
    if found.held is None or found.held.fit is not before:
        found.held = Held(before)
    return found.held


def _is_fitted(before: Fit, after: Fit) -> bool:
    """Return whether what was fitted to speaks for a cause so plainly that the rest is asked."""
    if not before.space.problem.noise.is_white:
        return False
    numbers = after.space.size - before.space.size
    return 2.0 * (before.cost - after.cost) > _PLAINLY + _PLAINLY_EACH * numbers


def foretells(before: Float64, after: Float64) -> bool:
    """Return whether a cause takes away all that stands out of what nothing was fitted to.

    A drive that reaches its limit in one swing is off in three stretches of twenty: resampled, they
    are too few to be sure of. But by chance nothing of a size that other motion gave it does away
    with what is many times the noise, at every moment of half a second.

    Args:
        before: float64[S], mean square residual of held-out stretches without the cause.
        after: float64[S], with it.
    """
    most = STANDS_OUT * max(float(np.median(before)), 1.0)
    there = before > most
    if not there.any() or not bool(np.all(after[there] < TAKEN_AWAY * before[there])):
        return False
    return bool(after.max() < most)
