"""Fits an effect together with the whole base model.

First with the base's Jacobian kept, which costs little; the few that remain in the running get a
full fit.
"""

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.fit import Fit, least_squares
from shared.identification.screen import Screened
from shared.identification.space import Space

_ITERATIONS = 4
_HALVINGS = 3


def chord(fit: Fit, screened: Screened, segments: tuple[int, ...]) -> tuple[Space, Float64, float]:
    """Return a fit of base and effect with the base's Jacobian kept.

    Returns:
        The space, the vector and half the sum of squares.
    """
    space = fit.space.grown(screened.candidate)
    n = fit.space.size
    z = space.clip(np.r_[fit.z, screened.start])
    starts = [z, space.clip(np.r_[fit.z + screened.shift, screened.start])]
    found = space.residual(starts, segments)
    costs = 0.5 * np.sum(found**2, axis=1)
    best = int(np.argmin(costs))
    z, residual, cost = starts[best], found[best], float(costs[best])
    kept = np.concatenate([fit.jacobian, np.zeros((space.size - n, n))])
    for _ in range(_ITERATIONS):
        residual, own = space.jacobian(z, segments, range(n, space.size))
        jacobian = np.concatenate([kept, own], axis=1)
        step = least_squares(jacobian, -residual)
        tries = [space.clip(z + step * 0.5**power) for power in range(_HALVINGS)]
        found = space.residual(tries, segments)
        costs = 0.5 * np.sum(found**2, axis=1)
        best = int(np.argmin(costs))
        if costs[best] > cost * (1 - 1e-3):
            if costs[best] < cost:
                z, cost = tries[best], float(costs[best])
            break
        z, cost = tries[best], float(costs[best])
    return space, z, cost
