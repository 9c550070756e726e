"""Which of several causes that pass is taken, and which are not told from it."""

import math

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import Fit
from shared.identification.fitting.parameters import bends
from shared.identification.fitting.refit import settle
from shared.identification.fitting.turns import LATE
from shared.identification.gate.certainty import SURE
from shared.identification.gate.held_out import compare, stretches
from shared.identification.search.searched import (
    ALIKE,
    EACH_MORE,
    NEARLY_NOISE,
    Search,
    Tried,
    cosine,
)

_EVENT = 4.0
"""Times the mean square residual of the usual stretch that one counts with at most, between causes:
what happened once would be most of the mean, and most of its error."""
_NEARLY = 0.05
"""Of the cost on what was fitted to: by so much two causes that hardly differ may be apart."""
_FITTED_BETTER, _FITTED_FAR_BETTER = 5.0, 12.5
"""Of the cost: what one more number takes off by chance once in six hundred times, and a number
that is five standard errors off nothing."""
_APART = 0.5
"""Cosine of what two causes explain, up to which three quarters of it are not the same."""
_BENT = 15.0
"""By so much more, as part of the cost, no cause may have links bent than one that does as well."""
_LOADS = {"counterbalance", "torque_bias", "gravity_tilt", "joint_spring"}
"""Causes of which none is told from the others by a few postures: near one of them a load that
depends on posture is a constant torque, whatever numbers either has."""
_LOADS_APART = 4.5
"""Standard errors by which all recordings together have to prefer one of two loads."""
_STANDS_OFF = {
    frozenset({"encoder_offset", "payload"}): ALIKE,
    frozenset({"encoder_offset", "backlash"}): 0.1,
}
"""Pairs that are a joint with another zero, near enough, and the share of the gain within which: a
tool that is heavy beside its middle, of which the shape is not modelled, and a gear with play that
its load never turns round, of which flanks give and links bounce as no model says."""


def simplest(useful: list[Tried], rng: np.random.Generator) -> tuple[Tried, tuple[Tried, ...]]:
    """Return the cause to take, and those that are not told from it.

    Each has passed by what was held out; which of them does best, all recordings say. A stretch in
    which something large happened has no more of a say than ``_EVENT`` usual ones. Where hardly
    more than noise is left, it is what the base could not make up for of what was held out; where
    much is, that would be most of what tells one large cause from another. Of what does as well as
    the best one, and has links bent no further for it, the simplest is taken, unless it is surely
    another one by what was fitted to; what needs more numbers to do no better is no rival, unless
    it is in the nature of both that they are hardly told apart.
    """
    is_apart = all(one.gain.apart is not None and one.gain.before < NEARLY_NOISE for one in useful)
    most = _EVENT * min(float(np.median(one.everywhere(is_apart))) for one in useful)
    left = {one.candidate: np.minimum(one.everywhere(is_apart), most) for one in useful}
    best = min(useful, key=lambda one: left[one.candidate].mean())
    alike = [one for one in useful if one is best or _is_alike(best, one, left, rng)]
    bent = {one.candidate: _bent_by(one.fit) for one in alike}
    alike = [one for one in alike if bent[one.candidate] - min(bent.values()) <= _BENT]
    alike = [one for one in alike if not any(_outdoes(each, one, is_apart, rng) for each in alike)]
    fewest = min(one.numbers for one in alike)
    simple = [one for one in alike if one.numbers == fewest]
    taken = min(simple, key=lambda one: left[one.candidate].mean())
    others = [one for one in useful if one is not taken]
    as_simple = {one.candidate for one in simple}
    return taken, tuple(
        one for one in others if one.candidate in as_simple or _is_nearly(taken, one, is_apart, rng)
    )


def _bent_by(fit: Fit) -> float:
    """Return what speaks against the links of a fit's base, as part of the cost."""
    return 0.5 * float(np.sum(bends(fit.space.problem.parameters, fit.z) ** 2))


def _is_nearly(taken: Tried, other: Tried, is_apart: bool, rng: np.random.Generator) -> bool:
    """Return whether another cause hardly differs from what is taken, in nature and in these data.

    Both of the recordings that were fitted to and of those that were held out: these may prefer
    what is taken by what chance does, or surely no more than that (95 %) where the others surely
    prefer what is not.
    """
    name, of_taken = other.candidate.effect.name, taken.candidate.effect.name
    share = _STANDS_OFF.get(frozenset({name, of_taken}), 0.0)
    if not share and LATE.get(name) != of_taken and not {name, of_taken} <= _LOADS:
        return False
    if _outdoes(taken, other, is_apart, rng):
        return False
    margin = compare(other.held(is_apart), taken.held(is_apart), rng)
    is_fitted_better = taken.fit.cost - other.fit.cost > _FITTED_BETTER
    errors = SURE if is_fitted_better else 1.0
    least = max(errors * margin.error, share * taken.gain.gain)
    return margin.gain < least and other.fit.cost <= (1 + _NEARLY) * taken.fit.cost


def _outdoes(better: Tried, other: Tried, is_apart: bool, rng: np.random.Generator) -> bool:
    """Return whether what was fitted to surely prefers one, and what is held out, too.

    Or that does not say otherwise. A load that depends on posture differs from a constant one by
    little of what either takes off, and by less the less the arm goes about: of two loads all
    recordings together have to be sure. Of others what was fitted to has to be, the more so the
    more numbers it takes: they make up for what a base lacks.
    """
    names = {better.candidate.effect.name, other.candidate.effect.name}
    apart = other.fit.cost - better.fit.cost
    if apart <= 0.0 or frozenset(names) in _STANDS_OFF:
        return False
    margin = compare(other.held(is_apart), better.held(is_apart), rng)
    held = margin.gain / max(margin.error, 1e-12)
    if names <= _LOADS:
        is_sure = math.sqrt(2.0 * apart) + held >= _LOADS_APART
    else:
        more = max(better.numbers - other.numbers - 1, 0)
        is_sure = apart >= _FITTED_FAR_BETTER + EACH_MORE * more
    return is_sure and held > -1.0


def _is_alike(
    best: Tried, other: Tried, left: dict[Candidate, Float64], rng: np.random.Generator
) -> bool:
    """Return whether the recordings do not prefer the best surely."""
    margin = compare(left[other.candidate], left[best.candidate], rng)
    return margin.gain < max(margin.error, ALIKE * best.gain.gain)


def loads_alike(sure: list[Tried]) -> list[Tried]:
    """Return loads of which what was fitted to hardly prefers one, as roughly as they are fitted.

    A constant torque is soon at its best, two screws of a counterbalance that do nearly the same
    are not: which of them the recordings prefer only says what both are at their best.

    Args:
        sure: causes that pass.

    Returns:
        Nothing if there is one of them only.
    """
    loads = [one for one in sure if one.candidate.effect.name in _LOADS]
    least = min((one.fit.cost for one in loads), default=0.0)
    near = [one for one in loads if one.fit.cost <= (1 + _NEARLY) * least]
    return near if len(near) > 1 else []


def as_well(taken: Tried, others: list[Tried], rng: np.random.Generator) -> tuple[Tried, ...]:
    """Return those of other causes that all recordings do not tell from what is taken.

    Args:
        taken: the cause that is taken.
        others: that pass, too, though their size may be anything.
        rng: random numbers.
    """
    left = {one.candidate: one.everywhere() for one in (taken, *others)}
    return tuple(
        one
        for one in others
        if one.numbers <= taken.numbers
        and _is_alike(taken, one, left, rng)
        and not _outdoes(taken, one, False, rng)
    )


def is_rival(
    found: Search, best: Tried, other: Tried, train: tuple[int, ...], test: tuple[int, ...]
) -> bool:
    """Return whether a cause that does as well may stand in the place of the best.

    Not one that explains something else as well, friction of another joint: that is a cause beside
    it, to be found in its turn.
    """
    if other.candidate.effect.name in LATE:
        return True
    return cosine(best, other) > _APART and not _adds(found, best, other, train, test)


def _adds(
    found: Search, best: Tried, other: Tried, train: tuple[int, ...], test: tuple[int, ...]
) -> bool:
    """Return whether a rival is a cause beside the best: together they do surely better.

    Two joints of one chain that both rub: friction of either imitates most of the other's.
    """
    space = best.fit.space.grown(other.candidate)
    size = other.numbers
    starts = [np.r_[best.fit.z, share * other.fit.z[-size:]] for share in (0.5, 0.1)]
    fits = [settle(space, space.clip(start), train) for start in starts]
    fit = min(fits, key=lambda one: one.cost)
    losses = stretches(found.problem, space.variant(fit.z), test)
    return compare(best.losses, losses, found.rng).is_useful(float(found.base_losses.mean()))
