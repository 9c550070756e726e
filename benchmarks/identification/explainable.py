"""What the hidden effect explains, if it is known what and where it is.

What a finder can be asked for: a base fit may make up for an effect that is large by itself.
"""

from pathlib import Path
from typing import Final

import numpy as np

from shared.identification.catalogue import effects
from shared.identification.dataset.types import Dataset
from shared.identification.effect import ONCE, Candidate
from shared.identification.fitting.fit import polish
from shared.identification.fitting.refit import settle
from shared.identification.fitting.saved import load
from shared.identification.gate.held_out import plain_stretches
from shared.identification.hidden.truth import HiddenEffect
from shared.identification.progress import silent
from shared.identification.search.begin import begin

STEPS: Final = 8
"""Derivatives of the last fit, at the most."""
EVENTS: Final = (ONCE, "tracker_slip")
"""Seen in one recording, which is one of those that are fitted to."""


def explainable(dataset: Dataset, hidden: HiddenEffect, seed: int, steps: Path) -> float:
    """Return the share of what the base fit leaves that the hidden effect takes off.

    Of held-out motion; of what was fitted to, for what happens in one recording only. The effect is
    fitted together with the base, from its true size, in its true place.

    Args:
        dataset: the recordings.
        hidden: what is in them.
        seed: of everything random.
        steps: where the finder kept its base fit.

    Raises:
        IdentificationError: the model does not fit the recordings.
    """
    effect = next(each for each in effects() if each.name == hidden.name)
    found = begin(
        dataset, seed=seed, progress=silent, without=frozenset(), catalogue=effects(),
        fits=load(steps, dataset, seed),
    )  # fmt: skip
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
