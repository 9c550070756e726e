"""Fits a space to recordings: CMA-ES as in the paper, then least squares from several starts."""

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from shared.identification.dataset.types import Float64
from shared.identification.fitting.cmaes import minimize
from shared.identification.fitting.problem import Variant
from shared.identification.fitting.space import Space
from shared.identification.noise.floor import Noise
from shared.sim.plant.plant import Control

_MAX_STEPS = 12
_MEDIAN = 0.455
"""Of the square of a normal number of variance 1."""
WINDOW = 1.0
"""Of the parts that a fit begins with (s)."""
_ENOUGH = 1e-3
"""A step that takes off less than this share of the cost is the last one."""
_DAMPINGS = (1e-3, 1e-1, 1.0, 100.0)
"""Factors of Marquardt's damping that are tried at once."""
_HARDLY = 1e-4
"""Damping of a step that goes nearly to where the derivative says the bottom is."""
_MUCH = 0.01
"""A step that takes off more than this share of the cost needs no better derivative; a derivative
that promises less than it is believed."""
_MENDED = 6
"""The most steps with one derivative."""
_STRAIGHT = 0.15
"""Of a change, that a derivative may be off by to do for good."""
_NEARLY = 0.01
"""A second start that comes down to so little more than the first one has found the same."""
_SLIGHT = 0.01
"""A step with a mended derivative that takes off less than this share is usually the last one."""
_MANY = 10.0
"""Times what a new derivative must take off, that a step with a mended one must."""
_NEAR_NOISE = 1.5
"""Mean square residual, in noise floors, from which the base may be bent towards a cause."""
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
        """Return float64[n, n]: covariance of the vector, of white residuals of variance 1."""
        return np.asarray(np.linalg.pinv(self.jacobian.T @ self.jacobian), np.float64)

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
    enough: float = _ENOUGH,
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
        length = float(moved @ moved)
        if length > 1e-12:
            off = found[best] - residual - jacobian @ moved
            jacobian = jacobian + np.outer(off, moved) / length
        if costs[best] >= cost:
            damping *= 100.0
            continue
        is_enough = costs[best] > cost * (1 - slight)
        z, residual, cost = tries[best], found[best], float(costs[best])
        damping = max(dampings[best], _HARDLY)
        if is_enough and promised(Fit(space, z, residual, jacobian, cost)) > cost * (1 - slight):
            break
    return Fit(space, z, residual, jacobian, cost)


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


@dataclass(frozen=True)
class BaseFits:
    """The base at its best, on short parts and on whole recordings."""

    nominal: Start
    """On short parts."""
    parts: Fit
    whole: Fit


def floor_from_base(space: Space) -> Noise:
    """Return a noise floor for recordings of which none is a repeat: what the base leaves.

    How far below that a right model would come is not known, so causes are judged only by how
    much better they are, not by what they leave.
    """
    parts = _on_parts(space)
    return floor_at(space, polish(parts, np.zeros(space.size), parts.problem.of("train"), 4).z)


def floor_at(space: Space, z: Float64) -> Noise:
    """Return the same from what is left at a vector, float64[n]."""
    parts = _on_parts(space)
    problem, noise = parts.problem, parts.problem.noise
    each = problem.residuals([parts.variant(z)], problem.of("train"))[0]
    scale = np.maximum(np.sqrt(_usual_power(each, problem.subject.control) / _MEDIAN), 1.0)
    count = len(noise.joints)
    tracker = None if noise.tracker is None else noise.tracker * scale[count:]
    return replace(noise, joints=noise.joints * scale[:count], tracker=tracker)


def _usual_power(parts: list[Float64], control: Control) -> Float64:
    """Return float64[C], the median of squares, block by block where nothing holds the arm.

    Under torques what is usual at the end of a part is many times what is usual at its begin.
    """
    if control != "torque":
        return np.median(np.concatenate(parts) ** 2, axis=0)
    shortest = min(len(part) for part in parts)
    return np.median([part[:shortest] ** 2 for part in parts], axis=0).mean(axis=0)


@dataclass(frozen=True)
class SavedFits:
    """What it takes to have a base fit again."""

    names: tuple[str, ...]
    """Of the parameters."""
    parts: tuple[float, ...]
    whole: tuple[float, ...]
    starts_agree: bool
    is_torque: bool = False
    """Whether noise was torques, see :class:`Noise`."""


def fit_again(space: Space, saved: SavedFits) -> BaseFits:
    """Return a base fit that was found before."""
    problem = space.problem
    parts = _on_parts(space)
    origin, pieces = np.zeros(space.size), parts.problem.of("train")
    nominal = Start(origin, parts.jacobian(origin, pieces, is_rough=True)[1])
    begun = Fit.at(parts, np.array(saved.parts), pieces)
    whole = Fit.at(space, np.array(saved.whole), problem.of("train"))
    return BaseFits(nominal, begun, replace(whole, starts_agree=saved.starts_agree))


def fit_base(space: Space, rng: np.random.Generator) -> BaseFits:
    """Return the base's fit on the training recordings, the better one of two starts.

    One start is nominal and goes by way of short parts that each begin at the measured state:
    there the arm cannot get far from what was measured, and the loss is nearly a parabola. The
    other is found by CMA-ES.
    """
    problem = space.problem
    first = problem.segments[problem.of("train")[0]].trajectory
    segments = tuple(
        index for index in problem.of("train") if problem.segments[index].trajectory == first
    )
    seed = int(rng.integers(1, 2**31 - 1))
    rough = problem.rough_timestep  # does for a start

    def losses(zs: Float64) -> Float64:
        found = space.residual([space.clip(z) for z in zs], segments, rough)
        return np.sum(np.minimum(found**2, 1e8), axis=1)

    origin = np.zeros(space.size)
    searched = minimize(losses, origin, *space.bounds, sigma=0.3, seed=seed)
    return _fitted(space, searched)


def fit_without(space: Space, done: BaseFits, doubted: Sequence[int]) -> BaseFits:
    """Return the base's fit without parameters that it had, from its best with them.

    Args:
        space: without them.
        done: with them.
        doubted: which of its coordinates they were.
    """
    begun, best = (np.delete(fit.z, doubted) for fit in (done.parts, done.whole))
    parts = _on_parts(space)
    near = polish(parts, begun, parts.problem.of("train"), 6)
    is_same = parts.problem is space.problem
    whole = near if is_same else polish(space, best, space.problem.of("train"), 6)
    nominal = _start_without(done.nominal, doubted)
    return BaseFits(nominal, near, replace(whole, starts_agree=done.whole.starts_agree))


def fit_with(space: Space, done: BaseFits, start: Float64) -> BaseFits:
    """Return the base's fit with more parameters, from its best without them.

    Args:
        space: with them, after those that it had.
        done: without.
        start: float64[K], where they begin.
    """
    parts, origin = _on_parts(space), np.zeros(space.size)
    pieces = parts.problem.of("train")
    nominal = Start(origin, parts.jacobian(origin, pieces, is_rough=True)[1])
    near = polish(parts, np.r_[done.parts.z, start], pieces, 6)
    is_same = parts.problem is space.problem
    begun = np.r_[done.whole.z, start]
    whole = near if is_same else polish(space, begun, space.problem.of("train"), 6)
    return BaseFits(nominal, near, replace(whole, starts_agree=done.whole.starts_agree))


def _start_without(start: Start, gone: Sequence[int]) -> Start:
    """Return the derivative at a vector in which some coordinates are 0, without those."""
    priors = [len(start.jacobian) - start.z.size + index for index in gone]
    kept = np.delete(np.delete(start.jacobian, gone, axis=1), priors, axis=0)
    return Start(np.delete(start.z, gone), kept)


def _fitted(space: Space, searched: Float64) -> BaseFits:
    """Return the better one of two fits: from nominal by way of short parts, and directly."""
    problem = space.problem
    segments = problem.of("train")
    parts, origin = _on_parts(space), np.zeros(space.size)
    pieces = parts.problem.of("train")
    at_nominal = Fit.at(parts, origin, pieces, is_rough=True)
    begun = polish(parts, at_nominal, pieces, 6)
    is_same = parts.problem is problem
    first = begun if is_same else polish(space, begun.z, segments, 6)
    fits = [first, _from_elsewhere(space, searched, first, segments)]
    best = min(fits, key=lambda fit: fit.cost)
    agree = max(fit.cost for fit in fits) <= _as_good(best.cost)
    nominal = Start(origin, at_nominal.jacobian)
    return BaseFits(nominal, best if is_same else begun, replace(best, starts_agree=agree))


def _from_elsewhere(space: Space, start: Float64, first: Fit, segments: tuple[int, ...]) -> Fit:
    """Return a fit from a second start: the first one, where it comes as far down as that.

    It goes down with the first one's derivative, then with its own.
    """
    z = space.clip(start)
    residual = space.residual([z], segments)[0]
    found = fit = go_down(Fit.of(space, z, residual, first.jacobian), segments)
    for _ in range(6):
        if first.cost * (1 - _ENOUGH) < found.cost < first.cost * (1 + _NEARLY):
            return first
        fit = Fit.at(space, found.z, segments, is_rough=True)
        found = go_down(fit, segments)
        if not found.cost < fit.cost * (1 - _ENOUGH):
            break
    return polish(space, fit, segments, 6) if fit.is_rough and fit.cost < first.cost else fit


def _as_good(cost: float) -> float:
    """Return up to which cost another fit is as good as one."""
    return cost * (1 + AGREE) + 1.0


def _on_parts(space: Space) -> Space:
    """Return the same on short parts, unless recordings come in such already."""
    return Space(space.problem.in_parts(WINDOW), space.candidates)
