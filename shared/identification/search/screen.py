"""Looks at every candidate once: how much of what the base leaves could it explain?

A candidate is simulated at a finite size. What the base parameters could absorb of it is taken
out, so that a latency that damping imitates does not count twice, and candidates that the base
imitates altogether do not count at all.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shared.identification.arm.segments import thinned
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate, Effect
from shared.identification.fitting.fit import Fit
from shared.identification.fitting.linear import bounded, least_squares
from shared.identification.fitting.problem import Problem
from shared.identification.fitting.turns import LATE
from shared.identification.search.looks import Columns, Look, Looked, columns_of, looks_of
from shared.identification.search.ripples import ripples_left

_MANY = 8
"""Parts, at least, of which every second one shows what acts all the time well enough to be looked
at closer, or not."""
_CLOSER = 16
"""Candidates that are looked at in all parts after that, where it is not plain."""
_PLAIN = 10.0
"""Mean square residual, in noise floors, from which it is: what is small takes all parts."""
_NEAR = 2.0
"""An effect that acts from some size on is looked at where it does no more than twice too much."""
_AGAIN, _AGAIN_LOCAL = 40, 2
"""Candidates that are looked at again where hardly more than noise is left: of those that act at
any size, and of the others."""


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


@dataclass
class Seen:
    """How candidates changed the residual when they were first looked at."""

    steady: Columns = field(default_factory=dict[Candidate, list[Looked]])
    """Of those that act at any size, in the parts in which they were looked at."""
    local: Columns = field(default_factory=dict[Candidate, list[Looked]])
    """Of the others, in all parts."""


class AtBest(NamedTuple):
    """A candidate at its best, and the look that showed it."""

    screened: Screened
    looked: Looked


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


def screen(
    fit: Fit, candidates: Sequence[Candidate], segments: tuple[int, ...], seen: Seen | None = None
) -> list[Screened]:
    """Return every candidate that explains anything, best first.

    Args:
        fit: what is there so far, on the segments.
        candidates: what is looked for.
        segments: recordings, or parts of them. Of many, every second one has to do for what acts
            all the time, but for the best of that unless much is left.
        seen: is filled at the first look. At a later one, where hardly more than noise is left,
            candidates that by it would explain least are not looked at, nor returned.
    """
    picked = _picked(fit.space.problem, segments)
    rows = shown_rows(fit, segments)
    subject = fit.space.problem.subject
    lasting = [each for each in candidates if each.recording is None]
    steady = [each for each in lasting if is_steady(subject, each)]
    local = [each for each in lasting if not is_steady(subject, each)]
    part = fit.on(rows)
    ripples = ripples_left(fit, steady, segments)
    if seen is not None and fit.is_near_noise:
        steady = _once_more(part, steady, seen.steady, _AGAIN, ripples)
        local = _once_more(fit, local, seen.local, _AGAIN_LOCAL)
    columns = columns_of(part, looks_of(subject, steady, ripples), picked)
    everywhere = columns_of(fit, looks_of(subject, local), segments)
    if seen is not None and not seen.steady:
        seen.steady, seen.local = columns, everywhere
    judged = sorted(at_best(part, columns), key=lambda each: -each.screened.share)
    is_plain = 2.0 * fit.cost > _PLAIN * len(fit.residual)
    count = _CLOSER if len(picked) < len(segments) and not is_plain else 0
    found = [each.screened for each in judged[count:]]
    found += _closer(fit, judged[:count], segments, picked)
    found += [each.screened for each in at_best(fit, everywhere, rows)]
    once = [each for each in candidates if each.recording is not None]
    for recording in dict.fromkeys(each.recording for each in once):
        own = [each for each in once if each.recording == recording]
        acted = of_recording(fit, recording, segments)
        columns = columns_of(fit, looks_of(subject, own), segments, acted)
        found += [each.screened for each in at_best(fit, columns, rows)]
    return sorted(found, key=lambda each: -each.share)


def _once_more(
    fit: Fit, candidates: Sequence[Candidate], columns: Columns, count: int,
    new: Collection[Candidate] = (),
) -> list[Candidate]:  # fmt: skip
    """Return those that are worth another look; what they change is much as it was.

    Of commands that are taken now and then it is not: as soon as a delay is there they change.

    Args:
        fit: what is there so far.
        candidates: which were looked at before.
        columns: how they changed the residual then.
        count: of those to look at again.
        new: those of which now something else is to be looked at.
    """
    known = {each: columns[each] for each in candidates if each in columns}
    best = sorted(at_best(fit, known), key=lambda each: -each.screened.share)[:count]
    kept = {each.screened.candidate for each in best}
    return [
        each
        for each in candidates
        if each in kept or each in new or each not in known or each.effect.name in LATE
    ]


def _closer(
    fit: Fit, judged: Sequence[AtBest], segments: tuple[int, ...], picked: tuple[int, ...]
) -> list[Screened]:
    """Return candidates as all parts show them, at the look that showed them in some.

    Args:
        fit: on all of them.
        judged: the candidates.
        segments: all of them.
        picked: those in which they were looked at.
    """
    rows = fit.space.problem.rows_of(segments, picked)
    others = tuple(each for each in segments if each not in picked)
    looks = {each.screened.candidate: (each.looked.look,) for each in judged}
    more = columns_of(fit.on(~rows), looks, others)
    both: dict[Candidate, list[Looked]] = {}
    for each in judged:
        here = each.looked
        (there,) = more[each.screened.candidate]
        columns = np.empty((len(here.columns), len(rows)))
        columns[:, rows], columns[:, ~rows] = here.columns, there.columns
        both[each.screened.candidate] = [Looked(here.look, columns)]
    return [each.screened for each in at_best(fit, both, rows)]


def _picked(problem: Problem, segments: tuple[int, ...]) -> tuple[int, ...]:
    return thinned(problem.segments, segments) if len(segments) >= _MANY else segments


def shown_rows(fit: Fit, segments: tuple[int, ...]) -> NDArray[np.bool_]:
    """Return which rows of a fit's residual signatures are of."""
    problem = fit.space.problem
    return problem.rows_of(segments, _picked(problem, segments))


def of_recording(fit: Fit, name: str | None, segments: tuple[int, ...]) -> tuple[int, ...]:
    """Return those of some segments that are of a recording."""
    problem = fit.space.problem
    names = [each.name for each in problem.dataset.trajectories]
    return tuple(each for each in segments if names[problem.segments[each].trajectory] == name)


def is_steady(subject: Subject, candidate: Candidate) -> bool:
    """Return whether a candidate acts at any size."""
    found = candidate.effect.quantities(subject, candidate.place)
    return all(each.is_smooth for each in found)


def at_best(fit: Fit, columns: Columns, rows: NDArray[np.bool_] | None = None) -> list[AtBest]:
    """Return every candidate at its best.

    Args:
        fit: what is there so far.
        columns: how candidates change its residual.
        rows: of which signatures are; all if None.
    """
    every = [each.columns for looked in columns.values() for each in looked]
    if not every:
        return []
    basis, triangle = np.linalg.qr(fit.jacobian)
    left = fit.residual - basis @ (basis.T @ fit.residual)
    moved = np.concatenate(every)
    along = moved @ basis[: moved.shape[1]]
    bare = -along @ basis.T
    bare[:, : moved.shape[1]] += moved
    shown = slice(None) if rows is None else np.r_[rows, np.ones(fit.space.size, np.bool_)]
    out: list[AtBest] = []
    begin = 0
    for candidate, looked in columns.items():
        tried: list[tuple[_Mixed, Looked, slice]] = []
        for each in looked:
            own = slice(begin, begin + len(each.columns))
            tried.append((_mixed(fit, candidate, each.look, bare[own], left), each, own))
            begin = own.stop
        best, each, own = max(tried, key=lambda one: one[0].share)
        start, shift, direction = each.look.form.copy(), np.zeros(fit.space.size), np.zeros(0)
        if best.share:
            scale = 1.0 if each.look.is_level else best.sizes
            start[list(each.look.sizes)] = scale * each.look.scale
            shift = least_squares(triangle, -(basis.T @ fit.residual + best.sizes @ along[own]))
            direction = (best.sizes @ bare[own])[shown]
            direction = direction / max(float(np.linalg.norm(direction)), 1e-12)
        out.append(AtBest(Screened(candidate, start, shift, best.share, direction), each))
    return out


class _Mixed(NamedTuple):
    """The sizes of a look, mixed so that they explain most."""

    sizes: Float64
    """float64[V], of what was simulated."""
    share: float
    """What that explains; 0 if nothing."""


def _mixed(fit: Fit, candidate: Candidate, look: Look, bare: Float64, left: Float64) -> _Mixed:
    """Return how much of each size explains most.

    Args:
        fit: what is there so far.
        candidate: what is looked for.
        look: its sizes.
        bare: float64[V, M + n], what they change that the base cannot make up for.
        left: float64[M + n], what the base leaves.
    """
    size = np.linalg.norm(bare, axis=1)
    if not np.isfinite(size).all() or float(size.max(initial=0.0)) < 1e-6:
        return _Mixed(np.zeros(len(bare)), 0.0)
    found = candidate.effect.quantities(fit.space.problem.subject, candidate.place)
    quantities = [found[index] for index in look.sizes]
    low = np.array([each.low / each.probe for each in quantities]) / look.scale
    high = np.array([each.high / each.probe for each in quantities]) / look.scale
    best = bounded(bare.T, -left, low, np.maximum(high, low + 1e-9 / look.scale))
    if look.is_level:
        best = np.clip(best, 1.0 / _NEAR, _NEAR)
    after = left + best @ bare
    total = float(left @ left)
    return _Mixed(best, (total - float(after @ after)) / max(total, 1e-12))
