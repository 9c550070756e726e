"""Fits a space to recordings: CMA-ES as in the paper, then least squares from several starts."""

from dataclasses import dataclass

import numpy as np

from shared.identification.cmaes import minimize
from shared.identification.dataset.types import Float64
from shared.identification.space import Space

_MAX_STEPS = 12
WINDOW = 1.0
"""Of the parts that a fit begins with (s)."""
_ENOUGH = 3e-3
"""A step that takes off less than this share of the cost is the last one."""
_DAMPINGS = (1e-3, 1e-2, 1e-1, 1.0, 10.0, 100.0)
AGREE = 0.02
"""Starts agree whose costs differ by less than this share."""


@dataclass(frozen=True)
class Fit:
    """A space at its best."""

    space: Space
    z: Float64
    """float64[n]."""
    residual: Float64
    """float64[M + n] on the recordings that were fitted to."""
    jacobian: Float64
    """float64[M + n, n]."""
    cost: float
    """Half the sum of squares."""
    starts_agree: bool = True

    @property
    def covariance(self) -> Float64:
        """Return float64[n, n], of z, for a noise of 1 (what correlates is widened elsewhere)."""
        return np.asarray(np.linalg.pinv(self.jacobian.T @ self.jacobian), np.float64)


def least_squares(columns: Float64, wanted: Float64) -> Float64:
    """Return float64[k]: the shares of columns that come nearest to what is wanted."""
    return np.asarray(np.linalg.lstsq(columns, wanted, rcond=1e-8)[0], np.float64)


def polish(space: Space, start: Float64, segments: tuple[int, ...], steps: int = _MAX_STEPS) -> Fit:
    """Return a local fit by Levenberg-Marquardt steps within bounds.

    A step is tried at several dampings at once, for a look at five vectors costs a fraction of the
    derivative. Coordinates at a bound that want to go further stay there for the step.

    Args:
        space: what is fitted.
        start: float64[n].
        segments: recordings to fit to.
        steps: the most derivatives.
    """
    low, high = space.bounds
    z, damping = space.clip(start), 1e-2
    for _ in range(steps):
        residual, jacobian = space.jacobian(z, segments)
        cost = 0.5 * float(residual @ residual)
        gradient = jacobian.T @ residual
        is_free = ~(((z <= low) & (gradient > 0.0)) | ((z >= high) & (gradient < 0.0)))
        curve = jacobian.T @ jacobian
        dampings = damping * np.array(_DAMPINGS)
        tries = [_step(space, z, gradient, curve, is_free, each) for each in dampings]
        found = space.residual(tries, segments)
        costs = 0.5 * np.sum(found**2, axis=1)
        best = int(np.argmin(costs))
        if not costs[best] < cost:
            damping *= 1e3
            if damping > 1e6:
                break
            continue
        z, damping = tries[best], float(np.clip(dampings[best], 1e-9, 1e3))
        if costs[best] > cost * (1 - _ENOUGH):
            break
    residual, jacobian = space.jacobian(z, segments)
    return Fit(space, z, residual, jacobian, 0.5 * float(residual @ residual))


def _step(
    space: Space, z: Float64, gradient: Float64, curve: Float64, is_free: np.ndarray, damping: float
) -> Float64:
    """Return where one damping leads: Marquardt's scaling, within bounds."""
    out = z.copy()
    free = curve[np.ix_(is_free, is_free)]
    scaled = free + damping * np.diag(np.maximum(np.diag(free), 1e-9))
    out[is_free] -= np.linalg.solve(scaled, gradient[is_free])
    return space.clip(out)


def fit_base(space: Space, rng: np.random.Generator) -> Fit:
    """Return the base's fit on the training recordings, the better one of two starts.

    One start is nominal and goes by way of short parts that each begin at the measured state:
    there the arm cannot get far from what was measured, and the loss is nearly a parabola. The
    other is found by CMA-ES.
    """
    problem = space.problem
    segments = problem.of("train")
    parts = Space(problem.windowed(WINDOW), space.candidates)
    begun = polish(parts, np.zeros(space.size), parts.problem.of("train"), 4)
    problem.rollouts += parts.problem.rollouts
    seed = int(rng.integers(1, 2**31 - 1))

    def losses(zs: Float64) -> Float64:
        found = space.residual([space.clip(z) for z in zs], segments[:1])
        return np.sum(np.minimum(found**2, 1e8), axis=1)

    searched = minimize(losses, np.zeros(space.size), *space.bounds, sigma=0.3, seed=seed)
    fits = [polish(space, start, segments) for start in (begun.z, searched)]
    best = min(fits, key=lambda fit: fit.cost)
    agree = max(fit.cost for fit in fits) <= best.cost * (1 + AGREE) + 1.0
    return Fit(space, best.z, best.residual, best.jacobian, best.cost, agree)
