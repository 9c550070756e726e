"""Tells what happened once in a recording that was fitted to: it stands out there.

Held-out recordings cannot show what happened once in another one. So what stands out must be far
over everything else, more than noise that is the same throughout would ever be, in all channels
together or in one alone: a hand on a wrist moves one joint of seven. One is not enough beside a
cause, since no law is quite the arm's and what a named one leaves is off most at its own joint, nor
where no repeat says what noise is: an arm that sticks and slips leaves as much now and then.
"""

from dataclasses import dataclass

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import Fit
from shared.identification.gate.certainty import is_there
from shared.identification.gate.held_out import plain_channels
from shared.identification.search.searched import STANDS_OUT, TAKEN_AWAY

_ALONE = 10.0
"""Mean square residual of one channel of a stretch over its usual one, where something happened
once: where nothing did, a base with links 10 % off leaves 7 at most, of a push of 0.1 N m at a
wrist 17 are left."""

_SURELY = 3.0
"""Standard errors that the torque of what happened once is off nothing by: it is one of many, of
each joint in each recording. Where nothing did 2.3 passed for a push, of real ones the least sure
comes to 3.2."""
_BEYOND_RANDOM = 5.0
"""Times what pushes a joint at random, by repeats, that something else does. Where nothing did, 1.4
to 3.3 times passed for a push; a PR2's real ones that were named are 8 to 80 times."""


@dataclass(frozen=True)
class Usual:
    """What a stretch leaves at most in which nothing happened."""

    together: float
    """Mean square of all channels, in noise floors."""
    each: Float64
    """float64[C], of each of them."""

    @staticmethod
    def of(losses: Float64, is_one_enough: bool) -> "Usual":
        """Return it.

        Args:
            losses: float64[S, C], plain mean squares of stretches, in noise floors.
            is_one_enough: whether a channel counts alone.
        """
        together = STANDS_OUT * max(float(np.median(losses.mean(axis=1))), 1.0)
        each = _ALONE * np.maximum(np.median(losses, axis=0), 1.0)
        return Usual(together, each if is_one_enough else np.full_like(each, np.inf))

    def exceeded(self, losses: Float64) -> Float64:
        """Return float64[S], how many times as much stretches leave, of float64[S, C]."""
        alone: Float64 = (losses / self.each).max(axis=1)
        return np.maximum(losses.mean(axis=1) / self.together, alone)


def explains_event(
    candidate: Candidate, usual: Usual, off: Float64, fit: Fit, train: tuple[int, ...]
) -> bool:
    """Return whether a cause that is in one recording takes away what stands out there.

    Args:
        candidate: the cause.
        usual: what stretches leave at most in which nothing happened.
        off: float64[S], how many times as much stretches of what was fitted to leave without it.
        fit: with it.
        train: recordings to fit to.
    """
    if candidate.recording is None:
        return False
    left = usual.exceeded(plain_channels(fit.space.problem, fit.variant, train))
    worst = int(np.argmax(off - left))
    is_explained = (
        off[worst] > 1.0
        and left[worst] < TAKEN_AWAY * off[worst]
        and left.max() < max(TAKEN_AWAY * off.max(), 1.0)
    )
    return bool(is_explained) and is_one(candidate, fit, train)


def is_one(candidate: Candidate, fit: Fit, train: tuple[int, ...]) -> bool:
    """Return whether what happened once surely did, and is no torque that pushes at random.

    Args:
        candidate: the cause, which is in one recording.
        fit: with it.
        train: recordings to fit to.
    """
    if not is_there(fit, candidate, train, _SURELY):
        return False
    problem = fit.space.problem
    pushed = problem.noise.pushed
    if pushed is None:
        return True
    torque = fit.space.values(fit.z)[fit.space.candidates.index(candidate)][0]
    usual = pushed.torque(problem.subject.nominal, candidate.where)
    return bool(abs(torque) > _BEYOND_RANDOM * usual)
