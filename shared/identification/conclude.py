"""Puts a search into words: the verdict, what speaks for it, and what it does not say."""

from dataclasses import dataclass

import numpy as np

from shared.identification.certainty import half_widths
from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate
from shared.identification.gate import LEAST_GAIN, LEAST_SHARE, compare, floor_of
from shared.identification.problem import Variant
from shared.identification.search import ALIKE, Search, Tried
from shared.identification.verdict import (
    BaseValue,
    Cause,
    HeldOut,
    Interval,
    Scored,
    Tie,
    Unexplained,
    Word,
)

NEARLY_NOISE = 1.4
"""Mean square residual below which nothing worth a name is left."""
STANDS_OUT = 5.0
"""Size of a stretch, in noise floors, that is not passed over whatever the mean residual is."""
BESIDE_A_NAME = 1.7
"""The same beside a cause that passed."""
MAY_BE_LEFT = 0.08
"""Share of the base fit's mean square residual that named causes may leave where that is more:
what is far larger than the noise is never modelled to the last digit."""


@dataclass(frozen=True)
class Conclusion:
    """The parts of a verdict that follow from a search."""

    word: Word
    sentence: str
    causes: tuple[Cause, ...]
    ties: tuple[Tie, ...]
    held_out: HeldOut
    candidates: tuple[Scored, ...]
    base: tuple[BaseValue, ...]


def conclude(found: Search, left: tuple[Unexplained, ...]) -> Conclusion:
    """Return what a search comes to.

    Args:
        found: the search, over.
        left: what the extended model does not explain.
    """
    held_out = _held_out(found)
    causes = _causes(found)
    ties = _ties(found, causes)
    word = _word(found, ties, left)
    return Conclusion(
        word=word,
        sentence=_sentence(word, causes, ties, held_out, left),
        causes=causes if word == "named" else (),
        ties=ties if word == "tie" else (),
        held_out=held_out,
        candidates=_scored(found, word),
        base=_base(found),
    )


def extended(found: Search) -> Variant:
    """Return the model with what was accepted."""
    return found.current.space.variant(found.current.z)


def _word(found: Search, ties: tuple[Tie, ...], left_over: tuple[Unexplained, ...]) -> Word:
    base, left = float(found.base_losses.mean()), float(found.current_losses.mean())
    if found.accepted:
        if left > max(BESIDE_A_NAME, MAY_BE_LEFT * base):
            return "unexplained"
        return "tie" if ties else "named"
    if base <= NEARLY_NOISE and not _stands_out(left_over):
        return "none"
    return "base_too_coarse" if found.doubted else "unexplained"


def _stands_out(left: tuple[Unexplained, ...]) -> bool:
    """Return whether something that happened is too large to pass over."""
    return any(each.times_noise > STANDS_OUT for each in left)


def _held_out(found: Search) -> HeldOut:
    problem = found.problem
    gain = compare(found.base_losses, found.current_losses, np.random.default_rng(0))
    base = float(found.base_losses.mean())
    nothing = Variant(np.zeros(len(problem.parameters)))
    stages = {
        "nominal": nothing,
        "base_fit": found.base.space.variant(found.base.z),
        "extended": extended(found),
    }
    test = problem.of("test")
    reports = problem.reports(list(stages.values()), test)
    joints: dict[str, float] = {}
    tracker: dict[str, float] = {}
    for name, rows in zip(stages, reports, strict=True):
        raw = [problem.raw(report, segment) for report, segment in zip(rows, test, strict=True)]
        joints[name] = 1e3 * _rms([of_joints for of_joints, _ in raw])
        positions = [seen[:, :3] for _, seen in raw if seen is not None]
        if positions:
            tracker[name] = 1e3 * _rms(positions)
    joints["noise_floor"] = 1e3 * float(np.sqrt(np.mean(problem.noise.joints**2)))
    if problem.noise.tracker is not None:
        tracker["noise_floor"] = 1e3 * float(np.sqrt(np.mean(problem.noise.tracker[:3] ** 2)))
    low, high = gain.share_interval(base) if found.accepted else (0.0, 0.0)
    return HeldOut(
        nominal=float(np.sqrt(found.nominal_losses.mean())),
        base_fit=float(np.sqrt(base)),
        extended=float(np.sqrt(found.current_losses.mean())),
        noise_floor=float(np.sqrt(floor_of(base))),
        share_removed=min(gain.share(base), 1.0) if found.accepted else 0.0,
        share_interval=Interval(low=low, high=high)
        if found.accepted
        else Interval(low=0.0, high=0.0),
        joints_mrad=joints,
        tracker_mm=tracker,
    )


def _rms(parts: list[Float64]) -> float:
    return float(np.sqrt(np.mean(np.concatenate([part.ravel() for part in parts]) ** 2)))


def _causes(found: Search) -> tuple[Cause, ...]:
    """Return the accepted causes with their sizes in the final fit."""
    if not found.accepted:
        return ()
    final = found.current
    widths = half_widths(final, found.problem.of("train"))
    begin = final.space.base_size
    base = float(found.base_losses.mean())
    sizes: dict[Candidate, tuple[Float64, Float64]] = {}
    for candidate, values in final.space.variant(final.z).extras:
        count = len(values)
        sizes[candidate] = (values, widths[begin : begin + count])
        begin += count
    return tuple(_cause(found, each, *sizes[each.candidate], base) for each in found.accepted)


def _cause(found: Search, tried: Tried, values: Float64, widths: Float64, base: float) -> Cause:
    candidate = tried.candidate
    quantities = candidate.effect.quantities(found.problem.subject, candidate.place)
    first = quantities[0]
    half = float(widths[0]) * first.probe
    value = float(values[0])
    low, high = tried.gain.share_interval(base)
    return Cause(
        effect=candidate.effect.name,
        where=candidate.place,
        quantity=first.name,
        value=value,
        unit=first.unit,
        interval=Interval(low=value - half, high=value + half),
        title=candidate.effect.title,
        signature=candidate.effect.signature,
        others={
            each.name: float(number)
            for each, number in zip(quantities[1:], values[1:], strict=True)
        },
        share=tried.gain.share(base),
        share_interval=Interval(low=low, high=high),
    )


def _rival(found: Search, tried: Tried, base: float) -> Cause:
    """Return a cause that was not taken, with its sizes in its own fit."""
    widths = half_widths(tried.fit, found.problem.of("train"))
    values = tried.fit.space.values(tried.fit.z)[-1]
    return _cause(found, tried, values, widths[-len(values) :], base)


def _ties(found: Search, causes: tuple[Cause, ...]) -> tuple[Tie, ...]:
    base = float(found.base_losses.mean())
    out: list[Tie] = []
    for cause, tried, rivals in zip(causes, found.accepted, found.rivals, strict=True):
        if not rivals:
            continue
        others = tuple(_rival(found, each, base) for each in rivals)
        alike = min(_cosine(tried, each) for each in rivals)
        names = [_label(cause), *map(_label, others)]
        out.append(Tie(causes=(cause, *others), alike=alike, record=_motion(tried, rivals, names)))
    return tuple(out)


def _cosine(one: Tried, other: Tried) -> float:
    first, second = one.screened.signature, other.screened.signature
    if first.size == 0 or second.size == 0:
        return 0.0
    return abs(float(first @ second))


def _label(cause: Cause) -> str:
    words = cause.effect.replace("_", " ")
    return f"{words} of {cause.where}" if cause.where else words


def _motion(tried: Tried, rivals: tuple[Tried, ...], names: list[str]) -> str:
    """Return what to record to tell causes apart, by what sets them apart."""
    sides = {each.candidate.effect.side for each in (tried, *rivals)}
    places = {each.candidate.place for each in (tried, *rivals)}
    if "tracker" in sides and len(sides) > 1:
        how = "log joint positions beside the tracker, or fix the tracker elsewhere and repeat"
    elif len(places) > 1 and len({each.candidate.effect.name for each in (tried, *rivals)}) == 1:
        how = "move these joints one at a time, the others held"
    else:
        how = (
            "the static grid, the crawl with reversals and fast swings of `riposte identify excite`"
        )
    return f"To tell {' from '.join(names)}: {how}."


def _scored(found: Search, word: Word) -> tuple[Scored, ...]:
    """Return every candidate, those that were refitted first."""
    accepted = {each.candidate.label for each in found.accepted}
    rivals = {each.candidate.label for group in found.rivals for each in group}
    out: list[Scored] = []
    for label, screened in found.screened.items():
        candidate = screened.candidate
        tried = found.tried.get(label)
        entry = Scored(effect=candidate.effect.name, where=candidate.place, screen=screened.share)
        if tried is None:
            why = "not among the best at first sight" if label not in accepted else ""
            out.append(_replaced(entry, why_not=why))
            continue
        quantity = candidate.effect.quantities(found.problem.subject, candidate.place)[0]
        out.append(
            Scored(
                effect=entry.effect,
                where=entry.where,
                screen=entry.screen,
                gain=tried.gain.gain,
                gain_interval=Interval(low=tried.gain.low, high=tried.gain.high),
                value=float(tried.fit.space.values(tried.fit.z)[-1][0]),
                unit=quantity.unit,
                why_not=_why_not(tried, found, label, accepted, rivals, word),
            )
        )
    return tuple(sorted(out, key=lambda one: (one.gain is None, -(one.gain or 0.0), -one.screen)))


def _replaced(entry: Scored, why_not: str) -> Scored:
    return Scored(effect=entry.effect, where=entry.where, screen=entry.screen, why_not=why_not)


def _why_not(
    tried: Tried, found: Search, label: str, accepted: set[str], rivals: set[str], word: Word
) -> str:
    base = float(found.base_losses.mean())
    if label in accepted:
        return "" if word == "named" else "too much is left over with it" * (word == "unexplained")
    if label in rivals:
        return f"does as well as what was taken, within {ALIKE:.0%} of the gain or its error"
    if tried.gain.surely <= 0.0:
        return "no better on held-out recordings"
    if tried.gain.share(base) < LEAST_SHARE or tried.gain.gain < LEAST_GAIN * tried.gain.before:
        return "better, but by too little to be of use"
    return "explained better by what was taken"


def _base(found: Search) -> tuple[BaseValue, ...]:
    first, final = found.base, found.current
    widths = half_widths(final, found.problem.of("train"))
    out: list[BaseValue] = []
    for index, each in enumerate(found.problem.parameters):
        z, half = float(final.z[index]), float(widths[index])
        low, high = each.value(max(z - half, each.low)), each.value(min(z + half, each.high))
        out.append(
            BaseValue(
                name=each.name,
                unit=each.unit,
                nominal=each.nominal,
                base_fit=each.value(float(first.z[index])),
                extended=each.value(z),
                interval=Interval(low=low, high=high),
            )
        )
    return tuple(out)


def _sentence(
    word: Word,
    causes: tuple[Cause, ...],
    ties: tuple[Tie, ...],
    held_out: HeldOut,
    left: tuple[Unexplained, ...],
) -> str:
    ratio = f"{held_out.base_fit:.2f} times the noise"
    if word == "named":
        names = " and ".join(f"{cause.title}{_where(cause)} ({_size(cause)})" for cause in causes)
        return (
            f"What the simulation gets wrong: {names}. Held out, the residual goes from {ratio} "
            f"to {held_out.extended:.2f}."
        )
    if word == "tie":
        names = " or ".join(_label(cause) for cause in ties[0].causes)
        return f"These recordings do not tell apart: {names}. {ties[0].record}"
    if word == "none":
        return f"Nothing to name: with its base fitted the simulation is at {ratio}."
    if word == "base_too_coarse":
        return (
            f"The base model does not fit: {ratio} are left with links far from their known mass. "
            "Release more of its parameters, or correct the model file, before looking for causes."
        )
    if causes:
        names = " and ".join(f"{_label(cause)} ({_size(cause)})" for cause in causes)
        return (
            f"Something is wrong that no effect of the catalogue explains. Nearest comes {names}, "
            f"but from {ratio} it leaves {held_out.extended:.2f}, which is too much to believe it."
        )
    place = f", most of it at {left[0].where} {left[0].phase}" if left else ""
    return f"Something is wrong that no effect of the catalogue explains: {ratio}{place}."


def _where(cause: Cause) -> str:
    return f" at {cause.where}" if cause.where else ""


def _size(cause: Cause) -> str:
    half = (cause.interval.high - cause.interval.low) / 2
    unit = "" if cause.unit == "1" else f" {cause.unit}"
    return f"{cause.quantity} {cause.value:.3g} ± {half:.1g}{unit}"
