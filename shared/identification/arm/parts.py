"""Parts of one recording, each replayed from the state that was measured when it begins."""

from dataclasses import dataclass

import numpy as np

from shared.identification.arm.smoothing import smooth_states
from shared.identification.dataset.types import Float64, Trajectory
from shared.sim.plant.plant import Control
from shared.sim.plant.rollouts import Recorded
from shared.sim.plant.signals import Signal, sampled


@dataclass(frozen=True)
class Cut:
    """How recordings are cut into parts."""

    length: float
    """(s)."""
    smooth: float
    """Readings that a state is taken from, either side together (s)."""
    spread: float = np.inf
    """The most that noise spreads in a part (1)."""


CUTS: dict[Control, Cut] = {"torque": Cut(0.3, 0.05), "pose": Cut(1.0, 0.1, spread=4.0)}
"""Where a controller does not hold the arm to its command.

Torques let an arm drift off. Poses leave the elbow of an arm of seven joints free: a start that is
off by 0.4 mrad, less than a reading, became 40 mrad within 6 s, at a tool where it should be. Where
a tool is held, damping takes a wrong speed away; where such an arm gives, random torques leave four
to five floors.
"""
CUT = Cut(1.0, 0.05)
"""Of any other arm."""


def width_of(period: float, cut: Cut) -> int:
    """Return how many readings of a period (s) a state is taken from; odd."""
    return max(round(cut.smooth / period) // 2 * 2 + 1, 7)


def spans_of(trajectory: Trajectory, cut: Cut) -> Float64:
    """Return float64[P, 2], when parts begin and end; none of a recording too short to be cut (s).

    Each ends where the next one begins: no reading is of two parts.
    """
    at, period = trajectory.joints_at, _period(trajectory)
    width = width_of(period, cut)
    if len(_even(trajectory)) <= 2 * width:
        return np.zeros((0, 2))
    begins = np.arange(at[0] + width * period, at[-1] - 0.5 * cut.length, cut.length)
    return np.stack([begins, np.r_[begins[1:], begins[-1:] + cut.length]], axis=1)


def states_of(
    trajectory: Trajectory, instants: Float64, timestep: float, cut: Cut
) -> list[tuple[Float64, Float64]]:
    """Return positions and speeds at instants, from a local fit of the positions.

    Args:
        trajectory: the recording, longer than :func:`spans_of` needs.
        instants: when (s).
        timestep: of the physics that goes on from there (s).
        cut: says how many readings a fit is of.
    """
    even, period = _even(trajectory), _period(trajectory)
    q = sampled(trajectory.joints_at, trajectory.q, even)
    width = width_of(period, cut)
    position, speed = smooth_states(q, width, period)
    # MuJoCo's Euler step takes the position with the speed after it: it is of second order if the
    # speed is given half a step before the position (Stormer and Verlet's method).
    before = sampled(even, speed, instants - 0.5 * timestep)
    return list(zip(sampled(even, position, instants), before, strict=True))


def part_of(
    trajectory: Trajectory, begin: float, end: float, state: tuple[Float64, Float64]
) -> tuple[Recorded, np.ndarray, np.ndarray]:
    """Return what a part is replayed from, and which readings are in it.

    Args:
        trajectory: the recording.
        begin: of the part (s).
        end: of the part, no longer in it (s).
        state: position and speed when it begins: float64[J] each.

    Returns:
        The part, then indices of its readings of the joints and of the tracker.
    """
    joints = np.flatnonzero((trajectory.joints_at >= begin) & (trajectory.joints_at < end))
    tracker = np.zeros(0, np.int64)
    if trajectory.tracker_at is not None:
        seen = (trajectory.tracker_at >= begin) & (trajectory.tracker_at < end)
        tracker = np.flatnonzero(seen)
    recorded = Recorded(
        initial_q=state[0],
        initial_qd=state[1],
        command=Signal(trajectory.command_at - begin, trajectory.command),
        logged_q=Signal(trajectory.joints_at - begin, trajectory.q),
        joints_at=trajectory.joints_at[joints] - begin,
        tracker_at=trajectory.tracker_at[tracker] - begin
        if trajectory.tracker_at is not None and len(tracker)
        else None,
        trajectory=trajectory.name,
        begin=begin,
        logged_tracker=tracker_of(trajectory, begin),
    )
    return recorded, joints, tracker


def tracker_of(trajectory: Trajectory, begin: float = 0.0) -> Signal | None:
    """Return what a tracker logged, if one did.

    Args:
        trajectory: the recording.
        begin: what its instants are counted from (s).
    """
    if trajectory.tracker_at is None or trajectory.tracker is None:
        return None
    return Signal(trajectory.tracker_at - begin, trajectory.tracker)


def _period(trajectory: Trajectory) -> float:
    return float(np.median(np.diff(trajectory.joints_at)))


def _even(trajectory: Trajectory) -> Float64:
    at = trajectory.joints_at
    return np.arange(at[0], at[-1], _period(trajectory))
