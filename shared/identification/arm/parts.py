"""Parts of one recording, each replayed from the state that was measured when it begins."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shared.identification.arm.motion import smooth_motion
from shared.identification.arm.smoothing import smooth, smooth_states
from shared.identification.dataset.types import Float64, Trajectory
from shared.sim.plant.plant import Control
from shared.sim.plant.replay import Recorded
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
    dodge: float = 0.0
    """For how long a part may be put off while a joint turns round or stops (s)."""


CUTS: dict[Control, Cut] = {"torque": Cut(0.3, 0.05, dodge=0.1), "pose": Cut(1.0, 0.1, spread=4.0)}
"""Where a controller does not hold the arm to its command.

Torques let an arm drift off. Poses leave the elbow of an arm of seven joints free: a start that is
off by 0.4 mrad, less than a reading, became 40 mrad within 6 s, at a tool where it should be. Where
a tool is held, damping takes a wrong speed away; where such an arm gives, random torques leave four
to five floors.
"""
CUT = Cut(1.0, 0.05)
"""Of any other arm."""
_SLOW = 0.02
"""Of a joint's speed where it is fast: below that it stands."""
_PLACES = 11
"""Begins of a part that are looked at."""
_CLEAR = 0.7
"""Of what a state is taken from: a kink that far away does not matter."""
_DOUBT = 3.0
"""Standard deviations for one of a state, that readings would have if they were off one by one:
those of an encoder's steps go together, and a motion is no polynomial."""


def width_of(period: float, cut: Cut) -> int:
    """Return how many readings of a period (s) a state is taken from; odd."""
    return max(round(cut.smooth / period) // 2 * 2 + 1, 7)


def spans_of(trajectory: Trajectory, cut: Cut) -> Float64:
    """Return float64[P, 2], when parts begin and end; none of a recording too short to be cut (s).

    No reading is of two parts; of none are those at both ends, and those for which one is put off.
    """
    at, period = trajectory.joints_at, _period(trajectory)
    width = width_of(period, cut)
    if len(_even(trajectory)) <= 2 * width:
        return np.zeros((0, 2))
    first, last = float(at[0] + width * period), float(at[-1] - 0.5 * cut.length)
    if cut.dodge:
        begins = _put_off(first, last, _kinks(trajectory, cut), cut)
        return np.stack([begins, begins + cut.length], axis=1)
    begins = np.arange(first, last, cut.length)
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


def states_doubt(trajectories: Sequence[Trajectory], rounding: Float64, cut: Cut) -> Float64 | None:
    """Return float64[2, J], standard deviations of what :func:`states_of` returns.

    By what the readings around are off their polynomials by.

    Args:
        trajectories: the recordings; None where all are too short to be cut.
        rounding: float64[J], what an encoder's steps hide (rad, m).
        cut: says how many readings a fit is of.
    """
    found: list[Float64] = []
    for each in trajectories:
        even, period = _even(each), _period(each)
        width = width_of(period, cut)
        if len(even) <= 2 * width:
            continue
        q = sampled(each.joints_at, each.q, even)
        off = q - smooth_states(q, width, period)[0]
        one = np.eye(4 * width + 1)[:, 2 * width : 2 * width + 1]
        own = float(smooth(one, width)[2 * width, 0])
        reading = np.maximum(np.sqrt(np.mean(off**2, axis=0) / (1.0 - own)), rounding)
        weights = [np.linalg.norm(smooth(one, width, rate)) for rate in (None, period)]
        found.append(np.asarray(_DOUBT * np.outer(weights, reading), np.float64))
    if not found:
        return None
    return np.sqrt(np.mean(np.square(found), axis=0))


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


def _kinks(trajectory: Trajectory, cut: Cut) -> Float64:
    """Return float64[K], when a joint begins to move, stops or turns round (s), rising.

    Dry friction turns round then, and a speed that has a kink is no polynomial's.
    """
    motion = smooth_motion(trajectory.joints_at, trajectory.q, cut.smooth)
    fast = np.quantile(np.abs(motion.qd), 0.98, axis=0)
    way = np.sign(motion.qd) * (np.abs(motion.qd) > _SLOW * fast)
    return motion.at[1:][np.any(np.diff(way, axis=0) != 0.0, axis=1)]


def _put_off(first: float, last: float, kinks: Float64, cut: Cut) -> Float64:
    """Return float64[P], begins of parts: each as soon as the one before ends and no kink is near.

    Args:
        first: when the first part may begin (s).
        last: before when the last one must (s).
        kinks: float64[K] (s).
        cut: says how long parts are, and how long one may be put off.
    """
    off = cut.dodge * np.linspace(0.0, 1.0, _PLACES)
    begins: list[float] = []
    begin = first
    while begin < last:
        near = np.abs(begin + off[:, None] - kinks).min(axis=1, initial=np.inf)
        begins.append(begin + float(off[np.argmax(np.minimum(near, _CLEAR * cut.smooth))]))
        begin = begins[-1] + cut.length
    return np.array(begins)


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
