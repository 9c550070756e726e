"""Searches for causes: looks, tries, and judges each on what was held out."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate
from shared.identification.family import Family, look_elsewhere, relatives
from shared.identification.fit import Fit, Start, polish
from shared.identification.gate import LEAST_SHARE, Gain, compare, floor_of, stretches
from shared.identification.left_out import left_out
from shared.identification.problem import Problem
from shared.identification.progress import Progress
from shared.identification.refit import Rough, refit, settle
from shared.identification.screen import Screened, screen
from shared.identification.space import Space

_ROUNDS = 4
"""Each names one cause, and what is like it at other joints."""
_TRIED = 6
"""Candidates that are refitted with the base's derivative kept."""
_FULL = 4
"""Of these, candidates that get a full fit."""
_PER_EFFECT = 3
"""Places of one effect among those tried."""
_SLIGHT = 0.015
"""Of the training residual: what explains less at first sight is not refitted."""
_SLIGHT_BESIDE = 0.1
"""The same, as a share of what the best one explains."""
_FAR = 2.0
"""Candidates whose rough refit costs so many times the best one's get no full fit."""
QUIET = 1.25
"""Mean square residual, in noise floors, below which no further cause is looked for."""
_ONCE = "external_contact"
_STANDS_OUT = 8.0
"""Mean square residual of a stretch over the usual one, where something happened once."""
_TAKEN_AWAY = 0.4
"""Share of it that may be left by what explains it."""
ALIKE = 0.02
"""Of a cause's gain: what does as well within this is not told from it."""


@dataclass(frozen=True)
class Tried:
    """A candidate that was refitted."""

    screened: Screened
    fit: Fit
    gain: Gain
    losses: Float64
    """float64[S] of held-out stretches."""
    is_event: bool = False
    """Whether it happened once, in a recording that was fitted to, and explains what stood out."""
    is_relative: bool = False
    """Whether it was found at a joint because most others have it."""

    @property
    def candidate(self) -> Candidate:
        """Return which."""
        return self.screened.candidate

    @property
    def numbers(self) -> int:
        """Return how many numbers the effect has."""
        return len(self.screened.start)


@dataclass
class Search:
    """A search while it goes on, and what it found."""

    problem: Problem
    rng: np.random.Generator
    candidates: tuple[Candidate, ...]
    ruled_out: dict[str, str]
    doubted: tuple[str, ...]
    """Parameters that were taken out of the base because they went further than is believable."""
    base: Fit
    """Without any cause, on whole recordings."""
    nominal: Start
    """Where refits begin a second time."""
    parts: Fit
    """With what was accepted, on short parts: where is looked."""
    current: Fit
    """The same on whole recordings: where is judged."""
    nominal_losses: Float64
    base_losses: Float64
    current_losses: Float64
    screened: dict[str, Screened] = field(default_factory=dict[str, Screened])
    """Every candidate's best, from the first round."""
    tried: dict[str, Tried] = field(default_factory=dict[str, Tried])
    accepted: list[Tried] = field(default_factory=list[Tried])
    rivals: list[tuple[Tried, ...]] = field(default_factory=list[tuple[Tried, ...]])
    """For each accepted cause, what the data do not tell from it."""


def search(found: Search, progress: Progress) -> None:
    """Look for causes, one after another, until none passes or one is not told from others."""
    train, test = found.problem.of("train"), found.problem.of("test")
    for _ in range(_ROUNDS):
        is_over = found.accepted and _is_over(found)
        if is_over or not _round(found, train, test, progress):
            break
    if len(found.accepted) > 1:
        _prune(found, train, test)


def _is_over(found: Search) -> bool:
    """Return whether nothing is left that a cause could be named for.

    It is not told from noise or, where that was not measured, all of it is less than what a cause
    must take off to be of use.
    """
    if found.problem.noise.is_measured:
        return _is_quiet(found, found.current_losses)
    left, base = float(found.current_losses.mean()), float(found.base_losses.mean())
    return left < LEAST_SHARE * (base - floor_of(base))


def _is_quiet(found: Search, losses: Float64) -> bool:
    """Return whether held-out losses float64[S] are not told from noise, where it was measured."""
    return found.problem.noise.is_measured and bool(losses.mean() < QUIET)


def _round(
    found: Search, train: tuple[int, ...], test: tuple[int, ...], progress: Progress
) -> bool:
    """Look for one more cause; return whether there was one."""
    taken = {each.candidate for each in found.accepted}
    left = [each for each in found.candidates if each not in taken]
    if not left:
        return False
    progress("screen", 0.0, f"{len(left)} candidates")
    parts = found.parts.space.problem.of("train")
    screened = screen(found.parts, left, parts)
    for each in screened:
        found.screened.setdefault(each.candidate.label, each)
    picked = _diverse(screened)
    roughly: list[Rough] = []
    for index, each in enumerate(picked):
        progress("refit", index / len(picked), each.candidate.label)
        roughly.append(refit(found.parts, found.nominal, each, parts))
    roughly.sort(key=lambda entry: entry.ratio)
    tried: list[Tried] = []
    for each in roughly[:_FULL]:
        if each.ratio > min(1 - 1e-3, _FAR * roughly[0].ratio + 0.02):
            break
        progress("decide", len(tried) / _FULL, each.screened.candidate.label)
        space = Space(found.problem, each.space.candidates)
        fit = settle(space, each.z, train)
        losses = stretches(found.problem, space.variant(fit.z), test)
        gain = _judged(found, each.screened.candidate, _before(found), _Model(fit, losses))
        is_event = _explains_event(found, each.screened.candidate, fit, train)
        tried.append(Tried(each.screened, fit, gain, losses, is_event))
    for one in tried:
        found.tried.setdefault(one.candidate.label, one)
    base = float(found.base_losses.mean())
    useful = [one for one in tried if one.is_event or one.gain.is_useful(base)]
    if not useful:
        return False
    best, rivals = _simplest(useful, found.rng)
    rivals = tuple(one for one in rivals if not _adds(found, best, one, train, test))
    fit = polish(best.fit.space, best.fit.z, train, 4, enough=1e-4)
    losses = stretches(found.problem, fit.space.variant(fit.z), test)
    gain = _judged(found, best.candidate, _before(found), _Model(fit, losses))
    if gain.loss <= best.gain.loss and (best.is_event or gain.is_useful(base)):
        best = Tried(best.screened, fit, gain, losses, best.is_event)
    best, rivals, family = _elsewhere(found, best, rivals, train, test, progress)
    found.accepted.append(best)
    found.rivals.append(rivals)
    found.current, found.current_losses = best.fit, best.losses
    if family is not None:
        _join(found, family)
    if rivals:
        return False
    if found.parts.space.problem is found.problem:
        found.parts = found.current
    else:
        space = Space(found.parts.space.problem, found.current.space.candidates)
        found.parts = polish(space, found.current.z, parts, 2)
    return True


class _Model(NamedTuple):
    """A fit, and what it leaves of what nothing was fitted to."""

    fit: Fit
    losses: Float64
    """float64[S] of held-out stretches."""


def _before(found: Search) -> _Model:
    """Return what there is so far."""
    return _Model(found.current, found.current_losses)


def _judged(found: Search, candidate: Candidate, before: _Model, after: _Model) -> Gain:
    """Return what a cause takes off what was held out, and how sure that is.

    All recordings make it surer, those that were fitted to with the size that the others give it;
    what nothing was fitted to has to speak for it by more than its standard error all the same.
    Of what happened once in one of them nothing is sure, see :func:`_explains_event`.
    """
    gain = compare(before.losses, after.losses, found.rng)
    more = left_out(before.fit, after.fit, candidate, found.problem.of("train"))
    whole = compare(
        np.concatenate([before.losses, more.before]),
        np.concatenate([after.losses, more.after]),
        found.rng,
    )
    surely = max(gain.surely, min(whole.surely, gain.gain - gain.error))
    if candidate.effect.name == _ONCE:
        surely = -np.inf  # there it only frees the base, of whatever it is
    return replace(gain, surely=surely, is_measured=found.problem.noise.is_measured)


def _elsewhere(
    found: Search, best: Tried, rivals: tuple[Tried, ...], train: tuple[int, ...],
    test: tuple[int, ...], progress: Progress,
) -> tuple[Tried, tuple[Tried, ...], Family | None]:  # fmt: skip
    """Look at other joints for the cause to be taken, and for those that are not told from it.

    Returns:
        The cause to take, its rivals, and what is like it at other joints, which may tell it from
        what were its rivals.
    """
    if _is_quiet(found, best.losses):
        return best, rivals, None
    families: list[tuple[Tried, Family]] = []
    for one in (best, *rivals):
        others = relatives(found.candidates, one.candidate, one.fit)
        if not others:
            continue
        progress("refit", 1.0, f"{one.candidate.effect.name} at {len(others)} other joints")
        family = look_elsewhere(one.fit, others, one.losses, train, test, found.rng)
        if family is not None:
            families.append((one, family))
    if not families:
        return best, rivals, None
    taken, family = min(families, key=lambda each: float(each[1].losses.mean()))
    after = {one.candidate: one.losses for one in (best, *rivals)}
    after |= {one.candidate: other.losses for one, other in families}
    left = tuple(
        one
        for one in (best, *rivals)
        if one is not taken
        and compare(after[one.candidate], family.losses, found.rng).surely <= 0.0
    )
    return (best, rivals, None) if left else (taken, (), family)


def _join(found: Search, family: Family) -> None:
    """Take what was found at other joints."""
    for candidate, gain in family.gains.items():
        screened = found.screened[candidate.label]
        found.accepted.append(Tried(screened, family.fit, gain, family.losses, is_relative=True))
        found.tried[candidate.label] = found.accepted[-1]
        found.rivals.append(())
    found.current, found.current_losses = family.fit, family.losses


def _explains_event(found: Search, candidate: Candidate, fit: Fit, train: tuple[int, ...]) -> bool:
    """Return whether a cause that is in one recording takes away what stands out there.

    Held-out recordings cannot show what happened once in another one. What stands out must be far
    over everything else, more than noise that is the same throughout would ever be.
    """
    if candidate.effect.name != _ONCE:
        return False
    problem = found.problem
    before = stretches(problem, found.current.space.variant(found.current.z), train)
    after = stretches(problem, fit.space.variant(fit.z), train)
    worst = int(np.argmax(before - after))
    usual = max(float(np.median(before)), 1.0)
    return bool(
        before[worst] > _STANDS_OUT * usual
        and after[worst] < _TAKEN_AWAY * before[worst]
        and after.max() < max(_TAKEN_AWAY * before.max(), _STANDS_OUT * usual)
    )


def _simplest(useful: list[Tried], rng: np.random.Generator) -> tuple[Tried, tuple[Tried, ...]]:
    """Return the cause to take, and those that are not told from it.

    Of what does as well as the best one, the simplest is taken; what needs more numbers to do no
    better is no rival.
    """
    best = min(useful, key=lambda one: one.gain.loss)
    alike = [one for one in useful if one is best or _is_alike(best, one, rng)]
    fewest = min(one.numbers for one in alike)
    simple = [one for one in alike if one.numbers == fewest]
    taken = min(simple, key=lambda one: one.gain.loss)
    return taken, tuple(one for one in simple if one is not taken)


def _is_alike(best: Tried, other: Tried, rng: np.random.Generator) -> bool:
    """Return whether the held-out recordings do not prefer the best surely."""
    margin = compare(other.losses, best.losses, rng)
    return margin.gain < max(margin.error, ALIKE * best.gain.gain)


def _adds(
    found: Search, best: Tried, other: Tried, train: tuple[int, ...], test: tuple[int, ...]
) -> bool:
    """Return whether a rival is a cause beside the best: together they do surely better.

    Two joints of one chain that both rub: friction of either imitates most of the other's.
    """
    space = best.fit.space.grown(other.candidate)
    size = other.numbers
    starts = [np.r_[best.fit.z, share * other.fit.z[-size:]] for share in (0.5, 0.1)]
    fits = [settle(space, space.clip(start), train) for start in starts]
    fit = min(fits, key=lambda one: one.cost)
    losses = stretches(found.problem, space.variant(fit.z), test)
    return compare(best.losses, losses, found.rng).is_useful(float(found.base_losses.mean()))


def _diverse(screened: Sequence[Screened]) -> list[Screened]:
    """Return the best few, not all of one effect."""
    counts: dict[str, int] = {}
    out: list[Screened] = []
    for each in screened:
        name = each.candidate.effect.name
        counts[name] = counts.get(name, 0) + 1
        is_slight = each.share < max(_SLIGHT, _SLIGHT_BESIDE * screened[0].share)
        if counts[name] <= _PER_EFFECT and not is_slight:
            out.append(each)
        if len(out) == _TRIED:
            break
    return out


def _prune(found: Search, train: tuple[int, ...], test: tuple[int, ...]) -> None:
    """Take back causes without which the rest does as well."""
    base = float(found.base_losses.mean())
    doubtful = [one for one in found.accepted[:-1] if not one.is_event and not one.is_relative]
    for each in doubtful:
        kept = [other for other in found.accepted if other is not each]
        space = Space(found.problem, tuple(other.candidate for other in kept))
        full = found.current.space
        z = np.delete(found.current.z, full.where(each.candidate))
        fit = polish(space, z, train, 2)
        losses = stretches(found.problem, space.variant(fit.z), test)
        without = _Model(fit, losses)
        if not _judged(found, each.candidate, without, _before(found)).is_useful(base):
            index = found.accepted.index(each)
            del found.accepted[index], found.rivals[index]
            found.current, found.current_losses = fit, losses
