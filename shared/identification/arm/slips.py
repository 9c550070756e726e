"""When a tracker may have slipped, from the tracker and the encoders alone."""

from typing import NamedTuple

import numpy as np

from shared.identification.dataset.types import Float64, Trajectory
from shared.sim.plant.kinematics import tool_poses
from shared.sim.plant.poses import conjugate, rotated
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.signals import sampled

_WINDOWS = ((0.25, 4.0), (1.0, 2.6))
"""Before and after an instant (s), and from how many times the median step one is worth a look: a
long one shows a step that is hardly more than a reading is off by, a short one what is fast."""
_FEWEST = 5
"""Readings of a window."""


def slip_of(rollouts: Rollouts, recording: Trajectory) -> float | None:
    """Return the likeliest instant, on the tracker's clock (s); None if no step stands out.

    Args:
        rollouts: of the arm as the model has it.
        recording: of it.
    """
    if recording.tracker_at is None or recording.tracker is None:
        return None
    at = recording.tracker_at
    q = sampled(recording.joints_at, recording.q, at)
    expected = tool_poses(rollouts.plant, rollouts.model, q)
    off = rotated(conjugate(expected[:, 3:]), recording.tracker[:, :3] - expected[:, :3])
    period = float(np.median(np.diff(at)))
    looks = [
        _looked(off, max(_FEWEST, round(length / period)), clear) for length, clear in _WINDOWS
    ]
    found = max((look for look in looks if look is not None), default=None)
    if found is None or found.clear <= 1.0:
        return None
    edge = _sharpened(off, found.edge, found.length)
    return 0.5 * float(at[edge - 1] + at[edge])


class _Look(NamedTuple):
    """The largest step in windows of one length."""

    clear: float
    """How large, in what is worth a look."""
    edge: int
    """Which reading is the first after it."""
    length: int
    """Readings of a window."""


def _looked(off: Float64, count: int, clear: float) -> _Look | None:
    """Return the largest step of float64[K, 3] (m); None where a recording is too short."""
    if len(off) < 4 * count:
        return None
    sizes = np.linalg.norm(_steps(off, count), axis=1)
    size = float(sizes.max() / max(float(np.median(sizes)), 1e-12))
    return _Look(size / clear, int(np.argmax(sizes)) + count, count)


def _steps(values: Float64, count: int) -> Float64:
    """Return float64[K - 2 count + 1, D]: steps between straight lines before and after.

    Row k is about the edge between the readings ``k + count - 1`` and ``k + count``.
    """
    x = np.arange(count) - 0.5 * (count - 1)
    ahead = 1.0 / count + x * 0.5 * count / np.sum(x**2)  # extrapolates half a reading
    columns = [
        np.correlate(column[count:], ahead[::-1], "valid")
        - np.correlate(column[:-count], ahead, "valid")
        for column in values.T
    ]
    return np.stack(columns, axis=1)


def _sharpened(values: Float64, edge: int, count: int) -> int:
    """Return the edge that a line with a step fits best near a first guess."""
    begin = max(edge - count, 0)
    part = values[begin : edge + count]
    x = np.linspace(-1.0, 1.0, len(part))
    misfits: list[float] = []
    tries = range(2, len(part) - 1)
    for first in tries:
        basis = np.stack([np.ones_like(x), x, (np.arange(len(part)) >= first) * 1.0], axis=1)
        found, *_ = np.linalg.lstsq(basis, part, rcond=None)
        misfits.append(float(np.sum((part - basis @ found) ** 2)))
    return begin + tries[int(np.argmin(misfits))]
