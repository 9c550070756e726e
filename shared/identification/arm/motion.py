"""What a recording's joints do, smooth enough for speeds and accelerations."""

from dataclasses import dataclass

import numpy as np

from shared.identification.dataset.types import Float64, Trajectory
from shared.sim.plant.signals import sampled

_PERIOD = 0.01
"""Readings closer than this are thinned out (s)."""
_SMOOTH = 0.1
"""Readings that a speed is taken from, either side together (s)."""


@dataclass(frozen=True)
class Motion:
    """Positions, speeds and accelerations at even instants."""

    q: Float64
    """float64[T, J] (rad, m)."""
    qd: Float64
    """float64[T, J] (rad/s, m/s)."""
    qdd: Float64
    """float64[T, J] (rad/s^2, m/s^2)."""
    at: Float64
    """float64[T] (s)."""

    def sparse(self, every: int) -> "Motion":
        """Return one in so many of the instants."""
        return Motion(self.q[::every], self.qd[::every], self.qdd[::every], self.at[::every])


def motion_of(trajectory: Trajectory) -> Motion:
    """Return a recording's motion from local fits of a cubic (Savitzky and Golay 1964).

    A recording too short for one is taken to stand still.
    """
    return smooth_motion(trajectory.joints_at, trajectory.q)


def smooth_motion(
    at: Float64, readings: Float64, width: float = _SMOOTH, degree: int = 3
) -> Motion:
    """Return the motion of positions, as :func:`motion_of`.

    Args:
        at: float64[T], instants (s).
        readings: float64[T, J] (rad, m).
        width: of what a speed is taken from, either side together (s).
        degree: of the polynomials; 4 bends accelerations less than 3 and takes twice the width.
    """
    period = max(_PERIOD, float(np.median(np.diff(at))))
    even: Float64 = np.arange(float(at[0]), float(at[-1]), period, dtype=np.float64)
    half = max(round(width / period / 2.0), 2)
    if len(even) <= 2 * half:
        still = np.zeros_like(readings)
        return Motion(readings, still, still, at)
    near = period * np.arange(-half, half + 1)
    fit = np.linalg.pinv(np.vander(near, degree + 1, increasing=True))
    q = sampled(at, readings, even)
    windows = np.lib.stride_tricks.sliding_window_view(q, 2 * half + 1, axis=0)
    inner = even[half : len(even) - half]
    return Motion(windows @ fit[0], windows @ fit[1], 2.0 * windows @ fit[2], inner)
