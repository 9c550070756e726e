"""From which size on an effect would have been named: what a verdict without it is worth.

An effect that takes a tenth off what the base leaves of held-out motion is named nine times of ten
(docs/identify_results.md). How an effect changes the residual was simulated when it was first
looked at; what the base could make up for is taken out, and how much of the rest makes a tenth of
what is left is its limit of detection.
"""

from collections.abc import Sequence

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.fitting.fit import Fit
from shared.identification.search.looks import Columns, Looked
from shared.identification.search.screen import is_steady, shown_rows
from shared.identification.search.searched import Search
from shared.identification.verdict import NAMED_RATIO, Limit


def limits_of(found: Search) -> tuple[Limit, ...]:
    """Return from which size on each effect would have been named, beside those that were.

    Not of a push: that depends on when.

    Args:
        found: the search, over.
    """
    parts = found.parts
    part = parts.on(shown_rows(parts, parts.space.problem.of("train")))
    taken = {each.candidate for each in found.accepted}
    looks = ((part, found.seen.steady), (parts, found.seen.local))
    limits = [
        limit
        for fit, columns in looks
        for limit in _limits(fit, {each: columns[each] for each in columns if each not in taken})
    ]
    return tuple(sorted(limits, key=lambda each: each.effect))


def _limits(fit: Fit, columns: Columns) -> list[Limit]:
    """Return the limits of what changes the residual of a fit so, at the form that shows least."""
    basis = np.linalg.qr(fit.jacobian)[0]
    left = fit.residual - basis @ (basis.T @ fit.residual)
    wanted = float(np.linalg.norm(left)) * NAMED_RATIO
    out: list[Limit] = []
    for candidate, looked in columns.items():
        quantity = candidate.effect.quantities(fit.space.problem.subject, candidate.place)[0]
        forms: dict[bytes, list[Looked]] = {}
        for each in looked:
            forms.setdefault(each.look.form.tobytes(), []).append(each)
        is_smooth = is_steady(fit.space.problem.subject, candidate)
        size = max(_size(basis, alike, wanted, is_smooth=is_smooth) for alike in forms.values())
        out.append(
            Limit(
                effect=candidate.effect.name,
                where=candidate.place,
                quantity=quantity.name,
                size=size if size <= max(-quantity.low, quantity.high) else None,
                unit=quantity.unit,
                title=candidate.effect.title,
            )
        )
    return out


def _size(basis: Float64, looked: Sequence[Looked], wanted: float, *, is_smooth: bool) -> float:
    """Return the size at which a change is as large as is wanted; infinite if none is.

    Between two that were simulated it goes by a power of the size, below them by the size itself,
    and beyond them, too, if it is smooth. Of what acts from some size on nothing is known below.

    Args:
        basis: float64[M, n], what the base can make up for.
        looked: at sizes of the first number, each with how that changes the residual.
        wanted: length of the change that is left.
        is_smooth: whether small changes of the size change a little.
    """
    sizes, lengths = [0.0], [0.0]
    for each in sorted(looked, key=lambda one: abs(float(one.look.values[0][0]))):
        column = each.columns[0]
        along = column @ basis[: len(column)]
        sizes.append(abs(float(each.look.values[0][0])))
        lengths.append(float(np.sqrt(max(column @ column - along @ along, 0.0))))
    above = next((index for index, length in enumerate(lengths) if length >= wanted), 0)
    if not above:
        return sizes[-1] * wanted / lengths[-1] if is_smooth and lengths[-1] > 0.0 else np.inf
    below, reached = lengths[above - 1], lengths[above]
    if below <= 0.0:
        return sizes[above] * (1.0 if looked[0].look.is_level else wanted / reached)
    power = np.log(wanted / below) / np.log(reached / below)
    return float(sizes[above - 1] * (sizes[above] / sizes[above - 1]) ** power)
