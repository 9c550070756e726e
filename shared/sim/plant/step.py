"""What an arm does at one step of a batch, as laws of torque and friction get it to look at."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shared.sim.arm import Float64

Rows = slice | np.ndarray
"""Some of a batch's rows or columns; a slice where they follow each other, which numpy views."""


def rows_of(indices: np.ndarray | Sequence[int]) -> Rows:
    """Return indices as a slice, if they follow each other."""
    found = np.asarray(indices, np.int64)
    if len(found) and bool(np.all(np.diff(found) == 1)):
        return slice(int(found[0]), int(found[-1]) + 1)
    return found


@dataclass
class Moment:
    """All arms of a batch, N of them, at the begin of a step; views, not to be kept."""

    time: float
    """(s)."""
    timestep: float
    """(s)."""
    q: Float64
    """float64[N, J], logged joints as they are (rad, m)."""
    qd: Float64
    """float64[N, J] (rad/s, m/s)."""
    qd_before: Float64
    """float64[N, J], of the step before."""
    drive: Float64
    """float64[N, J], what the actuators put on the joints in the last step (N m, N)."""
    drive_change: Float64
    """float64[N, J], by how much servos that see the tool put more than in the step before."""
    gravity: Float64
    """float64[N, J], gravity, centrifugal and Coriolis torque that the drive has to hold."""
    rotors: Float64
    """float64[N, J], armature (kg m^2, kg)."""


class Step:
    """What a law may look at of its K arms; what it does not look at costs nothing."""

    def __init__(self, moment: Moment, rows: Rows) -> None:
        """Look at some arms.

        Args:
            moment: of all arms.
            rows: K of them.
        """
        self._moment = moment
        self._rows = rows

    @property
    def time(self) -> float:
        """Return when that is (s)."""
        return self._moment.time

    @property
    def timestep(self) -> float:
        """Return how long a step is (s)."""
        return self._moment.timestep

    @property
    def q(self) -> Float64:
        """Return float64[K, J], logged joints as they are (rad, m)."""
        return self._moment.q[self._rows]

    @property
    def qd(self) -> Float64:
        """Return float64[K, J] (rad/s, m/s)."""
        return self._moment.qd[self._rows]

    @property
    def drive(self) -> Float64:
        """Return float64[K, J], what actuators put on the joints in the last step (N m, N)."""
        return self._moment.drive[self._rows]

    @property
    def drive_change(self) -> Float64:
        """Return float64[K, J], by how much that rose from the step before (N m, N)."""
        return self._moment.drive_change[self._rows]

    @property
    def gravity(self) -> Float64:
        """Return float64[K, J], gravity, centrifugal and Coriolis torque (N m, N)."""
        return self._moment.gravity[self._rows]

    @property
    def load(self) -> Float64:
        """Return float64[K, J], what gears transmit (N m, N).

        It is the drive less what turned the rotors (armature) in the last step.
        """
        moment, rows = self._moment, self._rows
        faster = moment.qd[rows] - moment.qd_before[rows]
        return self.drive - moment.rotors[rows] * faster / moment.timestep
