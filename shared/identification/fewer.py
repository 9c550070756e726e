"""Takes back causes that others make superfluous."""

from dataclasses import replace

import numpy as np

from shared.identification.effect import Candidate
from shared.identification.fit import Fit, polish
from shared.identification.gate import compare, stretches
from shared.identification.searched import ALIKE, Model, Search, Tried, judged, so_far
from shared.identification.space import Space


def prune(found: Search, train: tuple[int, ...], test: tuple[int, ...]) -> None:
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
        without = Model(fit, losses)
        if not judged(found, each.candidate, without, so_far(found)).is_useful(base):
            index = found.accepted.index(each)
            del found.accepted[index], found.rivals[index]
            found.current, found.current_losses = fit, losses


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
        numbers = sum(one.numbers for one in many)
        for other in found.tried.values():
            is_fewer = other.candidate.effect.name != name and other.numbers <= numbers
            if not is_fewer or other.is_event or not other.gain.is_sure:
                continue
            fit = _instead(found, {one.candidate for one in kept}, other, train)
            losses = stretches(found.problem, fit.space.variant(fit.z), test)
            margin = compare(losses, found.current_losses, found.rng)
            whole = compare(found.base_losses, losses, found.rng)
            if margin.gain < max(margin.error, ALIKE * whole.gain):
                found.accepted = [*kept, replace(other, fit=fit, losses=losses)]
                found.rivals = [() for _ in found.accepted]
                found.current, found.current_losses = fit, losses
                return


def _instead(
    found: Search, kept: set[Candidate], other: Tried, train: tuple[int, ...]
) -> Fit:  # fmt: skip
    """Return a fit of some of what was accepted, and of another cause in place of the rest."""
    full = found.current.space
    gone = [each for each in full.candidates if each not in kept]
    indices = np.concatenate([np.arange(full.size)[full.where(each)] for each in gone])
    rest = tuple(each for each in full.candidates if each in kept)
    space = Space(found.problem, (*rest, other.candidate))
    start = np.r_[np.delete(found.current.z, indices), other.fit.z[-other.numbers :]]
    return polish(space, space.clip(start), train, 4)
