"""Simulates candidates at finite sizes: how each changes what is left."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate, Quantity
from shared.identification.fitting.fit import Fit
from shared.identification.fitting.problem import Variant

GRID = (0.25, 0.5, 1.0, 2.0, 4.0)
"""Sizes, in probes, at which an effect that is not smooth is looked at."""


@dataclass(frozen=True)
class Look:
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


@dataclass(frozen=True)
class Looked:
    """A look, and what was seen."""

    look: Look
    columns: Float64
    """float64[V, M]: how each of its sizes changes the residual."""


Columns = Mapping[Candidate, Sequence[Looked]]


def looks_of(
    subject: Subject, candidates: Sequence[Candidate],
    more: Mapping[Candidate, Sequence[float]] | None = None,
) -> dict[Candidate, tuple[Look, ...]]:  # fmt: skip
    """Return where candidates are looked at: all combinations of forms, each at all scales.

    Args:
        subject: the arm.
        candidates: which.
        more: further values of the one form that a candidate has.
    """
    more = more or {}
    return {
        each: _looks(each.effect.quantities(subject, each.place), more.get(each, ()))
        for each in candidates
    }


def _looks(quantities: Sequence[Quantity], more: Sequence[float] = ()) -> tuple[Look, ...]:
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
    out: list[Look] = []
    for grid in itertools.product(*((*quantities[index].grid, *more) for index in forms)):
        form = np.zeros(len(quantities))
        form[forms] = np.array(grid) / probes[forms]
        for scale in scales:
            values: list[Float64] = []
            for index in sizes:
                each = form.copy()
                each[index if is_smooth else list(sizes)] = 1.0
                each[index] = scale
                values.append(np.clip(each * probes, low, high))
            out.append(Look(scale, form, sizes, tuple(values), is_level))
    return tuple(out)


def columns_of(
    fit: Fit, looks: Mapping[Candidate, Sequence[Look]], segments: tuple[int, ...],
    acted: tuple[int, ...] | None = None,
) -> dict[Candidate, list[Looked]]:  # fmt: skip
    """Return how candidates change the residual of a fit.

    Args:
        fit: what is there so far, on the segments.
        looks: at which sizes of which candidates.
        segments: of the fit.
        acted: segments in which the candidates can change anything; all if None.
    """
    problem = fit.space.problem
    acted = segments if acted is None else acted
    variants: list[Variant] = [
        fit.variant.with_extra(candidate, values)
        for candidate, each in looks.items()
        for look in each
        for values in look.values
    ]
    moved = np.zeros((len(variants), len(fit.residual) - fit.space.size))
    if acted and variants:
        rows = np.flatnonzero(problem.rows_of(segments, acted))
        moved[:, rows] = problem.moved(fit.variant, variants, acted, is_rough=True)[1]
    out: dict[Candidate, list[Looked]] = {}
    begin = 0
    for candidate, each in looks.items():
        out[candidate] = []
        for look in each:
            end = begin + len(look.values)
            out[candidate].append(Looked(look, moved[begin:end]))
            begin = end
    return out
