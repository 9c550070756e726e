"""What a repeat differs by because it was in another state than what it repeats.

A controller of tool poses leaves the elbow free: the arm comes to the start of a motion in one
posture, to the start of its repeat in another, and is in another all the way. That is the arm, not
noise, and the nominal model knows most of it. Where recordings are replayed in parts it is asked
for each part anew, since each begins at the measured state.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shared.identification.arm.parts import Cut, part_of, spans_of, states_of
from shared.identification.dataset.types import Float64, Trajectory
from shared.sim.plant.replay import Recorded, Reports
from shared.sim.plant.rollouts import Rollouts, as_it_is
from shared.sim.plant.signals import pose_error

LEAST = 2e-3
"""Joints that start closer together than this are taken to start alike (rad, m)."""


@dataclass(frozen=True)
class Apart:
    """What the model says that two recordings differ by."""

    joints: Float64
    """float64[T, J] at the first recording's readings (rad, m); NaN of those in no part."""
    tracker: Float64 | None
    """float64[K, 6] (m, rad), the same."""


Starts = Mapping[str, Apart]
"""By the name of the repeat; those that start alike are left out."""


def starts_apart(
    nominal: Rollouts,
    recorded: Sequence[tuple[Trajectory, Recorded]],
    cut: Cut | None = None,
) -> Starts:
    """Return what repeats differ by in the nominal model for starting elsewhere.

    Args:
        nominal: the arm as its model file has it.
        recorded: every recording, and what it is replayed from.
        cut: says how recordings are replayed in parts; None where they are not.
    """
    found = {trajectory.name: (trajectory, replayed) for trajectory, replayed in recorded}
    out: dict[str, Apart] = {}
    for second, replayed in recorded:
        if not second.repeats:
            continue
        first, from_first = found[second.repeats]
        pairs = [] if cut is None else list(_parts(first, second, cut, nominal))
        if not pairs:
            if float(np.abs(from_first.initial_q - replayed.initial_q).max()) < LEAST:
                continue
            whole = np.arange(len(first.joints_at))
            tracked = np.arange(0 if first.tracker_at is None else len(first.tracker_at))
            pairs = [_Pair(from_first, replayed, whole, tracked)]
        out[second.name] = _apart(nominal, first, pairs)
    return out


@dataclass(frozen=True)
class _Pair:
    """The same motion from two states, and which readings of the first recording it covers."""

    first: Recorded
    second: Recorded
    joints: np.ndarray
    tracker: np.ndarray


def _parts(first: Trajectory, second: Trajectory, cut: Cut, nominal: Rollouts) -> Iterable[_Pair]:
    spans = spans_of(first, cut)
    spans = spans[spans[:, 0] < second.joints_at[-1]]
    if not len(spans) or not len(spans_of(second, cut)):
        return
    ones, others = (
        states_of(each, spans[:, 0], nominal.plant.timestep, cut) for each in (first, second)
    )
    for (begin, end), one, other in zip(spans, ones, others, strict=True):
        part, joints, tracker = part_of(first, float(begin), float(end), one)
        yield _Pair(part, part_of(second, float(begin), float(end), other)[0], joints, tracker)


def _apart(nominal: Rollouts, of: Trajectory, pairs: Sequence[_Pair]) -> Apart:
    """Return what pairs differ by."""
    work = [
        part
        for pair in pairs
        for part in (
            pair.first,
            replace(pair.second, joints_at=pair.first.joints_at, tracker_at=pair.first.tracker_at),
        )
    ]
    found = nominal.run([(as_it_is, part) for part in work])
    joints = np.full_like(of.q, np.nan)
    tracker = None if of.tracker is None else np.full((len(of.tracker), 6), np.nan)
    for pair, one, other in zip(pairs, found[::2], found[1::2], strict=True):
        joints[pair.joints] = np.nan_to_num(one.q - other.q)
        if tracker is not None and len(pair.tracker):
            tracker[pair.tracker] = _tracker_apart(one, other)
    return Apart(joints, tracker)


def _tracker_apart(one: Reports, other: Reports) -> Float64:
    assert one.tracker is not None
    assert other.tracker is not None
    return np.nan_to_num(pose_error(one.tracker, other.tracker))
