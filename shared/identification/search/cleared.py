"""Asks whether links that were held are as the file says, once causes are named.

A base that lacks a cause bends links to make up for it. What went further than is believable is
held as the file has it, and more has to be explained beside it, as it may be that no model of that
kind is the arm's. With the causes there links are let go again: where none goes far now, they were
all that was wrong, and nothing speaks against the base any more. Nor are they known to the last
digit then: a payload beside links that are held is told far too surely.
"""

from dataclasses import replace

import numpy as np

from shared.identification.fitting.fit import polish, widened
from shared.identification.fitting.parameters import base_parameters
from shared.identification.fitting.space import Space
from shared.identification.gate.certainty import half_widths
from shared.identification.gate.held_out import stretches
from shared.identification.progress import Progress
from shared.identification.search.begin import doubted_of
from shared.identification.search.bent import is_worse
from shared.identification.search.fewer import take_back, without
from shared.identification.search.searched import Search, Tried, is_open

_STEPS = 6
"""Derivatives of the fit: a doubted link is an alternative to its cause, and the way is short."""
_ENOUGH = 1e-5
"""Of it: along the valley where they are alternatives, only what is known of links has a say."""


def clear(found: Search, progress: Progress) -> None:
    """Doubt a base no more whose links stay where they are known once they are let go.

    Args:
        found: a search, over; causes are told beside its links then, where those leave no more.
        progress: is told how far it is.
    """
    if not found.accepted or not found.doubted or is_open(replace(found, doubted=())):
        return
    progress("refit", 1.0, f"with {', '.join(found.doubted)}")
    let_go = [each for each in base_parameters(found.problem.subject) if each.name in found.doubted]
    problem, known = found.problem.freer(let_go), len(found.problem.parameters)
    nothing, train = np.zeros(len(let_go)), problem.of("train")
    space = Space(problem, found.current.space.candidates)
    z = found.current.z
    fit = polish(space, np.concatenate([z[:known], nothing, z[known:]]), train, _STEPS, _ENOUGH)
    if doubted_of(fit):
        return
    found.doubted = ()
    losses = stretches(problem, fit.variant, problem.of("test"))
    if is_worse(losses, found.current_losses):
        return
    base = found.base
    alone, free = Space(problem), np.r_[base.z, nothing]
    jacobian = widened(alone, free, base.jacobian, train, known)
    found.base = replace(
        base, space=alone, z=free, jacobian=jacobian, residual=np.r_[base.residual, nothing]
    )
    found.problem, found.current, found.current_losses = problem, fit, losses
    _take_back_nothings(found)


def _take_back_nothings(found: Search) -> None:
    """Take back what the links that were let go make up for, as another mass of one of them.

    Its size may as well be 0 then, and held-out motion is no worse without. One cause is left: the
    base was not fitted with those links.
    """
    train, test = found.problem.of("train"), found.problem.of("test")
    for each in found.accepted[::-1]:
        is_told = not found.rivals[found.accepted.index(each)]
        if len(found.accepted) == 1 or not is_told or not _may_be_nothing(found, each, train):
            continue
        others = without(found, each, train, test)
        if not is_worse(others.losses, found.current_losses):
            take_back(found, each, others)


def _may_be_nothing(found: Search, each: Tried, train: tuple[int, ...]) -> bool:
    own = found.current.space.where(each.candidate)
    widths = half_widths(found.current, train)
    return bool(np.all(np.abs(found.current.z[own]) < widths[own]))
