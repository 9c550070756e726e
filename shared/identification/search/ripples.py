"""Looks for ripples of a torque in what a fit leaves: along its travel the joint is off by them.

The torque that a motion takes (``arm/ripples.py``) is known no better than the servos' gains, of
which a base fit knows most: a ripple that is lost in it stands out of the residual. Nothing is
simulated for that.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from shared.identification.arm.places import place_of
from shared.identification.arm.projection import basis_of, without
from shared.identification.arm.ripples import RANK, lines, whitening
from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import Fit
from shared.identification.fitting.problem import BLOCK, Problem
from shared.identification.gate.clusters import parts_of

RIPPLES = "cogging"
"""The effect whose number of ripples is looked for."""
_CLEAR = 24.0
"""Power of a line, in mean squares of what is left: of noise the strongest of all has 16."""
_TURNS = 0.3
"""Of its usual speed: below it a joint is about to turn, and lags neither way."""


def ripples_left(
    fit: Fit, candidates: Sequence[Candidate], segments: tuple[int, ...]
) -> dict[Candidate, tuple[float, ...]]:
    """Return how many ripples a turn (a metre) stand out at the joints where they do.

    Args:
        fit: what is there so far, on the segments.
        candidates: what is looked for; all but ripples is passed over.
        segments: recordings, or parts of them.
    """
    wanted = [each for each in candidates if each.effect.name == RIPPLES]
    if not wanted:
        return {}
    problem = fit.space.problem
    subject = problem.subject
    q, qd, is_first = _motion(problem, segments)
    found: dict[Candidate, tuple[float, ...]] = {}
    for each in wanted:
        joint = subject.joints.index(each.place)
        own = [rows[:, joint] for _, rows in parts_of(problem, segments)]
        rows = np.concatenate(own)
        travel, speed = float(np.ptp(q[:, joint])), float(np.std(qd[:, joint]))
        if travel <= 0.0 or speed <= 0.0:
            continue
        off = (q[:, joint] - q[:, joint].mean()) / travel
        slow = (np.ones_like(off), off, off**2, off**3, np.tanh(qd[:, joint] / (0.1 * speed)))
        rest = np.concatenate([fit.jacobian[rows], np.stack([*slow, qd[:, joint]], axis=1)], axis=1)
        residual = fit.residual[rows]
        left = without(basis_of(rest, RANK), residual[:, None])[:, 0]
        way = np.tanh(qd[:, joint] / (_TURNS * speed))  # it comes late, whichever way it goes
        counts = lines(rest, residual, off, whitening(left, is_first), (), _CLEAR, (way,))
        if counts:
            turn = 1.0 if place_of(subject, each.place).is_sliding else 2.0 * math.pi
            found[each] = tuple(turn * count / travel for count in counts)
    return found


def _motion(
    problem: Problem, segments: tuple[int, ...]
) -> tuple[Float64, Float64, NDArray[np.bool_]]:
    """Return float64[B, J] of all blocks: where joints were and how fast; and which begin a part.

    Args:
        problem: the data set.
        segments: parts of it.
    """
    q = [problem.positions(segment) for segment in segments]
    qd = [np.gradient(at, BLOCK, axis=0) if len(at) > 1 else np.zeros_like(at) for at in q]
    is_first = [np.arange(len(at)) == 0 for at in q]
    return np.concatenate(q), np.concatenate(qd), np.concatenate(is_first)
