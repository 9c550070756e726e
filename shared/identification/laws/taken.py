"""What the motion that a robot logged took of its drives, by the model."""

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from shared.identification.arm.motion import Motion, smooth_motion
from shared.identification.dataset.types import Float64
from shared.sim.plant.inverse import inverse_dynamics
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal

_FEWEST = 20
"""Readings that a motion can be told from."""
_SLOW = 0.02
"""Speed from which a joint rubs by all of its friction (rad/s)."""


@dataclass(frozen=True)
class Taken:
    """A logged motion, its instants by the time of one part: 0 is where that begins."""

    motion: Motion
    nominal: Float64
    """float64[T, J], what that takes of the nominal arm (N m, N)."""

    def of(self, row: Row, joint: int) -> Float64:
        """Return float64[T]: what it takes of an arm's own joint (N m, N).

        Args:
            row: the arm.
            joint: index of the logged joint.
        """
        dof = row.dofs[joint]
        more = [
            float(row.current(name)[dof]) - float(getattr(row.model, name)[dof])
            for name in ("dof_armature", "dof_damping", "dof_frictionloss")
        ]
        speed = self.motion.qd[:, joint]
        return (
            self.nominal[:, joint] + more[0] * self.motion.qdd[:, joint] + more[1] * speed
            + more[2] * np.tanh(speed / _SLOW)
        )  # fmt: skip


_known: WeakKeyDictionary[Signal, Taken | None] = WeakKeyDictionary()


def taken(row: Row) -> Taken | None:
    """Return what an arm's logged motion took, None if that is too short to tell.

    It is worked out once a log.
    """
    log = row.logged_q
    if log not in _known:
        found = None
        if len(log.at) >= _FEWEST:
            motion = smooth_motion(log.at, log.values)
            needed = inverse_dynamics(row.plant, row.model, motion.q, motion.qd, motion.qdd)
            found = Taken(motion, needed)
        _known[log] = found
    return _known[log]
