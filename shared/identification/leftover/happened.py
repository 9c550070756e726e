"""What recordings say of a moment: that it was set aside, or came back when they were repeated."""

import numpy as np
from numpy.typing import NDArray

from shared.identification.dataset.types import Float64
from shared.identification.fitting.problem import Problem
from shared.identification.leftover.tracks import Track
from shared.sim.plant.signals import sampled

_BACK = 0.3
"""After a push, in which a joint is off by it, too (s)."""
_ALIKE = 0.5
"""Of what a joint is off by, that it differs by from its repeat, if that is off by it, too."""


def comes_back(problem: Problem, track: Track, joint: int, piece: slice) -> bool:
    """Return whether a joint is off by the same when its recording was repeated: no push is.

    Args:
        problem: has the recordings.
        track: of the recording.
        joint: which.
        piece: blocks in which something pushed, as it looks.
    """
    of = problem.dataset.trajectories[track.trajectory]
    begin, last = float(track.at[piece.start]), float(track.at[piece.stop - 1]) + _BACK
    shown = (begin <= track.at) & (track.at <= last)
    off = track.x[shown, joint] * problem.noise.joints[joint]
    size = float(np.linalg.norm(off)) / max(len(off), 1) ** 0.5
    own = slice(joint, joint + 1)
    at = of.joints_at[(begin <= of.joints_at) & (of.joints_at <= last)]
    for other in problem.dataset.trajectories:
        if other.repeats != of.name or not len(at) or at[-1] > other.joints_at[-1]:
            continue
        first, again = (sampled(each.joints_at, each.q[:, own], at) for each in (of, other))
        apart: Float64 = first - again
        if float(np.linalg.norm(apart)) / len(apart) ** 0.5 < _ALIKE * size:
            return True
    return False


def is_aside(problem: Problem, track: Track) -> NDArray[np.bool_]:
    """Return bool[B], which blocks nothing was fitted to, since something happened there."""
    name = problem.dataset.trajectories[track.trajectory].name
    spans = [each for each in problem.aside if each.trajectory == name]
    out = np.zeros(len(track.at), np.bool_)
    for each in spans:
        out |= (each.begin <= track.at) & (track.at < each.end)
    return out
