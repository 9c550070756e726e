"""Looks at every candidate once: how much of what the base leaves could it explain?

A candidate is simulated at a finite size. What the base parameters could absorb of it is taken
out, so that a latency that damping imitates does not count twice, and candidates that the base
imitates altogether do not count at all.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate, Effect
from shared.identification.fit import Fit, least_squares
from shared.identification.problem import Variant
from shared.identification.subject import Subject

GRID = (0.25, 0.5, 1.0, 2.0, 4.0)
"""Sizes, in probes, at which an effect that is not smooth is looked at."""


@dataclass(frozen=True)
class Screened:
    """A candidate at a size."""

    candidate: Candidate
    start: Float64
    """float64[Q], the size that explains most, in probes."""
    shift: Float64
    """float64[n], how the base moves with it."""
    share: float
    """Of the training residual that it takes off."""
    signature: Float64
    """float64[M + n], of unit length, what the base cannot absorb of it; empty if nothing."""


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
    """Return every candidate that explains anything, best first."""
    problem, base = fit.space.problem, fit.space.variant(fit.z)
    basis = np.linalg.qr(fit.jacobian)[0]
    left = fit.residual - basis @ (basis.T @ fit.residual)
    total = float(fit.residual @ fit.residual)
    variants: list[Variant] = []
    owners: list[tuple[int, int, float]] = []
    for index, candidate in enumerate(candidates):
        quantities = candidate.effect.quantities(problem.subject, candidate.place)
        is_smooth = all(quantity.is_smooth for quantity in quantities)
        for scale in (1.0,) if is_smooth else GRID:
            for column, quantity in enumerate(quantities):
                values = np.zeros(len(quantities))
                if not is_smooth:
                    values[:] = [each.probe for each in quantities]
                values[column] = np.clip(scale * quantity.probe, quantity.low, quantity.high)
                variants.append(base.with_extra(candidate, values))
                owners.append((index, column, scale))
    found = _signatures(fit, variants, segments)
    out: list[Screened] = []
    for index, candidate in enumerate(candidates):
        rows = [row for row, owner in enumerate(owners) if owner[0] == index]
        scales = sorted({owners[row][2] for row in rows})
        tried = [
            _judge(
                candidate,
                found[[row for row in rows if owners[row][2] == scale]].T,
                scale, basis, left, fit, total,
            )
            for scale in scales
        ]  # fmt: skip
        out.append(max(tried, key=lambda each: each.share))
    return sorted(out, key=lambda each: -each.share)


def _signatures(fit: Fit, variants: Sequence[Variant], segments: tuple[int, ...]) -> Float64:
    """Return float64[V, M + n]: how the residual changes."""
    problem, n = fit.space.problem, fit.space.size
    found = problem.vector(variants, segments)
    moved = found - fit.residual[:-n]
    return np.concatenate([moved, np.zeros((len(variants), n))], axis=1)


def _judge(
    candidate: Candidate, columns: Float64, scale: float, basis: Float64, left: Float64, fit: Fit,
    total: float,
) -> Screened:  # fmt: skip
    bare = columns - basis @ (basis.T @ columns)
    size = np.linalg.norm(bare, axis=0)
    nothing = Screened(
        candidate, np.zeros(columns.shape[1]), np.zeros(fit.space.size), 0.0, np.zeros(0)
    )
    if not np.isfinite(size).all() or float(size.max(initial=0.0)) < 1e-6:
        return nothing
    best = least_squares(bare, -left)
    quantities = candidate.effect.quantities(fit.space.problem.subject, candidate.place)
    low = np.array([each.low / each.probe for each in quantities])
    high = np.array([each.high / each.probe for each in quantities])
    best: Float64 = np.clip(best * scale, low, high) / scale
    explained = bare @ best
    share = float(left @ left - (left + explained) @ (left + explained)) / max(total, 1e-12)
    shift = least_squares(fit.jacobian, -(fit.residual + columns @ best))
    direction = explained / max(float(np.linalg.norm(explained)), 1e-12)
    return Screened(candidate, best * scale, shift, share, direction)
