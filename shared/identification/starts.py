"""What a repeat differs by because it started in another state than what it repeats.

A controller of tool poses leaves the elbow free: the arm comes to the start of a motion in one
posture, to the start of its repeat in another, and is in another all the way. That is the arm, not
noise, and the nominal model knows most of it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shared.identification.dataset.types import Float64, Trajectory
from shared.sim.plant.rollouts import Recorded, Rollouts
from shared.sim.plant.row import Row
from shared.sim.plant.signals import pose_error

LEAST = 2e-3
"""Joints that start closer together than this are taken to start alike (rad, m)."""


@dataclass(frozen=True)
class Apart:
    """What the model says that two recordings differ by."""

    joints: Float64
    """float64[T, J] at the first recording's readings (rad, m)."""
    tracker: Float64 | None
    """float64[K, 6] (m, rad)."""


Starts = Mapping[str, Apart]
"""By the name of the repeat; those that start alike are left out."""


def starts_apart(nominal: Rollouts, recorded: Sequence[tuple[Trajectory, Recorded]]) -> Starts:
    """Return what repeats differ by in the nominal model for starting elsewhere.

    Args:
        nominal: the arm as its model file has it.
        recorded: every recording, and what it is replayed from.
    """
    found = {trajectory.name: replayed for trajectory, replayed in recorded}
    out: dict[str, Apart] = {}
    for each, second in recorded:
        if not each.repeats:
            continue
        first = found[each.repeats]
        if float(np.abs(first.initial_q - second.initial_q).max()) < LEAST:
            continue
        again = replace(second, joints_at=first.joints_at, tracker_at=first.tracker_at)
        one, other = nominal.run([(_as_it_is, first), (_as_it_is, again)])
        tracker = None
        if one.tracker is not None and other.tracker is not None:
            tracker = np.nan_to_num(pose_error(one.tracker, other.tracker))
        out[each.name] = Apart(np.nan_to_num(one.q - other.q), tracker)
    return out


def _as_it_is(_: Row) -> None:
    """Change nothing of the nominal arm."""
