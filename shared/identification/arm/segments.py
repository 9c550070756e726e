"""What a data set is replayed in: whole recordings, or parts of them.

Under a controller that holds the arm to its command a whole recording is one part. Elsewhere only
short parts say something, see :data:`shared.identification.arm.parts.CUTS`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from shared.identification.arm.parts import CUT, CUTS, Cut, part_of, spans_of, states_of
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Dataset, Float64, Trajectory
from shared.sim.plant.replay import Recorded

ENOUGH_SECONDS = 15.0
"""Of motion, about, that show well enough where to look closer (s)."""


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
        window: length of a part (s); None for whole recordings, or what the control allows.
    """
    cut = CUTS.get(subject.control)
    if window is not None:
        cut = replace(cut or CUT, length=window)
    found: list[Segment] = []
    for index, trajectory in enumerate(dataset.trajectories):
        if not trajectory.repeats:
            found += _segments(index, trajectory, cut, subject.plant.timestep)
    names = tuple(each.name for each in dataset.trajectories)
    return tuple(
        replace(each, recorded=replace(each.recorded, earlier=names[: each.trajectory]))
        for each in found
    )


def _segments(
    index: int, trajectory: Trajectory, cut: Cut | None, timestep: float
) -> list[Segment]:
    spans = np.zeros((0, 2)) if cut is None else spans_of(trajectory, cut)
    if cut is None or not len(spans):
        known = (trajectory.initial_q, trajectory.initial_qd)
        return [_segment(index, trajectory, 0.0, np.inf, known)]
    return parts_at(index, trajectory, spans, cut, timestep)


def parts_at(
    index: int, trajectory: Trajectory, spans: Float64, cut: Cut, timestep: float
) -> list[Segment]:
    """Return parts of a recording, each from its measured state.

    Args:
        index: of the recording.
        trajectory: itself.
        spans: float64[P, 2], when they begin and end (s).
        cut: says how many readings a state is taken from.
        timestep: of the physics that goes on from there (s).
    """
    states = states_of(trajectory, spans[:, 0], timestep, cut)
    return [
        _segment(index, trajectory, float(begin), float(end), state)
        for (begin, end), state in zip(spans, states, strict=True)
    ]


def _segment(
    index: int, of: Trajectory, begin: float, end: float, state: tuple[Float64, Float64]
) -> Segment:
    recorded, joints, tracker = part_of(of, begin, end, state)
    poses = None if of.tracker is None or not len(tracker) else of.tracker[tracker]
    return Segment(index, recorded, of.q[joints], poses)


def thinned(segments: Sequence[Segment], of: Sequence[int]) -> tuple[int, ...]:
    """Return some of each recording's segments: half of all or, of many, what shows enough.

    They are one of so many, of the first recording from its first segment on, of the next from its
    second: what recurs at the same times of all recordings, a log's gaps for one, would else be in
    all of them or in none.

    Args:
        segments: all that there are.
        of: indices of those of which some are wanted.
    """
    every = max(2, round(seconds_of(segments, of) / ENOUGH_SECONDS))
    order: dict[int, list[int]] = {}
    for index in of:
        order.setdefault(segments[index].trajectory, []).append(index)
    kept = {one for turn, own in enumerate(order.values()) for one in own[turn % every :: every]}
    return tuple(index for index in of if index in kept)


def seconds_of(segments: Sequence[Segment], of: Sequence[int]) -> float:
    """Return how long some segments are together (s)."""
    return float(sum(segments[index].recorded.joints_at[-1] for index in of))
