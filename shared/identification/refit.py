"""Fits an effect together with the whole base model, without paying for its derivative again.

A base fit that lacks the cause has bent its parameters towards it, and the way back is not
straight. So a refit begins twice, at the base's fit and at the nominal model, each with the
derivative that was computed there, and mends it as it goes (Broyden 1965). The few candidates
that remain in the running get a full fit.
"""

from dataclasses import dataclass

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.fit import Fit, Start, damped
from shared.identification.screen import Screened
from shared.identification.space import Space

_ITERATIONS = 6
_DAMPINGS = (0.01, 0.3, 10.0)
"""Factors of Marquardt's damping that are tried at once."""
_PARTS = (1.0, 0.5, 0.25)
"""Of the way to where the screen expects the best fit, for a start."""
_ENOUGH = 0.01


@dataclass(frozen=True)
class Rough:
    """Where a cheap refit came to."""

    screened: Screened
    space: Space
    z: Float64
    cost: float
    """Half the sum of squares."""


def refit(fit: Fit, nominal: Start, screened: Screened, segments: tuple[int, ...]) -> Rough:
    """Return the better of two refits.

    Args:
        fit: the base's, with the causes that were accepted before.
        nominal: the derivative at the nominal model, of the base alone.
        screened: the candidate and where the screen expects it.
        segments: recordings to fit to.
    """
    space = fit.space.grown(screened.candidate)
    extra = space.size - fit.space.size
    way = np.r_[screened.shift, screened.start]
    origin = np.r_[fit.z, np.zeros(extra)]
    ways = [space.clip(origin + part * way) for part in _PARTS]
    ways.append(space.clip(np.r_[fit.z, screened.start]))
    first = _descend(space, ways, fit.jacobian, segments, fit.space.size)
    base = np.r_[nominal.z, fit.z[nominal.z.size :]]
    sizes = [space.clip(np.r_[base, scale * screened.start]) for scale in (1.0, 0.5)]
    second = _descend(space, sizes, nominal.jacobian, segments, nominal.z.size)
    z, cost = min((first, second), key=lambda found: found[1])
    return Rough(screened, space, z, cost)


def _descend(
    space: Space, starts: list[Float64], kept: Float64, segments: tuple[int, ...], known: int
) -> tuple[Float64, float]:
    """Go down from the best of some starts with a derivative of which part is known."""
    found = space.residual(starts, segments)
    costs = 0.5 * np.sum(found**2, axis=1)
    best = int(np.argmin(costs))
    z, residual, cost = starts[best], found[best], float(costs[best])
    _, own = space.jacobian(z, segments, range(known, space.size))
    rows = len(residual) - space.size
    base = np.zeros((len(residual), known))
    base[:rows] = kept[:rows, :known]
    base[rows : rows + known] = np.diag(1.0 / space.priors[:known])
    jacobian = np.concatenate([base, own], axis=1)
    damping = 1e-1
    for _ in range(_ITERATIONS):
        dampings = [damping * factor for factor in _DAMPINGS]
        tries = damped(space, z, residual, jacobian, dampings)
        found = space.residual(tries, segments)
        costs = 0.5 * np.sum(found**2, axis=1)
        best = int(np.argmin(costs))
        moved = tries[best] - z
        length = float(moved @ moved)
        if length > 1e-12:
            jacobian += np.outer(found[best] - residual - jacobian @ moved, moved) / length
        if costs[best] >= cost:
            damping *= 100.0
            continue
        is_enough = costs[best] > cost * (1 - _ENOUGH)
        z, residual, cost = tries[best], found[best], float(costs[best])
        damping = max(dampings[best], 1e-4)
        if is_enough:
            break
    return z, cost
