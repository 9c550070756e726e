"""What the hidden effect explains, if it is known what and where it is.

What a finder can be asked for: a base fit may make up for an effect that is large by itself.
"""

from typing import Final

import numpy as np

from shared.identification.catalogue import effects
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import polish
from shared.identification.fitting.refit import settle
from shared.identification.gate.held_out import plain_stretches
from shared.identification.hidden.choosing import EVENTS
from shared.identification.hidden.truth import HiddenEffect
from shared.identification.search.searched import Search

STEPS: Final = 8
"""Derivatives of the last fit, at the most."""


def explainable(found: Search, hidden: HiddenEffect) -> float:
    """Return the share of what the base fit leaves that the hidden effect takes off.

    Of held-out motion; of what was fitted to, for what happens in one recording only. The effect is
    fitted together with the base, from its true size, in its true place.

    Args:
        found: a search with its base fitted.
        hidden: what is in the recordings.
    """
    effect = next(each for each in effects() if each.name == hidden.name)
    problem, base = found.problem, found.base
    space = base.space.grown(Candidate(effect, hidden.where))
    size = {each.name: each.value for each in hidden.quantities}
    quantities = effect.quantities(problem.subject, hidden.where)
    start = [size.get(each.name, 0.0) / each.probe for each in quantities]
    train = problem.of("train")
    settled = settle(space, space.clip(np.r_[base.z, start]), train, base)
    fit = polish(space, settled.z, train, STEPS)
    seen = train if hidden.name in EVENTS else problem.of("test")
    before, after = (
        float(plain_stretches(problem, each.variant, seen).mean()) for each in (base, fit)
    )
    return (before - after) / before
