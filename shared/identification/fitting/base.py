"""Fits the base: CMA-ES as in the paper, then least squares from several starts."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.fitting.cmaes import minimize
from shared.identification.fitting.fit import ENOUGH, Fit, Start, best_of, go_down, polish, widened
from shared.identification.fitting.long import polish_on_some
from shared.identification.fitting.space import Space
from shared.identification.noise.floor import Noise
from shared.sim.plant.plant import Control

_FLOORS = 3
"""Times that a floor is asked for again."""
_MEDIAN = 0.455
"""Of the square of a normal number of variance 1."""
WINDOW = 1.0
"""Of the parts that a fit begins with (s)."""
_NEARLY = 0.01
"""A second start that comes down to so little more than the first one has found the same."""
AGREE = 0.02
"""Starts agree whose costs differ by less than this share."""


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
    """Return the same from what is left at a vector, float64[n].

    Where first states are free it says how much of that they may be, so it is asked again.
    """
    noise = _floor_at(space, z)
    for _ in range(_FLOORS if noise.has_free_starts else 0):
        noise = _floor_at(Space(replace(space.problem, noise=noise), space.candidates), z)
    return noise


def _floor_at(space: Space, z: Float64) -> Noise:
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


_STARTS = 2
"""Times that a base is fitted again, with first states as the fit before answers them."""


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
    if space.problem.noise.has_free_starts:
        space = _starting_as(space, np.array(saved.whole))
    problem = space.problem
    parts = _on_parts(space)
    origin, pieces = np.zeros(space.size), parts.problem.of("train")
    nominal = Start(origin, parts.jacobian(origin, pieces, is_rough=True)[1])
    begun = Fit.at(parts, np.array(saved.parts), pieces)
    whole = Fit.at(space, np.array(saved.whole), problem.of("train"))
    return BaseFits(nominal, begun, replace(whole, starts_agree=saved.starts_agree))


def as_kept(done: BaseFits) -> BaseFits:
    """Return a base's fits as a search that goes on will have them: first states go by these."""
    whole = done.whole
    names = tuple(each.name for each in whole.space.problem.parameters)
    parts, z = tuple(done.parts.z.tolist()), tuple(whole.z.tolist())
    return fit_again(whole.space, SavedFits(names, parts, z, whole.starts_agree))


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


def with_starts(done: BaseFits) -> BaseFits:
    """Return a base's fit whose first states are as free as the fit itself answers them."""
    whole, segments = done.whole, done.whole.space.problem.of("train")
    for _ in range(_STARTS):
        whole = polish(_starting_as(whole.space, whole.z), whole.z, segments, 3)
    whole = replace(whole, starts_agree=done.whole.starts_agree)
    origin = np.zeros(whole.space.size)
    nominal = Start(origin, whole.space.jacobian(origin, segments, is_rough=True)[1])
    return BaseFits(nominal, whole, whole)


def _starting_as(space: Space, z: Float64) -> Space:
    return Space(space.problem.starting_as(space.variant(z)), space.candidates)


def fit_without(space: Space, done: BaseFits, doubted: Sequence[int]) -> BaseFits:
    """Return the base's fit without parameters that it had, from its best with them.

    Args:
        space: without them.
        done: with them.
        doubted: which of its coordinates they were.
    """
    parts = _on_parts(space)
    begun, best = (
        _start_without(Start(fit.z, fit.jacobian), doubted) for fit in (done.parts, done.whole)
    )
    near = _fit_from(parts, [begun.z], begun.jacobian)
    is_same = parts.problem is space.problem
    whole = near if is_same else _fit_from(space, [best.z, near.z], best.jacobian)
    nominal = _start_without(done.nominal, doubted)
    return BaseFits(nominal, near, replace(whole, starts_agree=done.whole.starts_agree))


def fit_with(space: Space, done: BaseFits, start: Float64) -> BaseFits:
    """Return the base's fit with more parameters, from its best without them.

    Args:
        space: with them, after those that it had.
        done: without.
        start: float64[K], where they begin.
    """
    parts, origin, known = _on_parts(space), np.zeros(space.size), done.nominal.z.size
    pieces = parts.problem.of("train")
    at_nominal = widened(parts, origin, done.nominal.jacobian, pieces, known)
    begun = np.r_[done.parts.z, start]
    near = _fit_from(parts, [begun], widened(parts, begun, done.parts.jacobian, pieces, known))
    whole = near
    if parts.problem is not space.problem:
        best = np.r_[done.whole.z, start]
        train = space.problem.of("train")
        jacobian = widened(space, best, done.whole.jacobian, train, known)
        whole = _fit_from(space, [best, near.z], jacobian)
    whole = replace(whole, starts_agree=done.whole.starts_agree)
    return BaseFits(Start(origin, at_nominal), near, whole)


def _fit_from(space: Space, starts: list[Float64], jacobian: Float64) -> Fit:
    """Return a fit from the best of some starts, with a derivative that is known near the first.

    One of recordings in other parts is not.
    """
    segments = space.problem.of("train")
    z, residual = best_of(space, starts, segments)
    begun = Fit.of(space, z, residual, jacobian)
    if len(jacobian) != len(residual):
        begun = Fit.at(space, z, segments, is_rough=True)
    near, some = polish_on_some(replace(begun, is_rough=True), segments, 6)
    return _to_all(near, some)


def _start_without(start: Start, gone: Sequence[int]) -> Start:
    """Return a derivative without some coordinates: exact at a vector in which those are 0."""
    priors = [len(start.jacobian) - start.z.size + index for index in gone]
    kept = np.delete(np.delete(start.jacobian, gone, axis=1), priors, axis=0)
    return Start(np.delete(start.z, gone), kept)


def _fitted(space: Space, searched: Float64) -> BaseFits:
    """Return the better one of two fits: from nominal by way of short parts, and from elsewhere.

    Of long recordings the two are told on some of their parts.
    """
    parts, origin = _on_parts(space), np.zeros(space.size)
    pieces = parts.problem.of("train")
    at_nominal = Fit.at(parts, origin, pieces, is_rough=True)
    near, some = polish_on_some(at_nominal, pieces, 6)
    best = _to_all(near, some)
    if parts.problem is space.problem:
        whole = best = _better(near, some, searched, best)
    elif some != pieces:
        best = _better(near, some, searched, best)
        whole = polish(space, best.z, space.problem.of("train"), 6)
        whole = replace(whole, starts_agree=best.starts_agree)
    else:
        segments = space.problem.of("train")
        whole = polish(space, best.z, segments, 6)
        whole = _better(whole, segments, searched, whole)
    return BaseFits(nominal=Start(origin, at_nominal.jacobian), parts=best, whole=whole)


def _better(first: Fit, segments: tuple[int, ...], start: Float64, found: Fit) -> Fit:
    """Return a fit to all recordings or one from a second start, and whether the two agree.

    Args:
        first: the fit on which they are compared.
        segments: of that.
        start: float64[n], the second one.
        found: where the first leads to on all recordings.
    """
    other = _from_elsewhere(first.space, start, first, segments)
    agree = max(first.cost, other.cost) <= _as_good(min(first.cost, other.cost))
    if other.cost < first.cost and not (agree and found is not first):
        found = min(found, _to_all(other, segments), key=lambda fit: fit.cost)
    return replace(found, starts_agree=agree)


def _to_all(fit: Fit, some: tuple[int, ...]) -> Fit:
    """Return a fit to some of the recordings' parts as one to all that there are to fit to."""
    segments = fit.space.problem.of("train")
    return fit if some == segments else polish(fit.space, fit.z, segments, 6)


def _from_elsewhere(space: Space, start: Float64, first: Fit, segments: tuple[int, ...]) -> Fit:
    """Return a fit from a second start: the first one, where it comes as far down as that.

    It goes down with the first one's derivative, then with its own.
    """
    z = space.clip(start)
    residual = space.residual([z], segments)[0]
    found = fit = go_down(Fit.of(space, z, residual, first.jacobian), segments)
    for _ in range(6):
        if first.cost * (1 - ENOUGH) < found.cost < first.cost * (1 + _NEARLY):
            return first
        fit = Fit.at(space, found.z, segments, is_rough=True)
        found = go_down(fit, segments)
        if not found.cost < fit.cost * (1 - ENOUGH):
            break
    return polish(space, fit, segments, 6) if fit.is_rough and fit.cost < first.cost else fit


def _as_good(cost: float) -> float:
    """Return up to which cost another fit is as good as one."""
    return cost * (1 + AGREE) + 1.0


def _on_parts(space: Space) -> Space:
    """Return the same on short parts, unless recordings come in such already."""
    return Space(space.problem.in_parts(WINDOW), space.candidates)
