"""The causes that a search took, with their sizes, and what is not told from them."""

import numpy as np

from shared.identification.conclusion.sentence import label
from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate
from shared.identification.gate.certainty import CALIBRATED, half_widths
from shared.identification.gate.held_out import Gain, compare
from shared.identification.search.fewer import without
from shared.identification.search.searched import Search, Tried, cosine
from shared.identification.verdict import Cause, Interval, Tie


def causes_of(found: Search, widths: Float64) -> tuple[Cause, ...]:
    """Return the accepted causes with their sizes in the final fit.

    Args:
        found: the search, over.
        widths: float64[n], half of the 95 % interval of each coordinate of the final fit.
    """
    final = found.told
    begin = final.space.base_size
    base = float(found.base_losses.mean())
    sizes: dict[Candidate, tuple[Float64, Float64]] = {}
    for candidate, values in final.variant.extras:
        count = len(values)
        sizes[candidate] = (values, widths[begin : begin + count])
        begin += count
    return tuple(
        _cause(found, each.candidate, *sizes[each.candidate], gain, base)
        for each, gain in zip(found.accepted, _gains(found), strict=True)
    )


def _gains(found: Search) -> list[Gain]:
    """Return what each accepted cause takes off what all the others leave."""
    if len(found.accepted) == 1:
        return [found.accepted[0].gain]
    train, test = found.problem.of("train"), found.problem.of("test")
    rng = np.random.default_rng(0)
    return [
        compare(without(found, each, train, test).losses, found.current_losses, rng)
        for each in found.accepted
    ]


def _cause(
    found: Search, candidate: Candidate, values: Float64, widths: Float64, gain: Gain, base: float
) -> Cause:  # fmt: skip
    quantities = candidate.effect.quantities(found.problem.subject, candidate.place)
    forms = candidate.forms(found.problem.subject)
    ends = [
        _around(float(value), CALIBRATED * float(width) * each.probe)
        for each, value, width in zip(quantities, values, widths, strict=True)
    ]
    first = quantities[0]
    low, high = gain.share_interval(base)
    return Cause(
        effect=candidate.effect.name,
        where=candidate.place,
        quantity=first.name,
        value=float(values[0]),
        unit=first.unit,
        interval=ends[0],
        title=candidate.effect.title,
        signature=candidate.effect.signature,
        others={
            each.name: float(number)
            for each, number in zip(quantities[1:], values[1:], strict=True)
        },
        other_units={each.name: each.unit for each in quantities[1:]},
        other_intervals={
            each.name: own
            for each, own, is_form in zip(quantities[1:], ends[1:], forms[1:], strict=True)
            if not is_form
        },
        share=gain.share(base),
        share_interval=Interval(low=low, high=high),
    )


def _around(value: float, half: float) -> Interval:
    return Interval(low=value - half, high=value + half)


def rival(found: Search, tried: Tried, base: float) -> Cause:
    """Return a cause that was not taken, with its sizes in its own fit."""
    widths = half_widths(tried.fit, found.problem.of("train"))
    values = tried.fit.space.values(tried.fit.z)[-1]
    return _cause(found, tried.candidate, values, widths[-len(values) :], tried.gain, base)


def ties_of(found: Search, causes: tuple[Cause, ...]) -> tuple[Tie, ...]:
    """Return what the data do not tell from an accepted cause, with the cause."""
    base = float(found.base_losses.mean())
    out: list[Tie] = []
    for cause, tried, rivals in zip(causes, found.accepted, found.rivals, strict=True):
        if not rivals:
            continue
        others = tuple(rival(found, each, base) for each in rivals)
        alike = min(cosine(tried, each) for each in rivals)
        names = [label(cause), *map(label, others)]
        out.append(Tie(causes=(cause, *others), alike=alike, record=motion(tried, rivals, names)))
    return tuple(out)


def motion(tried: Tried, rivals: tuple[Tried, ...], names: list[str]) -> str:
    """Return what to record to tell causes apart, by what sets them apart."""
    sides = {each.candidate.effect.side for each in (tried, *rivals)}
    places = {each.candidate.place for each in (tried, *rivals)}
    if "tracker" in sides and len(sides) > 1:
        how = "log joint positions beside the tracker, or fix the tracker elsewhere and repeat"
    elif len(places) > 1 and len({each.candidate.effect.name for each in (tried, *rivals)}) == 1:
        how = "move these joints one at a time, the others held"
    elif sides == {"command"}:
        how = "a chirp and fast swings, with readings that come faster than commands"
    else:
        how = "the static grid, the crawl and the swings that riposte identify excite designs"
    return f"To tell {' from '.join(names)}: {how}."
