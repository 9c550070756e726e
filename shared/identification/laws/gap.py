"""Where a link lies in a gap when a part of a recording begins, as a tracker sees it.

Between the flanks it is free, so for a moment its way is a parabola; at a flank it stays until it
leaves. So the readings about the start are taken for a parabola that is cut off at the flanks, by
least squares: of one that is seen at a flank it may be anywhere beyond (Tobin 1958).
"""

import functools
from typing import NamedTuple

import numpy as np

from shared.identification.dataset.types import Float64
from shared.sim.plant.kinematics import tool_motion
from shared.sim.plant.plant import Model, Plant
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal, pose_error, sampled

_AROUND = 0.06
"""Either side of the start, in which a tracker is asked where a link was (s)."""
_LEVER = 0.5
"""What a tracker's turn counts beside its way: a bat's length (m)."""
_KEPT = 512
"""Recordings, or parts of them, of which it is kept where the link was, by size of the gap."""
_FEWEST = 5
"""Readings that it takes to say where it was."""
_EITHER_SIDE = 4
"""Of these, before the start and after it, that it takes to say how it moves."""
_BEGINS = ((1, 0.035), (2, _AROUND))
"""Degrees of polynomials, and how far about the start they go (s), that a fit begins from: what
hits a flank in that time is another parabola before and after."""
_STEPS = 12
"""Of a fit, at the most: each puts what is cut off where the last one had it."""


class Seen(NamedTuple):
    """Where a link is beside its motor, as a tracker sees it."""

    place: float
    """Within the gap (rad, m)."""
    speed: float
    """0 at a flank (rad/s, m/s)."""


def seen_by_tracker(row: Row, label: str, half: float) -> Seen | None:
    """Return where a link is beside its motor at the start, as a tracker saw it; None without one.

    None, too, where encoders see what the tracker sees.

    Args:
        row: the arm; what begins with its recording begins at rest.
        label: the logged joint.
        half: of the gap (rad, m).
    """
    if row.logged_tracker is None or row.plant.encoders == "link":
        return None
    joint = row.plant.labels.index(label)
    return _seen(row.plant, row.model, row.logged_q, row.logged_tracker, joint, half)


@functools.lru_cache(_KEPT)
def _seen(
    plant: Plant, model: Model, log: Signal, tracker: Signal, joint: int, half: float
) -> Seen | None:
    turns = _turns(plant, model, log, tracker, joint)
    return None if turns is None else seen(*turns, half)


def seen(at: Float64, turns: Float64, half: float) -> Seen:
    """Return where a link is at time 0.

    Args:
        at: float64[K], of readings about the start (s).
        turns: float64[K], how far the link was turned beside its motor (rad, m).
        half: of the gap (rad, m).
    """
    earlier = int(np.count_nonzero(at < 0.0))
    if min(earlier, len(at) - earlier) < _EITHER_SIDE:
        return Seen(float(np.clip(turns.mean(), -half, half)), 0.0)
    ways = [way for begin in _BEGINS for way in _ways(at, turns, half, *begin)]
    place, speed, *_ = min(ways, key=lambda way: _off(at, turns, half, way))
    is_free = abs(place) < half
    return Seen(float(np.clip(place, -half, half)), float(speed) if is_free else 0.0)


def _ways(at: Float64, turns: Float64, half: float, degree: int, window: float) -> list[Float64]:
    """Return polynomials that come ever nearer to readings where they are not cut off.

    The first goes through those of a window.
    """
    powers = np.vander(at, 3, increasing=True)[:, : degree + 1]
    is_near = np.abs(at) <= window
    if np.count_nonzero(is_near) <= degree + 1:
        return []
    some, whole = (
        np.asarray(np.linalg.pinv(each), np.float64) for each in (powers[is_near], powers)
    )
    ways: list[Float64] = [some @ turns[is_near]]
    for _ in range(_STEPS):
        way = powers @ ways[-1]
        is_cut = (np.abs(way) >= half) & (np.abs(turns) >= half)
        ways.append(whole @ np.where(is_cut, way, turns))
    return ways


def _off(at: Float64, turns: Float64, half: float, way: Float64) -> float:
    """Return how far a polynomial that is cut off is from readings: sum of squares."""
    along = np.vander(at, len(way), increasing=True) @ way
    return float(np.sum((turns - np.clip(along, -half, half)) ** 2))


@functools.lru_cache(_KEPT)
def _turns(
    plant: Plant, model: Model, log: Signal, tracker: Signal, joint: int
) -> tuple[Float64, Float64] | None:
    """Return when readings about the start are, and the turns of a joint that only they saw.

    Each is the turn that brings the tool from where the encoders have it to where it was seen, as
    well as a turn can (least squares).
    """
    is_near = np.abs(tracker.at) <= _AROUND
    if np.count_nonzero(is_near) < _FEWEST:
        return None
    at = tracker.at[is_near]
    poses, jacobian = tool_motion(plant, model, sampled(log.at, log.values, at))
    units = np.array([1.0, 1.0, 1.0, _LEVER, _LEVER, _LEVER])
    column = jacobian[:, :, joint] * units
    off = pose_error(tracker.values[is_near], poses) * units
    return at, np.sum(column * off, axis=1) / np.sum(column**2, axis=1)
