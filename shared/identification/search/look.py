"""Looks at candidates and refits the best roughly: from the base's fit, and from the nominal model.

A base that lacks a large cause is bent so far towards it that nearby the cause does not show: a
forearm whose torque is limited to a quarter was fitted with ten times its inertia, and what was
then missing looked like a friction. Seen from the nominal model it comes first.
"""

from collections.abc import Callable, Sequence

from shared.identification.effect import Candidate
from shared.identification.fitting.fit import Fit, Start
from shared.identification.fitting.refit import Rough, refit, refit_late
from shared.identification.fitting.turns import LATE
from shared.identification.progress import Progress
from shared.identification.search.screen import Screened, Seen, screen
from shared.identification.search.windows import closer

_TRIED = 6
"""Candidates that are refitted with the base's derivative kept."""
_MORE = 2
"""Further ones that only the nominal model shows; and of those that it shows best, as many from
there, too."""
_PER_EFFECT = 3
"""Places of one effect among those tried."""
_SLIGHT = 0.015
"""Of the training residual: what explains less at first sight is not refitted."""
_SURELY = 12.0
"""Squares of a standard error that it is at least, where the noise is known to be white."""
_SLIGHT_BESIDE = 0.1
"""The same, as a share of what the best one explains."""
_ONCE_BESIDE = 0.3
"""The same of what happened once: a law that the model lacks looks like pushes where it is most."""


def look(
    fit: Fit, nominal: Start, candidates: Sequence[Candidate], is_far: bool, progress: Progress,
    is_calm: bool = False, is_hopeless: Callable[[Screened], bool] = lambda one: False,
    seen: Seen | None = None,
) -> tuple[list[Screened], list[Rough]]:  # fmt: skip
    """Return what every candidate could explain, best first, and rough refits of the best.

    Args:
        fit: the base's, with the causes that were accepted before.
        nominal: the derivative at the nominal model, of the base alone.
        candidates: what is looked for.
        is_far: whether so much is left that the base may be bent.
        progress: is told how far it is.
        is_calm: whether nothing stands out that may have happened once; no such candidate is
            refitted then, nor looked at beside a cause.
        is_hopeless: says of a candidate that it has no prospect of passing: it is not refitted.
        seen: how candidates changed the residual when they were first looked at.
    """
    segments = fit.space.problem.of("train")
    if is_calm and fit.space.candidates:
        candidates = [each for each in candidates if each.recording is None]
    progress("screen", 0.0, f"{len(candidates)} candidates")
    screened = screen(fit, candidates, segments, seen)
    slight = _slight(fit)
    refitted = [each for each in screened if not is_calm or each.candidate.recording is None]
    picked = [(each, fit) for each in _diverse(refitted, slight) if not is_hopeless(each)]
    picked = [
        (closer(fit, each, segments) if each.candidate.recording else each, fit)
        for each, _ in picked
    ]
    if is_far:
        progress("screen", 0.5, "again, from the nominal model")
        far = Fit.at(fit.space, nominal.with_causes_of(fit), segments, is_rough=True)
        known = {each.candidate for each, _ in picked}
        there = _diverse(screen(far, candidates, segments), slight)
        there = [each for each in there if each.candidate.recording is None]
        new = [each for each in there if each.candidate not in known]
        # What a bent base shows of a large cause is a fraction of it, from where no way leads.
        largest = [each for each in there[:_MORE] if each.candidate in known]
        picked += [(each, far) for each in (*largest, *new[:_MORE])]
    tried = {each.candidate for each, _ in picked}
    others = [each for each in screened if each.candidate not in tried]
    found: list[Rough] = []
    for index, (each, begun) in enumerate(sorted(picked, key=lambda entry: _has_turns(entry[0]))):
        progress("refit", index / len(picked), each.candidate.label)
        late = _late(found, each, fit, segments)
        found.append(late or refit(fit, nominal, each, segments, begun))
    found += [late for each in others if (late := _late(found, each, fit, segments))]
    found.sort(key=lambda entry: entry.ratio)
    first = {each.screened.candidate: each for each in reversed(found)}
    return screened, [each for each in found if first[each.screened.candidate] is each]


def _has_turns(screened: Screened) -> bool:
    """Return whether a candidate hardly differs from another one while it is small."""
    return screened.candidate.effect.name in LATE


def _late(
    found: Sequence[Rough], screened: Screened, fit: Fit, segments: tuple[int, ...]
) -> Rough | None:
    """Return an interval's refit from a delay like its mean, None unless that is the best."""
    if not found or not _has_turns(screened):
        return None
    best = min(found, key=lambda entry: entry.ratio)
    like, own = best.screened.candidate, screened.candidate
    if (like.effect.name, like.place) != (LATE[own.effect.name], own.place):
        return None
    return refit_late(best, screened, fit, segments)


def _slight(fit: Fit) -> float:
    """Return which share of the training residual is too little to be looked at."""
    is_white = fit.space.problem.noise.is_white
    return min(_SLIGHT, _SURELY / len(fit.residual)) if is_white else _SLIGHT


def _diverse(screened: Sequence[Screened], slight: float = _SLIGHT) -> list[Screened]:
    """Return the best few, not all of one effect; what happened once takes nobody's place."""
    counts: dict[str, int] = {}
    out: list[Screened] = []
    lasting = 0
    for each in screened:
        name, is_once = each.candidate.effect.name, each.candidate.recording is not None
        counts[name] = counts.get(name, 0) + 1
        beside = _ONCE_BESIDE if is_once else _SLIGHT_BESIDE
        is_slight = each.share < max(slight, beside * screened[0].share)
        if counts[name] > _PER_EFFECT or is_slight or (lasting == _TRIED and not is_once):
            continue
        out.append(each)
        lasting += not is_once
    return out
