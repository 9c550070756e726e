"""Searches for causes: fits, looks, tries, and judges each on what was held out."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from shared.identification.base import INERTIA_PRIOR, base_parameters
from shared.identification.dataset.types import Dataset, Float64
from shared.identification.effect import Candidate, Effect
from shared.identification.fit import (
    Fit,
    SavedFits,
    Start,
    fit_again,
    fit_base,
    fit_without,
    floor_from_base,
    polish,
)
from shared.identification.gate import Gain, compare, stretches
from shared.identification.noise import noise_of
from shared.identification.problem import BLOCK, Problem
from shared.identification.progress import Progress
from shared.identification.refit import Rough, refit, settle
from shared.identification.screen import Screened, candidates_of, screen
from shared.identification.space import Space
from shared.identification.subject import subject_of

MOST_CAUSES = 4
_TRIED = 6
"""Candidates that are refitted with the base's derivative kept."""
_FULL = 4
"""Of these, candidates that get a full fit."""
_PER_EFFECT = 3
"""Places of one effect among those tried."""
_SLIGHT = 0.03
"""Of the training residual: what explains less at first sight is not refitted."""
_SLIGHT_BESIDE = 0.1
"""The same, as a share of what the best one explains."""
_FAR = 2.0
"""Candidates whose rough refit costs so many times the best one's get no full fit."""
QUIET = 1.25
"""Mean square residual, in noise floors, below which no further cause is looked for."""
FAR_FROM_KNOWN = 3.0
"""Standard deviations from what is known of a link at which the base itself is doubted."""
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


def begin(
    dataset: Dataset,
    *,
    seed: int,
    progress: Progress,
    without: frozenset[str],
    catalogue: Sequence[Effect],
    fits: SavedFits | None = None,
) -> Search:
    """Return a search with its base fitted.

    Args:
        dataset: the recordings.
        seed: of everything random.
        progress: is told how far it is.
        without: effects to leave out, by name.
        catalogue: what is looked for.
        fits: the base's fit, if it was found before.

    Raises:
        IdentificationError: the model does not fit the recordings.
    """
    rng = np.random.default_rng(seed)  # of the base fit, which may have been done before
    progress("noise floor", 0.0)
    subject = subject_of(dataset)
    noise = noise_of(dataset, BLOCK, subject.starts, subject.nominal)
    released = known = base_parameters(subject)
    if fits is not None and not {each.name for each in known} >= set(fits.names):
        fits = None
    problem = Problem(subject, dataset, known, noise)
    if not noise.is_measured:
        progress("noise floor", 0.5, "no repeats: from what the base leaves")
        noise = floor_from_base(Space(problem))
    if fits is not None:
        known = tuple(each for each in known if each.name in fits.names)
    problem = Problem(subject, dataset, known, noise)
    progress("base fit", 0.0, f"{len(known)} parameters" + ("" if fits is None else ", kept"))
    space = Space(problem)
    done = fit_base(space, rng) if fits is None else fit_again(space, fits)
    if fits is None and (doubted := _doubted(done.whole)):
        # What is known of a link does not hold, so the base may not bend it: what is wrong there
        # is looked for like any other cause.
        progress("base fit", 0.5, f"without {', '.join(known[index].name for index in doubted)}")
        kept = tuple(each for index, each in enumerate(known) if index not in doubted)
        problem = Problem(subject, dataset, kept, noise)
        space = Space(problem)
        done = fit_without(space, done, doubted)
    test = problem.of("test")
    nominal = stretches(problem, space.variant(np.zeros(space.size)), test)
    losses = stretches(problem, space.variant(done.whole.z), test)
    candidates, ruled_out = candidates_of(catalogue, subject, without)
    return Search(
        problem=problem,
        rng=np.random.default_rng([seed, 1]),
        candidates=candidates,
        ruled_out=ruled_out,
        doubted=tuple(each.name for each in released if each not in problem.parameters),
        base=done.whole,
        nominal=done.nominal,
        parts=done.parts,
        current=done.whole,
        nominal_losses=nominal,
        base_losses=losses,
        current_losses=losses,
    )


def _doubted(fit: Fit) -> list[int]:
    """Return which parameters a fit bends further than what is known of them allows."""
    return [
        index
        for index, (each, z) in enumerate(zip(fit.space.problem.parameters, fit.z, strict=True))
        if each.prior == INERTIA_PRIOR and abs(z) > FAR_FROM_KNOWN * INERTIA_PRIOR
    ]


def search(found: Search, progress: Progress) -> None:
    """Look for causes, one after another, until none passes or one is not told from others."""
    train, test = found.problem.of("train"), found.problem.of("test")
    for _ in range(MOST_CAUSES):
        is_floor = found.problem.noise.is_measured
        is_done = found.accepted and is_floor and found.current_losses.mean() < QUIET
        if is_done or not _round(found, train, test, progress):
            break
    if len(found.accepted) > 1:
        _prune(found, train, test)


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
        gain = compare(found.current_losses, losses, found.rng)
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
    gain = compare(found.current_losses, losses, found.rng)
    if gain.loss <= best.gain.loss and (best.is_event or gain.is_useful(base)):
        best = Tried(best.screened, fit, gain, losses, best.is_event)
    found.accepted.append(best)
    found.rivals.append(rivals)
    found.current, found.current_losses = best.fit, best.losses
    if rivals:
        return False
    if found.parts.space.problem is found.problem:
        found.parts = found.current
    else:
        space = Space(found.parts.space.problem, best.fit.space.candidates)
        found.parts = polish(space, best.fit.z, parts, 2)
    return True


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
    for each in [one for one in found.accepted[:-1] if not one.is_event]:
        kept = [other for other in found.accepted if other is not each]
        space = Space(found.problem, tuple(other.candidate for other in kept))
        full = found.current.space
        z = _without(full, found.current.z, each.candidate)
        fit = polish(space, z, train, 2)
        losses = stretches(found.problem, space.variant(fit.z), test)
        if not compare(losses, found.current_losses, found.rng).is_useful(base):
            index = found.accepted.index(each)
            del found.accepted[index], found.rivals[index]
            found.current, found.current_losses = fit, losses


def _without(space: Space, z: Float64, candidate: Candidate) -> Float64:
    """Return a vector without an effect's numbers."""
    begin = space.base_size
    keep = list(range(begin))
    for each in space.candidates:
        size = len(each.effect.quantities(space.problem.subject, each.place))
        if each != candidate:
            keep += range(begin, begin + size)
        begin += size
    return z[keep]
