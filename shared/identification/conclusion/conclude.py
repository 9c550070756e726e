"""Puts a search into words: the verdict, what speaks for it, and what it does not say."""

from dataclasses import dataclass

import numpy as np

from shared.identification.conclusion.causes import causes_of, ties_of
from shared.identification.conclusion.limits import limits_of
from shared.identification.conclusion.sentence import sentence_of, with_base, with_far
from shared.identification.dataset.types import Float64
from shared.identification.fitting.problem import Variant
from shared.identification.gate.held_out import LEAST_SHARE, compare, floor_of
from shared.identification.search.bent import ties_with_base
from shared.identification.search.far import far_from_file
from shared.identification.search.searched import (
    ALIKE,
    Search,
    Tried,
    is_open,
    plain_losses,
    why_open,
)
from shared.identification.search.sized import widths_of
from shared.identification.verdict import (
    BaseValue,
    Cause,
    HeldOut,
    Interval,
    Limit,
    Scored,
    Tie,
    Unexplained,
    Word,
)

STANDS_OUT = 5.0
"""Size of a stretch, in noise floors, that is not passed over whatever the mean residual is."""


@dataclass(frozen=True)
class Conclusion:
    """The parts of a verdict that follow from a search."""

    word: Word
    sentence: str
    causes: tuple[Cause, ...]
    ties: tuple[Tie, ...]
    held_out: HeldOut
    candidates: tuple[Scored, ...]
    limits: tuple[Limit, ...]
    """From which size on the others would have been named; none where more is left than noise."""
    base: tuple[BaseValue, ...]
    far: str
    """What of the base is surely far from the model file, in words; empty if nothing."""


def conclude(found: Search, left: tuple[Unexplained, ...]) -> Conclusion:
    """Return what a search comes to.

    Args:
        found: the search, over.
        left: what the extended model does not explain.
    """
    held_out = _held_out(found)
    widths = widths_of(found)
    accepted = causes_of(found, widths)
    ties = ties_of(found, accepted) or ties_with_base(found)
    word = _word(found, ties, left)
    sure = tuple(cause for cause, rivals in zip(accepted, found.rivals, strict=True) if not rivals)
    told = accepted if word == "unexplained" else sure
    not_believed = why_open(found) or f"and {found.only_like}"
    sentence = sentence_of(word, told, ties, held_out, left, not_believed, found.doubted)
    far, base = far_from_file(found), _base(found, widths)
    further = with_far(sentence, word, far) if far else with_base(sentence, word, base, held_out)
    return Conclusion(
        word=word,
        sentence=further,
        causes=sure if word in ("named", "tie") else (),
        ties=ties if word == "tie" else (),
        held_out=held_out,
        candidates=_scored(found, word),
        limits=limits_of(found) if word in ("named", "none", "tie") else (),
        base=base,
        far=far,
    )


def extended(found: Search) -> Variant:
    """Return the model with what was accepted."""
    return found.current.variant


def _word(found: Search, ties: tuple[Tie, ...], left: tuple[Unexplained, ...]) -> Word:
    if found.accepted:
        if is_open(found) or found.only_like:
            return "unexplained"
        return "tie" if ties else "named"
    if is_open(found):
        return "base_too_coarse" if found.doubted else "unexplained"
    if _stands_out(left):
        return "unexplained"
    return "tie" if ties else "none"


def _stands_out(left: tuple[Unexplained, ...]) -> bool:
    """Return whether something that happened is too large to pass over."""
    return any(each.times_noise > STANDS_OUT for each in left)


def _held_out(found: Search) -> HeldOut:
    problem = found.problem
    of_nominal, of_base, of_current = plain_losses(found)
    gain = compare(of_base, of_current, np.random.default_rng(0))
    base = float(of_base.mean())
    nothing = Variant(np.zeros(len(problem.parameters)))
    stages = {
        "nominal": nothing,
        "base_fit": found.base.variant,
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
        nominal=float(np.sqrt(of_nominal.mean())),
        base_fit=float(np.sqrt(base)),
        extended=float(np.sqrt(of_current.mean())),
        noise_floor=float(np.sqrt(floor_of(base))),
        share_removed=gain.share(base) if found.accepted else 0.0,
        share_interval=Interval(low=low, high=high)
        if found.accepted
        else Interval(low=0.0, high=0.0),
        joints_mrad=joints,
        tracker_mm=tracker,
        is_floor_measured=problem.noise.is_measured,
        by_all=None if found.by_all is None else float(np.sqrt(found.by_all.plain)),
    )


def _rms(parts: list[Float64]) -> float:
    return float(np.sqrt(np.mean(np.concatenate([part.ravel() for part in parts]) ** 2)))


def _scored(found: Search, word: Word) -> tuple[Scored, ...]:
    """Return every candidate, those that were refitted first."""
    accepted = {each.candidate.label for each in found.accepted}
    rivals = {each.candidate.label for group in found.rivals for each in group}
    out: list[Scored] = []
    for label, screened in found.screened.items():
        candidate = screened.candidate
        tried = found.tried.get(label)
        if tried is None:
            out.append(
                Scored(
                    effect=candidate.effect.name,
                    where=candidate.place,
                    screen=screened.share,
                    why_not="not among the best at first sight" if label not in accepted else "",
                )
            )
            continue
        quantity = candidate.effect.quantities(found.problem.subject, candidate.place)[0]
        space = tried.fit.space
        out.append(
            Scored(
                effect=candidate.effect.name,
                where=candidate.place,
                screen=screened.share,
                gain=tried.gain.gain,
                gain_interval=Interval(low=tried.gain.low, high=tried.gain.high),
                value=float(space.values(tried.fit.z)[space.candidates.index(candidate)][0]),
                unit=quantity.unit,
                why_not=_why_not(tried, found, label, accepted, rivals, word),
            )
        )
    return tuple(sorted(out, key=lambda one: (one.gain is None, -(one.gain or 0.0), -one.screen)))


def _why_not(
    tried: Tried, found: Search, label: str, accepted: set[str], rivals: set[str], word: Word
) -> str:
    base = float(found.base_losses.mean())
    if label in accepted:
        if found.only_like:
            return found.only_like
        return "" if word == "named" else "too much is left over with it" * (word == "unexplained")
    if label in rivals:
        return f"does as well as what was taken, within {ALIKE:.0%} of the gain or its error"
    if tried.gain.surely <= 0.0 and tried.gain.apart is None:
        if tried.gain.gain >= LEAST_SHARE * base:
            return "better on held-out recordings, of which there are too few to be sure"
        return "no better on held-out recordings"
    if not tried.gain.is_useful(base):
        return "better, but by too little to be of use"
    if _does_as_well(tried, found):
        return "does as well as what was taken, but its size may be anything"
    return "explained better by what was taken"


def _does_as_well(tried: Tried, found: Search) -> bool:
    taken = [one.gain.gain for one in found.accepted]
    return len(taken) == 1 and tried.gain.gain >= (1.0 - ALIKE) * taken[0]


def _base(found: Search, widths: Float64) -> tuple[BaseValue, ...]:
    first, final = found.base, found.told
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
