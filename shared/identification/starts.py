"""What a repeat differs by because it started in another state than what it repeats.

A controller of tool poses leaves the elbow free: the arm comes to the start of a motion in one
posture, to the start of its repeat in another, and is in another all the way. That is the arm, not
noise, and the nominal model knows most of it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from shared.identification.dataset.types import Dataset, Float64
from shared.identification.subject import Subject, recorded_of
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


def starts_apart(dataset: Dataset, subject: Subject) -> Starts:
    """Return what repeats differ by in the nominal model for starting elsewhere.

    Under torque control nothing is returned: an arm that nothing holds drifts off, in a model, too.
    """
    if subject.control == "torque":
        return {}
    found = dict(
        zip((each.name for each in dataset.trajectories), recorded_of(dataset), strict=True)
    )
    out: dict[str, Apart] = {}
    for each in dataset.trajectories:
        if not each.repeats:
            continue
        first, second = found[each.repeats], found[each.name]
        if float(np.abs(first.initial_q - second.initial_q).max()) < LEAST:
            continue
        again = replace(second, joints_at=first.joints_at, tracker_at=first.tracker_at)
        one, other = subject.nominal.run([(_as_it_is, first), (_as_it_is, again)])
        tracker = None
        if one.tracker is not None and other.tracker is not None:
            tracker = np.nan_to_num(pose_error(one.tracker, other.tracker))
        out[each.name] = Apart(np.nan_to_num(one.q - other.q), tracker)
    return out


def _as_it_is(_: Row) -> None:
    """Change nothing of the nominal arm."""
