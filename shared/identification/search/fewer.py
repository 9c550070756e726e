"""Takes back causes that others make superfluous, and says anew what is not told from them."""

from dataclasses import replace

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import Fit, polish
from shared.identification.fitting.space import Space
from shared.identification.gate.certainty import is_there
from shared.identification.gate.held_out import compare, stretches
from shared.identification.search.judging import judged
from shared.identification.search.searched import ALIKE, Model, Search, Tried, so_far


def prune(found: Search, train: tuple[int, ...], test: tuple[int, ...]) -> None:
    """Take back causes that may as well be nothing, and those without which the rest does as well.

    Held-out recordings say of what use a cause is; where others can make up for it, any size is.
    Whether there is any of it, those that were fitted to say, or else all together. A drive's limit
    that one swing reaches is too seldom seen to follow surely, but nothing else makes up for it.
    """
    base = float(found.base_losses.mean())
    for each in doubtful(found.accepted)[::-1]:
        is_told = not found.rivals[found.accepted.index(each)]
        if is_told and not _is_there(found.current, each.candidate, train, test):
            take_back(found, each, without(found, each, train, test))
    for each in doubtful(found.accepted[:-1]):
        others = without(found, each, train, test)
        if compare(others.losses, found.current_losses, found.rng).is_sure:
            continue  # the rest does much worse without it
        if not judged(found, each.candidate, others, so_far(found)).gain.is_useful(base):
            take_back(found, each, others)


def _is_there(
    fit: Fit, candidate: Candidate, train: tuple[int, ...], test: tuple[int, ...]
) -> bool:
    if is_there(fit, candidate, train):
        return True
    everything = (*train, *test)
    return is_there(polish(fit.space, fit.z, everything, 2), candidate, everything)


def doubtful(accepted: list[Tried]) -> list[Tried]:
    """Return what was accepted for itself, and not as something that happened once."""
    return [one for one in accepted if not one.is_event and not one.is_relative]


def without(found: Search, each: Tried, train: tuple[int, ...], test: tuple[int, ...]) -> Model:
    """Return everything that was accepted but one."""
    kept, z = _apart_from(found, {each.candidate})
    space = Space(found.problem, kept)
    fit = polish(space, z, train, 2)
    return Model(fit, stretches(found.problem, space.variant(fit.z), test))


def take_back(found: Search, each: Tried, others: Model) -> None:
    """Take back a cause.

    Args:
        found: the search.
        each: one that was accepted.
        others: fitted without it.
    """
    index = found.accepted.index(each)
    del found.accepted[index], found.rivals[index]
    found.current, found.current_losses = others
    if not found.accepted:
        found.current, found.current_losses = found.base, found.base_losses


def tell_apart(found: Search, train: tuple[int, ...], test: tuple[int, ...]) -> None:
    """Ask of what was not told from a cause once more, beside all that was found after it.

    Where most of what is wrong is still to be found, many a cause stands for some of it.
    """
    for index, taken in enumerate(found.accepted[:-1]):
        others: list[Tried] = []
        for each in found.rivals[index]:
            fit = _instead(found, {taken.candidate}, each, train)
            others.append(
                replace(each, fit=fit, losses=stretches(found.problem, fit.variant, test))
            )
        if not others:
            continue
        now = replace(taken, fit=found.current, losses=found.current_losses)
        best = min((now, *others), key=lambda one: one.losses.mean())
        if best is not now and compare(now.losses, best.losses, found.rng).surely > 0.0:
            found.accepted[index] = best
            found.current, found.current_losses = best.fit, best.losses
        else:
            best = now
        found.rivals[index] = tuple(
            one for one in (now, *others) if one is not best and _is_alike(found, best, one)
        )


def _is_alike(found: Search, best: Tried, other: Tried) -> bool:
    """Return whether held-out recordings do not prefer one of two surely, all else found."""
    margin = compare(other.losses, best.losses, found.rng)
    whole = compare(found.base_losses, best.losses, found.rng)
    return margin.gain < max(margin.error, ALIKE * whole.gain)


def one_for_many(found: Search, train: tuple[int, ...], test: tuple[int, ...]) -> None:
    """Take one cause for several of one effect, where it does as well with no more numbers.

    A counterbalance that is out of adjustment looks like a constant torque at one joint, and what
    is left of it like one at the next.
    """
    for name in {one.candidate.effect.name: None for one in found.accepted}:
        many = [one for one in found.accepted if one.candidate.effect.name == name]
        if len(many) < 2 or any(one.is_event for one in many):
            continue
        kept = [one for one in found.accepted if one.candidate.effect.name != name]
        taken = {one.candidate for one in found.accepted}
        numbers = sum(one.numbers for one in many)
        for other in found.tried.values():
            is_other = other.candidate.effect.name != name and other.candidate not in taken
            is_fewer = is_other and other.numbers <= numbers
            if not is_fewer or other.is_event or not other.gain.is_sure:
                continue
            fit = _instead(found, {one.candidate for one in many}, other, train)
            losses = stretches(found.problem, fit.variant, test)
            margin = compare(losses, found.current_losses, found.rng)
            whole = compare(found.base_losses, losses, found.rng)
            is_alike = margin.gain < max(margin.error, ALIKE * whole.gain)
            if is_alike and is_there(fit, other.candidate, train):
                found.accepted = [*kept, replace(other, fit=fit, losses=losses)]
                found.rivals = [() for _ in found.accepted]
                found.current, found.current_losses = fit, losses
                return


def _instead(
    found: Search, gone: set[Candidate], other: Tried, train: tuple[int, ...]
) -> Fit:  # fmt: skip
    """Return a fit of what was accepted, with another cause in place of some."""
    kept, z = _apart_from(found, gone)
    space = Space(found.problem, (*kept, other.candidate))
    start = np.r_[z, other.fit.z[-other.numbers :]]
    return polish(space, space.clip(start), train, 4)


def _apart_from(found: Search, gone: set[Candidate]) -> tuple[tuple[Candidate, ...], Float64]:
    """Return what was accepted but some, and where the fit has the rest: float64[n]."""
    full = found.current.space
    indices = np.concatenate([np.arange(full.size)[full.where(each)] for each in gone])
    kept = tuple(each for each in full.candidates if each not in gone)
    return kept, np.delete(found.current.z, indices)
