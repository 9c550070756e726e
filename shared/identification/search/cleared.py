"""Asks whether links that were held are as the file says, once causes are named.

A base that lacks a cause bends links to make up for it. What went further than is believable is
held as the file has it, and more has to be explained beside it, as it may be that no model of that
kind is the arm's. With the causes there links are let go again: where none goes far now, they were
all that was wrong, and nothing speaks against the base any more.
"""

from dataclasses import replace

import numpy as np

from shared.identification.fitting.fit import polish
from shared.identification.fitting.parameters import base_parameters
from shared.identification.fitting.space import Space
from shared.identification.progress import Progress
from shared.identification.search.begin import doubted_of
from shared.identification.search.searched import Search, is_open

_STEPS = 6
"""Derivatives of the fit: a doubted link is an alternative to its cause, and the way is short."""


def clear(found: Search, progress: Progress) -> None:
    """Doubt a base no more whose links stay where they are known once they are let go.

    Args:
        found: a search, over; only what is open because of its doubts is asked.
        progress: is told how far it is.
    """
    if not found.accepted or not found.doubted or not is_open(found):
        return
    if is_open(replace(found, doubted=())):
        return
    progress("refit", 1.0, f"with {', '.join(found.doubted)}")
    known = found.problem.parameters
    let_go = [each for each in base_parameters(found.problem.subject) if each.name in found.doubted]
    problem = replace(found.problem, parameters=(*known, *let_go))
    space = Space(problem, found.current.space.candidates)
    z, count = found.current.z, len(known)
    start = np.concatenate([z[:count], np.zeros(len(let_go)), z[count:]])
    fit = polish(space, start, problem.of("train"), _STEPS)
    if not doubted_of(fit):
        found.doubted = ()
