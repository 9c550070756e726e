"""Fits a space to recordings from a start: least squares, with derivatives kept and mended."""

import functools
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from shared.identification.dataset.types import Float64
from shared.identification.fitting.problem import Variant
from shared.identification.fitting.space import Space

_MAX_STEPS = 12
ENOUGH = 1e-3
"""A step that takes off less than this share of the cost is the last one."""
_DAMPINGS = (1e-3, 1e-1, 1.0, 100.0)
"""Factors of Marquardt's damping that are tried at once."""
BOLD = (0.01, 0.3, 10.0)
"""The same, of a derivative that is mended from the start."""
_HARDLY = 1e-4
"""Damping of a step that goes nearly to where the derivative says the bottom is."""
_MUCH = 0.01
"""A step that takes off more than this share of the cost needs no better derivative; a derivative
that promises less than it is believed."""
_MENDED = 6
"""The most steps with one derivative."""
_STRAIGHT = 0.15
"""Of a change, that a derivative may be off by to do for good."""
_SLIGHT = 0.01
"""A step with a mended derivative that takes off less than this share is usually the last one."""
_MANY = 10.0
"""Times what a new derivative must take off, that a step with a mended one must."""
_NEAR_NOISE = 1.5
"""Mean square residual, in noise floors, from which the base may be bent towards a cause."""


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
    is_rough: bool = False
    """Whether the derivative may be off by a few percent, see :meth:`Space.jacobian`."""

    @property
    def variant(self) -> Variant:
        """Return the model that it is."""
        return self.space.variant(self.z)

    @property
    def is_near_noise(self) -> bool:
        """Return whether hardly more than noise, as repeats measured it, is left."""
        count = len(self.residual) - self.space.size
        return self.space.problem.noise.is_measured and 2.0 * self.cost < _NEAR_NOISE * count

    @functools.cached_property
    def spread(self) -> Float64:
        """Return float64[n, n]: covariance of the vector, of white residuals of variance 1.

        Of a way that changes nothing, but for rounding, it is 0.
        """
        square = self.jacobian.T @ self.jacobian
        rounding = len(square) * float(np.finfo(np.float64).eps)
        return np.asarray(np.linalg.pinv(square, rounding, hermitian=True), np.float64)

    def on(self, rows: NDArray[np.bool_]) -> "Fit":
        """Return it as some rows, bool[M], see it; what is known beforehand counts as it did."""
        kept = np.r_[rows, np.ones(self.space.size, np.bool_)]
        return Fit.of(self.space, self.z, self.residual[kept], self.jacobian[kept])

    @staticmethod
    def of(space: Space, z: Float64, residual: Float64, jacobian: Float64) -> "Fit":
        """Return a fit with its cost."""
        return Fit(space, z, residual, jacobian, 0.5 * float(residual @ residual))

    @staticmethod
    def at(space: Space, z: Float64, segments: tuple[int, ...], is_rough: bool = False) -> "Fit":
        """Return a vector as it is, with the derivative there; a rough one only if there is one."""
        is_rough = is_rough and space.has_rough
        found = Fit.of(space, z, *space.jacobian(z, segments, is_rough=is_rough))
        return replace(found, is_rough=is_rough)


def polish(
    space: Space,
    start: Float64 | Fit,
    segments: tuple[int, ...],
    steps: int = _MAX_STEPS,
    enough: float = ENOUGH,
    wanted: float = np.inf,
) -> Fit:
    """Return a local fit by Levenberg-Marquardt steps within bounds.

    A derivative costs as much as many looks, so it is used for several steps, see :func:`go_down`.
    A rough one does where a step takes much off; the last one never is. Where one foretells a step
    that takes little off, it does after that step.

    Args:
        space: what is fitted.
        start: float64[n], or a fit whose derivative is known.
        segments: recordings to fit to.
        steps: the most derivatives after the first.
        enough: what takes off less than this share of the cost with a new derivative is the end.
        wanted: a fit whose derivative promises little more, and nothing below this cost, gives up.
    """
    if isinstance(start, Fit):
        fit = start
    else:
        fit = Fit.at(space, space.clip(start), segments, is_rough=steps > 0)
    for left in reversed(range(steps)):
        if not fit.is_rough and promised(fit) > max(wanted, fit.cost * (1 - _MUCH)):
            break
        found = go_down(fit, segments, slight=_MANY * enough)
        if not fit.is_rough and not found.cost < fit.cost * (1 - enough):
            break
        is_far = found.cost < fit.cost * (1 - _MUCH)
        if not (fit.is_rough or is_far) and is_foretold(fit, found):
            fit = found
            continue
        is_rough = fit.is_rough and left > 0 and is_far
        z = found.z if found.cost < fit.cost else fit.z
        fit = Fit.at(space, z, segments, is_rough)
    return fit


def go_down(
    fit: Fit, segments: tuple[int, ...], factors: tuple[float, ...] = _DAMPINGS,
    slight: float = _SLIGHT,
) -> Fit:  # fmt: skip
    """Take damped steps with one derivative, mended after each (Broyden 1965).

    A step is tried at several dampings at once. Coordinates at a bound that want to go further
    stay there for the step.

    Args:
        fit: where it begins, with the derivative there.
        segments: recordings to fit to.
        factors: of the damping, tried at once.
        slight: a step that takes off less than this share of the cost is the last one, if the
            derivative promises no more.
    """
    space, z, residual, jacobian, cost = fit.space, fit.z, fit.residual, fit.jacobian, fit.cost
    damping = 1e-1
    for _ in range(_MENDED):
        dampings = [damping * factor for factor in factors]
        tries = damped(space, z, residual, jacobian, dampings)
        found = space.residual(tries, segments)
        costs = 0.5 * np.sum(found**2, axis=1)
        best = int(np.argmin(costs))
        moved = tries[best] - z
        jacobian = mended(jacobian, moved, found[best] - residual)
        if costs[best] >= cost:
            damping *= 100.0
            continue
        is_enough = costs[best] > cost * (1 - slight)
        z, residual, cost = tries[best], found[best], float(costs[best])
        damping = max(dampings[best], _HARDLY)
        if is_enough and promised(Fit(space, z, residual, jacobian, cost)) > cost * (1 - slight):
            break
    return Fit(space, z, residual, jacobian, cost)


def mended(jacobian: Float64, moved: Float64, came: Float64) -> Float64:
    """Return a derivative that says of one step what came of it (Broyden 1965).

    Args:
        jacobian: float64[M + n, n], as it was.
        moved: float64[n], the step.
        came: float64[M + n], by how much the residual changed.
    """
    length = float(moved @ moved)
    if length <= 1e-12:
        return jacobian
    return jacobian + np.outer(came - jacobian @ moved, moved) / length


def descend(
    space: Space, starts: list[Float64], kept: Float64, segments: tuple[int, ...], known: int
) -> Fit:
    """Go down from the best of some starts with a derivative of which part is known.

    Args:
        space: what is fitted.
        starts: float64[n] each.
        kept: float64[at least M, at least ``known``], a derivative; of its rows the first M.
        segments: recordings to fit to.
        known: so many columns of it are.
    """
    z, residual = best_of(space, starts, segments)
    jacobian = widened(space, z, kept, segments, known)
    return go_down(Fit.of(space, z, residual, jacobian), segments, BOLD)


def best_of(
    space: Space, starts: list[Float64], segments: tuple[int, ...]
) -> tuple[Float64, Float64]:
    """Return the best of some vectors on segments, float64[n], and its residual, float64[M + n]."""
    found = space.residual(starts, segments)
    best = int(np.argmin(np.sum(found**2, axis=1)))
    return starts[best], found[best]


def widened(
    space: Space, z: Float64, kept: Float64, segments: tuple[int, ...], known: int
) -> Float64:
    """Return float64[M + n, n], a derivative of which only some columns have to be found.

    Args:
        space: what is fitted.
        z: float64[n], where.
        kept: float64[at least M, at least ``known``], the same of fewer; of its rows the first M.
        segments: recordings to fit to.
        known: so many columns of it are.
    """
    _, own = space.jacobian(z, segments, range(known, space.size), is_rough=True)
    rows = len(own) - space.size
    base = np.zeros((len(own), known))
    base[:rows] = kept[:rows, :known]
    base[rows : rows + known] = np.diag(1.0 / space.priors[:known])
    return np.concatenate([base, own], axis=1)


def is_foretold(before: Fit, after: Fit) -> bool:
    """Return whether a fit's derivative foretold what a step changed: it does there, too."""
    came = after.residual - before.residual
    return is_nearly(came, before.jacobian @ (after.z - before.z))


def is_nearly(came: Float64, foretold: Float64) -> bool:
    """Return whether a change is what a derivative foretold, so that it does where that led, too.

    Args:
        came: float64[M], by how much residuals changed.
        foretold: float64[M].
    """
    off = came - foretold
    return float(off @ off) < _STRAIGHT**2 * float(came @ came)


def promised(fit: Fit) -> float:
    """Return the cost to which a step would come that is hardly damped, by the derivative."""
    z = damped(fit.space, fit.z, fit.residual, fit.jacobian, [_HARDLY])[0]
    left = fit.residual + fit.jacobian @ (z - fit.z)
    return 0.5 * float(left @ left)


def damped(
    space: Space, z: Float64, residual: Float64, jacobian: Float64, dampings: list[float]
) -> list[Float64]:
    """Return where Levenberg-Marquardt steps lead, one a damping, within bounds."""
    low, high = space.bounds
    gradient = jacobian.T @ residual
    is_free = ~(((z <= low) & (gradient > 0.0)) | ((z >= high) & (gradient < 0.0)))
    free = (jacobian.T @ jacobian)[np.ix_(is_free, is_free)]
    scale = np.diag(np.maximum(np.diag(free), 1e-9))
    out: list[Float64] = []
    for damping in dampings:
        moved = z.copy()
        moved[is_free] -= np.linalg.solve(free + damping * scale, gradient[is_free])
        out.append(space.clip(moved))
    return out


@dataclass(frozen=True)
class Start:
    """A vector and the derivative there."""

    z: Float64
    jacobian: Float64
    """float64[M + n, n]."""

    def with_causes_of(self, fit: Fit) -> Float64:
        """Return the vector, of the base alone, with the causes that a fit has."""
        return np.r_[self.z, fit.z[self.z.size :]]
