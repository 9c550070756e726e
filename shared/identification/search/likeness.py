"""Whether a cause that was named is the law that acts, or only the most like it.

What stands in for a law that the catalogue lacks leaves little, and that spread over all motion: it
is hardly told from what a base leaves that is a little off. But it goes along with what other laws
would do at the same joint, all of them together, as noise does not: a test for lack of fit.
"""

from collections.abc import Sequence

import numpy as np

from shared.identification.arm.projection import basis_of, without
from shared.identification.effect import Candidate, Side
from shared.identification.search.looks import columns_of, looks_of
from shared.identification.search.screen import is_steady
from shared.identification.search.searched import EXACT, Search, is_at_end

_EACH = 4.0
"""What each way in which other laws move the residual takes off the cost: noise has half of one.
Where the right law was named it is 0.3 to 2.8 in 44 of 47 data sets, and up to 24 in three in
which the cause is so large that what the simulation is off by shows; where a wrong one stood for
it, 1.2 to 10."""
_BY_CHANCE = 1.5
"""The same, with a base that is a little off, where the law is right."""
_SHARE = 0.07
"""Of what the causes took off the cost: a law that is off by a quarter of what it does leaves so
much, and no law is quite the arm's. Of those three it is 0.02 at most, and 0.06 of a joint that
sticks (its bristles give, as those of the law do not); of three wrong ones 0.09 to 0.15."""
_EACH_EXACT = 5.0
"""The same of commands and of what is read, whose laws are exact: that a law is off by a little of
what it does is no excuse there. Of right ones it is 0.2 to 2.7, of wrong ones 10 and 17."""
_SIDES: tuple[tuple[Side, ...], ...] = (("command",), EXACT)
"""Where one of those causes acts, and what is like it."""
_SEEN = 1.0
"""What a law moves the residual by, at least, to be one of them, in standard deviations of it."""
_RANK = 0.1
"""Of the largest singular value: laws that do nearly the same are one way."""


def why_only_like(found: Search) -> str:
    """Return why what was named only stands in for another law, for people; nothing if it does not.

    Args:
        found: a search that is over.
    """
    subject = found.problem.subject
    for candidate, values in found.current.variant.extras:
        quantities = candidate.effect.quantities(subject, candidate.place)
        for value, each in zip(values.tolist(), quantities, strict=True):
            if is_at_end(value, each):
                return f"its {each.name} came to where that is no such law any more"
    if _goes_along_at_its_joint(found):
        return "other effects at the same joint fit what it leaves by more than chance"
    if _goes_along_on_its_side(found):
        return "others of what is read or commanded fit what it leaves by more than chance"
    return ""


def _goes_along_at_its_joint(found: Search) -> bool:
    """Return whether what was named leaves what other laws at its place take off, beyond noise.

    Args:
        found: a search that is over. Of one that named nothing, or only what happened once, or
            where repeats do not say what noise is, there is nothing to ask. Nor of what is at no
            joint.
    """
    places = {one.candidate.place for one in found.accepted if not one.is_event} - {""}
    taken, count = _taken(found, [each for each in found.candidates if each.place in places])
    least = _SHARE * (found.base.cost - found.current.cost)
    return taken > _EACH * count and taken - _BY_CHANCE * count > least


def _goes_along_on_its_side(found: Search) -> bool:
    """Return the same of commands, and of what is read, which others change as exactly."""
    acting = {one.candidate.effect.side for one in found.accepted if not one.is_event}
    for sides in _SIDES:
        if acting.isdisjoint(sides):
            continue
        others = [each for each in found.candidates if each.effect.side in sides]
        taken, count = _taken(found, others)
        if taken > _EACH_EXACT * count:
            return True
    return False


def _taken(found: Search, others: Sequence[Candidate]) -> tuple[float, int]:
    """Return what laws take off the cost beside what was named, and in how many ways; 0 if none.

    Args:
        found: a search that is over.
        others: those that act all the time, and are not in its model, are asked.
    """
    fit, problem = found.current, found.problem
    others = [
        each
        for each in others
        if each not in fit.space.candidates and is_steady(problem.subject, each)
    ]
    if not others or not problem.noise.is_white:
        return 0.0, 0
    looked = columns_of(fit, looks_of(problem.subject, others), problem.of("train"))
    moved = np.concatenate([each.columns for looks in looked.values() for each in looks])
    base, _ = np.linalg.qr(fit.jacobian)
    ways = without(base, np.pad(moved, ((0, 0), (0, fit.space.size))).T)
    ways = ways[:, np.linalg.norm(ways, axis=0) > _SEEN]
    if not ways.shape[1]:
        return 0.0, 0
    basis = basis_of(ways, _RANK)
    return 0.5 * float(np.sum((basis.T @ fit.residual) ** 2)), basis.shape[1]
