"""An effect that was named at one joint is looked for at all the others at once.

Arms are made of like parts: where one joint rubs, most do. Joint after joint, that is a round of
the search each, and the friction of those not yet named passes for something else meanwhile.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import Fit, polish
from shared.identification.gate.held_out import Gain, compare, stretches

_FEWEST = 2
"""Joints: a single one is what the search looks at anyhow."""
_MOST = 0.5
"""Share of the joints left at which it has to be."""
_WAYS = (0.0, 0.3, 1.0)
"""Of the way that the derivative says: without what does much it leads too far."""
_STEPS = 4
"""Derivatives of a fit: it begins far from where it leads."""


@dataclass(frozen=True)
class Family:
    """What was found at other joints."""

    fit: Fit
    """With all of them."""
    losses: Float64
    """float64[S] of held-out stretches."""
    gains: dict[Candidate, Gain]
    """What each takes off beside all the others."""


def relatives(candidates: Sequence[Candidate], of: Candidate, fit: Fit) -> tuple[Candidate, ...]:
    """Return the same effect at the joints where it is not yet; none of one that is no joint's.

    Args:
        candidates: what is looked for.
        of: what was named.
        fit: with everything that was named.
    """
    subject, taken = fit.space.problem.subject, fit.space.candidates
    if of.place not in subject.joints:
        return ()
    quantities = of.effect.quantities(subject, of.place)
    if any((each.grid and not each.is_detail) or not each.is_smooth for each in quantities):
        return ()
    left = tuple(
        each for each in candidates if each.effect.name == of.effect.name and each not in taken
    )
    return left if len(left) >= _FEWEST else ()


def look_elsewhere(
    fit: Fit,
    others: Sequence[Candidate],
    losses: Float64,
    train: tuple[int, ...],
    test: tuple[int, ...],
    rng: np.random.Generator,
) -> Family | None:
    """Fit an effect at other joints, too, and keep those without which it is surely worse.

    Nothing is found where that is not most of them.

    Args:
        fit: with everything that was named.
        others: where it is looked for.
        losses: float64[S], of held-out stretches with that fit.
        train: recordings to fit to.
        test: recordings held out.
        rng: draws.
    """
    problem, space = fit.space.problem, fit.space
    for each in others:
        space = space.grown(each)
    start = np.r_[fit.z, space.details[fit.space.size :]]
    together = polish(space, start, train, _STEPS)
    after = stretches(problem, space.variant(together.z), test)
    kept = [
        each for each in others if compare(left_without(together, each, test), after, rng).is_sure
    ]
    if len(kept) < max(_FEWEST, _MOST * len(others)):
        return None  # what a few joints make up for may be something else
    final, start = fit.space, fit.z
    for each in kept:
        final, start = final.grown(each), np.r_[start, together.z[space.where(each)]]
    found = polish(final, start, train, 2)
    after = stretches(problem, final.variant(found.z), test)
    if not compare(losses, after, rng).is_sure:
        return None
    gains = {each: compare(left_without(found, each, test), after, rng) for each in kept}
    return Family(found, after, gains)


def left_without(fit: Fit, candidate: Candidate, test: tuple[int, ...]) -> Float64:
    """Return held-out losses where the rest makes up for a missing effect as well as it can.

    As far as the fit's derivative says, and no worse than if it did not. Numbers that say how it
    is have no say in that: of what is not there they change nothing.
    """
    space = fit.space
    is_form = candidate.forms(space.problem.subject)
    own = np.arange(space.size)[space.where(candidate)][~is_form]
    way = -fit.spread[:, own] @ np.linalg.solve(fit.spread[np.ix_(own, own)], fit.z[own])
    found: list[Float64] = []
    for share in _WAYS:
        z = fit.z + share * way
        z[own] = 0.0
        found.append(stretches(space.problem, space.variant(space.clip(z)), test))
    return min(found, key=lambda losses: float(losses.mean()))
