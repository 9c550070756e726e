"""Looks at every candidate once: how much of what the base leaves could it explain?

A candidate is simulated at a finite size. What the base parameters could absorb of it is taken
out, so that a latency that damping imitates does not count twice, and candidates that the base
imitates altogether do not count at all.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate, Effect, Quantity
from shared.identification.fit import Fit
from shared.identification.linear import bounded, least_squares
from shared.identification.problem import Variant
from shared.identification.subject import Subject

GRID = (0.25, 0.5, 1.0, 2.0, 4.0)
"""Sizes, in probes, at which an effect that is not smooth is looked at."""
_EVERY = 2
"""One in so many parts shows what acts all the time well enough to be looked at closer, or not."""
_MANY = 8
"""Parts, at least, of which some are left out."""
_CLOSER = 16
"""Candidates that are looked at in all parts after that, where it is not plain."""
_PLAIN = 10.0
"""Mean square residual, in noise floors, from which it is: what is small takes all parts."""
_NEAR = 2.0
"""An effect that acts from some size on is looked at where it does no more than twice too much."""


@dataclass(frozen=True)
class Screened:
    """A candidate at a size."""

    candidate: Candidate
    start: Float64
    """float64[Q], the size that explains most, in probes."""
    shift: Float64
    """float64[n], how the base moves with it."""
    share: float
    """Of the training residual that the base leaves, at its best as far as its derivative says,
    which it takes off."""
    signature: Float64
    """float64[K], of unit length, what the base cannot absorb of it in some rows of the residual,
    the same ones for all candidates; empty if nothing."""


def candidates_of(
    effects: Sequence[Effect], subject: Subject, without: frozenset[str]
) -> tuple[tuple[Candidate, ...], dict[str, str]]:
    """Return what is looked for, and why the other effects are not."""
    found: list[Candidate] = []
    ruled_out: dict[str, str] = {}
    for effect in effects:
        if effect.name in without:
            ruled_out[effect.name] = "left out on request"
            continue
        places = effect.places(subject)
        if not places:
            ruled_out[effect.name] = "these data, or this arm, cannot show it"
        found += [Candidate(effect, place) for place in places]
    return tuple(found), ruled_out


def screen(fit: Fit, candidates: Sequence[Candidate], segments: tuple[int, ...]) -> list[Screened]:
    """Return every candidate that explains anything, best first.

    Args:
        fit: what is there so far, on the segments.
        candidates: what is looked for.
        segments: recordings, or parts of them. Of many, every second one has to do for what acts
            all the time, but for the best of that unless much is left.
    """
    picked = segments[::_EVERY] if len(segments) >= _MANY else segments
    rows = fit.space.problem.rows_of(segments, picked)
    subject = fit.space.problem.subject
    once = [each for each in candidates if each.recording is not None]
    lasting = [each for each in candidates if each.recording is None]
    steady = [each for each in lasting if _is_steady(subject, each)]
    local = [each for each in lasting if not _is_steady(subject, each)]
    found = sorted(_screened(fit.on(rows), steady, picked, None), key=_best_first)
    is_plain = 2.0 * fit.cost > _PLAIN * len(fit.residual)
    if len(picked) < len(segments) and not is_plain:
        local += [each.candidate for each in found[:_CLOSER]]
        del found[:_CLOSER]
    found += _screened(fit, local, segments, rows)
    for recording in dict.fromkeys(each.recording for each in once):
        own = [each for each in once if each.recording == recording]
        found += _screened(fit, own, segments, rows, _of_recording(fit, recording, segments))
    return sorted(found, key=_best_first)


def _of_recording(fit: Fit, name: str | None, segments: tuple[int, ...]) -> tuple[int, ...]:
    """Return those of some segments that are of a recording."""
    problem = fit.space.problem
    names = [each.name for each in problem.dataset.trajectories]
    return tuple(each for each in segments if names[problem.segments[each].trajectory] == name)


def _best_first(screened: Screened) -> float:
    return -screened.share


def _is_steady(subject: Subject, candidate: Candidate) -> bool:
    """Return whether a candidate acts at any size."""
    found = candidate.effect.quantities(subject, candidate.place)
    return all(each.is_smooth for each in found)


def _screened(
    fit: Fit, candidates: Sequence[Candidate], segments: tuple[int, ...],
    rows: NDArray[np.bool_] | None, acted: tuple[int, ...] | None = None,
) -> list[Screened]:  # fmt: skip
    """Return every candidate at its best.

    Args:
        fit: what is there so far, on the segments.
        candidates: what is looked for.
        segments: of the fit.
        rows: of which signatures are; all if None.
        acted: segments in which the candidates can change anything; all if None.
    """
    if not candidates:
        return []
    problem, base = fit.space.problem, fit.space.variant(fit.z)
    basis, triangle = np.linalg.qr(fit.jacobian)
    left = fit.residual - basis @ (basis.T @ fit.residual)
    variants: list[Variant] = []
    looks: list[list[tuple[_Look, slice]]] = []
    for candidate in candidates:
        quantities = candidate.effect.quantities(problem.subject, candidate.place)
        begun: list[tuple[_Look, slice]] = []
        for look in _looks(quantities):
            begin = len(variants)
            variants += [base.with_extra(candidate, values) for values in look.values]
            begun.append((look, slice(begin, len(variants))))
        looks.append(begun)
    found = _signatures(fit, variants, segments, segments if acted is None else acted)
    shown = slice(None) if rows is None else np.r_[rows, np.ones(fit.space.size, np.bool_)]
    out: list[Screened] = []
    for candidate, begun in zip(candidates, looks, strict=True):
        tried = [
            _judge(candidate, found[of].T, look, basis, triangle, left, fit, shown)
            for look, of in begun
        ]
        out.append(max(tried, key=lambda each: each.share))
    return out


@dataclass(frozen=True)
class _Look:
    """Sizes that are simulated one at a time and then mixed."""

    scale: float
    """Of the probes."""
    form: Float64
    """float64[Q], what is the same for all of them, in probes."""
    sizes: tuple[int, ...]
    """The quantities that say how much."""
    values: tuple[Float64, ...]
    """float64[Q] for each of them."""
    is_level: bool = False
    """Whether it acts from some size on: what is twice as large is no mixture of it."""


def _looks(quantities: Sequence[Quantity]) -> list[_Look]:
    """Return all combinations of forms, each at all scales."""
    probes = np.array([each.probe for each in quantities])
    low, high = (np.array([getattr(each, end) for each in quantities]) for end in ("low", "high"))
    sizes = tuple(index for index, each in enumerate(quantities) if not each.grid)
    forms = [index for index, each in enumerate(quantities) if each.grid]
    is_smooth = all(quantities[index].is_smooth for index in sizes)
    scales = GRID
    if is_smooth:
        scales = tuple(sorted({scale for index in sizes for scale in quantities[index].scales}))
    is_level = not sizes
    if is_level:  # a number that acts from some size on, which its grid is about
        sizes, forms = (0,), forms[1:]
        scales = tuple(value / quantities[0].probe for value in quantities[0].grid)
    out: list[_Look] = []
    for grid in itertools.product(*(quantities[index].grid for index in forms)):
        form = np.zeros(len(quantities))
        form[forms] = np.array(grid) / probes[forms]
        for scale in scales:
            values: list[Float64] = []
            for index in sizes:
                each = form.copy()
                each[index if is_smooth else list(sizes)] = 1.0
                each[index] = scale
                values.append(np.clip(each * probes, low, high))
            out.append(_Look(scale, form, sizes, tuple(values), is_level))
    return out


def _signatures(
    fit: Fit, variants: Sequence[Variant], segments: tuple[int, ...], acted: tuple[int, ...]
) -> Float64:
    """Return float64[V, M + n]: how the residual changes."""
    problem = fit.space.problem
    moved = np.zeros((len(variants), len(fit.residual)))
    if acted:
        rows = np.flatnonzero(problem.rows_of(segments, acted))
        moved[:, rows] = problem.vector(variants, acted) - fit.residual[rows]
    return moved


def _judge(
    candidate: Candidate, columns: Float64, look: _Look, basis: Float64, triangle: Float64,
    left: Float64, fit: Fit, shown: slice | NDArray[np.bool_],
) -> Screened:  # fmt: skip
    bare = columns - basis @ (basis.T @ columns)
    size = np.linalg.norm(bare, axis=0)
    if not np.isfinite(size).all() or float(size.max(initial=0.0)) < 1e-6:
        return Screened(candidate, look.form, np.zeros(fit.space.size), 0.0, np.zeros(0))
    found = candidate.effect.quantities(fit.space.problem.subject, candidate.place)
    quantities = [found[index] for index in look.sizes]
    low = np.array([each.low / each.probe for each in quantities])
    high = np.array([each.high / each.probe for each in quantities])
    scale = look.scale
    best = bounded(bare, -left, low / scale, np.maximum(high, low + 1e-9) / scale)
    if look.is_level:
        best = np.clip(best, 1.0 / _NEAR, _NEAR)
    explained = bare @ best
    total = float(left @ left)
    share = (total - float((left + explained) @ (left + explained))) / max(total, 1e-12)
    shift = least_squares(triangle, -(basis.T @ (fit.residual + columns @ best)))
    direction = explained[shown]
    direction = direction / max(float(np.linalg.norm(direction)), 1e-12)
    start = look.form.copy()
    start[list(look.sizes)] = scale if look.is_level else best * scale
    return Screened(candidate, start, shift, share, direction)
