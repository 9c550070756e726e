"""Parts of recordings that are replayed from a known state.

Under a controller that holds the arm to its command a whole recording is one part. Torques let an
arm drift off, so that only short parts say something; each starts from the measured state, its
velocity taken from a local fit of the positions.
"""

from dataclasses import dataclass, replace

import numpy as np

from shared.identification.dataset.types import Dataset, Float64, Trajectory
from shared.identification.smoothing import smooth
from shared.identification.subject import Subject
from shared.sim.plant.rollouts import Recorded
from shared.sim.plant.signals import Signal, sampled

TORQUE_WINDOW = 0.3
"""Of a part under torque control (s)."""
SMOOTH = 0.05
"""Readings that a state under torque control is taken from, either side together (s)."""


@dataclass(frozen=True)
class Segment:
    """A part of a recording."""

    trajectory: int
    recorded: Recorded
    q: Float64
    """float64[T, J], what was logged (rad, m)."""
    tracker: Float64 | None
    """float64[K, 7]."""


def segments_of(
    dataset: Dataset, subject: Subject, window: float | None = None
) -> tuple[Segment, ...]:
    """Return the parts that a data set is replayed in.

    A repeat is not replayed: its commands are those of what it repeats, it measures the noise.

    Args:
        dataset: the recordings.
        subject: the arm.
        window: length of a part (s); None for whole recordings, or what torque control allows.
    """
    if window is None and subject.control == "torque":
        window = TORQUE_WINDOW
    found: list[Segment] = []
    for index, trajectory in enumerate(dataset.trajectories):
        if trajectory.repeats:
            continue
        if window is None:
            found.append(_part(index, trajectory, 0.0, np.inf, None))
        else:
            found += _windows(index, trajectory, window, subject)
    names = tuple(each.name for each in dataset.trajectories)
    return tuple(
        replace(each, recorded=replace(each.recorded, earlier=names[: each.trajectory]))
        for each in found
    )


def _windows(index: int, trajectory: Trajectory, window: float, subject: Subject) -> list[Segment]:
    at = trajectory.joints_at
    period = float(np.median(np.diff(at)))
    even = np.arange(at[0], at[-1], period)
    q = sampled(at, trajectory.q, even)
    width = max(round(SMOOTH / period) // 2 * 2 + 1, 7)
    if len(even) <= 2 * width:
        return [_part(index, trajectory, 0.0, np.inf, None)]
    position = smooth(q, width)
    speed = smooth(q, width, period)
    starts = np.arange(at[0] + width * period, at[-1] - 0.5 * window, window)
    ends = np.r_[starts[1:], starts[-1:] + window]  # no reading is of two parts
    # MuJoCo's Euler step takes the position with the speed after it: it is of second order if the
    # speed is given half a step before the position (Stormer and Verlet's method).
    before = starts - 0.5 * subject.plant.timestep
    states = list(zip(sampled(even, position, starts), sampled(even, speed, before), strict=True))
    return [
        _part(index, trajectory, float(start), float(end), state)
        for start, end, state in zip(starts, ends, states, strict=True)
    ]


def _part(
    index: int, of: Trajectory, begin: float, end: float, state: tuple[Float64, Float64] | None
) -> Segment:
    pick = (of.joints_at >= begin) & (of.joints_at < end)
    tracker_at = tracker = None
    if of.tracker_at is not None and of.tracker is not None:
        seen = (of.tracker_at >= begin) & (of.tracker_at < end)
        if seen.any():
            tracker_at, tracker = of.tracker_at[seen] - begin, of.tracker[seen]
    q0, qd0 = (of.initial_q, of.initial_qd) if state is None else state
    recorded = Recorded(
        initial_q=q0,
        initial_qd=qd0,
        command=Signal(of.command_at - begin, of.command),
        logged_q=Signal(of.joints_at - begin, of.q),
        joints_at=of.joints_at[pick] - begin,
        tracker_at=tracker_at,
        trajectory=of.name,
        begin=begin,
    )
    return Segment(index, recorded, of.q[pick], tracker)
