"""Times at which nothing came from the robot, and the commands that were given in them."""

import numpy as np
from numpy.typing import NDArray

from shared.identification.dataset.caveats import GAP_PERIODS
from shared.identification.dataset.types import Float64
from shared.sim.plant.signals import Signal


def lost_at(command_at: Float64, joints_at: Float64) -> NDArray[np.bool_]:
    """Return bool[C]: whether a command was given in a gap of the joints' log, its ends excluded.

    Args:
        command_at: float64[C] (s).
        joints_at: float64[T] (s).
    """
    steps = np.diff(joints_at)
    if not len(steps):
        return np.zeros(len(command_at), np.bool_)
    is_gap = steps > GAP_PERIODS * float(np.median(steps))
    before = np.searchsorted(joints_at, command_at, side="left") - 1
    is_between = before + 1 == np.searchsorted(joints_at, command_at, side="right")
    within = is_between & (before >= 0) & (before < len(steps))
    return within & is_gap[np.clip(before, 0, len(steps) - 1)]


def without(command: Signal, joints_at: Float64, share: float) -> Signal:
    """Return what is left of commands of which a share is lost in each gap.

    Which ones are lost nobody knows, so each of them leads only the rest of the way from the last
    one before the gap: 0 is as it was, 1 is held over the gap.

    Args:
        command: what was given.
        joints_at: float64[T] (s).
        share: lost.
    """
    lost = lost_at(command.at, joints_at)
    lost[0] = False
    # of each command, the last one that arrived
    kept = np.maximum.accumulate(np.where(lost, 0, np.arange(len(lost))))
    held = command.values[kept]
    out = command.values + share * (held - command.values)
    if out.shape[1] == 7 and lost.any():  # a pose: its quaternion by the short way, of length 1
        near = np.einsum("ij,ij->i", held[:, 3:], command.values[:, 3:])[:, None]
        target = np.where(near < 0.0, -held[:, 3:], held[:, 3:])
        out[:, 3:] = command.values[:, 3:] + share * (target - command.values[:, 3:])
        out[:, 3:] /= np.linalg.norm(out[:, 3:], axis=1, keepdims=True)
    return Signal(command.at, out)
