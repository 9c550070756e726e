"""Names what came from outside in a recording that was fitted to.

A push that is too small, or too short, to stand out of half a second of all channels may be plain
by the torque that was missing (``pushes.py``): its joint and about when are known from there.
"""

from collections.abc import Sequence

import numpy as np

from shared.identification.effect import IN_RECORDING, ONCE, Candidate
from shared.identification.fitting.fit import Fit, polish
from shared.identification.fitting.refit import settle
from shared.identification.gate.held_out import plain_stretches, stretches
from shared.identification.leftover.phases import AGAIN
from shared.identification.leftover.phases import ONCE as ONE_TIME
from shared.identification.search.bent import is_worse
from shared.identification.search.events import is_one
from shared.identification.search.fewer import take_back, without
from shared.identification.search.judging import judged
from shared.identification.search.searched import TAKEN_AWAY, Model, Search, Tried, so_far
from shared.identification.search.windows import within
from shared.identification.verdict import Unexplained

_PLAINLY = 50.0
"""Twice what it takes off the cost, at least: what is random never does in one window of all."""


def take_pushes(found: Search, left: Sequence[Unexplained]) -> bool:
    """Take what pushed once, and say whether there was anything to take.

    Args:
        found: the search, over; nothing of which it lacks a law may be left.
        left: what its model does not explain.
    """
    train = found.problem.of("train")
    before = len(found.accepted)
    for each in left:
        candidate = _candidate(found, each)
        if candidate is None:
            continue
        screened = within(found.current, candidate, each.begin, each.end, train)
        if not screened.share:
            continue
        space = found.current.space.grown(candidate)
        start = np.r_[found.current.z + screened.shift, screened.start]
        fit = settle(space, start, train, found.current)
        fit = polish(space, fit.z, train, 4, enough=1e-4)
        losses = stretches(found.problem, fit.variant, found.problem.of("test"))
        if not _is_it(found.current, fit, candidate, train):
            continue
        if is_worse(losses, found.current_losses):
            continue
        gain, fitted, _ = judged(found, candidate, so_far(found), Model(fit, losses))
        one = Tried(screened, fit, gain, losses, is_event=True, fitted=fitted)
        found.screened[candidate.label] = screened
        found.tried[candidate.label] = one
        found.accepted.append(one)
        found.rivals.append(())
        found.current, found.current_losses = fit, losses
    return len(found.accepted) > before


def take_back_pushes(found: Search, left: Sequence[Unexplained]) -> bool:
    """Take back what pushed a joint once if it was pushed at other times, too; return if any was.

    A law that the model lacks looks like pushes where it is most: a drive at its limit, swing by
    swing.
    """
    train, test = found.problem.of("train"), found.problem.of("test")
    pushed = {each.where for each in left if each.is_external or each.phase == AGAIN}
    again = [one for one in found.accepted if one.is_event and one.candidate.where in pushed]
    for one in again:
        take_back(found, one, without(found, one, train, test))
    return bool(again)


def is_named(found: Search, push: Unexplained) -> bool:
    """Return whether a push is among the causes, as what was in that recording at that joint."""
    return any(one.is_event and one.candidate.place == _place(push) for one in found.accepted)


def _place(push: Unexplained) -> str:
    return f"{push.where}{IN_RECORDING}{push.trajectory}"


def _candidate(found: Search, each: Unexplained) -> Candidate | None:
    """Return what a push would be, if it may be taken; of one joint in a recording, the first."""
    wanted = [
        one for one in found.candidates if one.effect.name == ONCE and one.place == _place(each)
    ]
    problem = found.problem
    of_train = {
        problem.dataset.trajectories[problem.segments[index].trajectory].name
        for index in problem.of("train")
    }
    taken = {one.candidate for one in found.accepted}
    is_one = each.is_external and each.phase == ONE_TIME and each.trajectory in of_train
    return wanted[0] if is_one and wanted and wanted[0] not in taken else None


def _is_it(before: Fit, fit: Fit, candidate: Candidate, train: tuple[int, ...]) -> bool:
    """Return whether a push is surely there, and explains what was off while it lasted."""
    is_plain = 2.0 * (before.cost - fit.cost) >= _PLAINLY
    if not is_plain or not is_one(candidate, fit, train):
        return False
    problem = fit.space.problem
    off = plain_stretches(problem, before.variant, train)
    after = plain_stretches(problem, fit.variant, train)
    worst, usual = int(np.argmax(off - after)), float(np.median(after))
    return bool(after[worst] - usual < TAKEN_AWAY * (off[worst] - usual))
