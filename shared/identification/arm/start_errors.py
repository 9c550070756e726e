"""What a part is off by because its first state is.

A part is replayed from a state that is measured: positions to a fraction of a reading, speeds from
what a few readings around differ by. Nothing takes a wrong speed away where nothing holds the arm,
so at the end of a part it is off by ten times what a reading is off by, the same way for a right
model as for a wrong one. What first states can be off by is known, as the arm answers it: a
residual says nothing of a model along that, and all it can say across it. That is what a fit with
first states of its own for every part would leave (multiple shooting; Bock 1983).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from shared.identification.dataset.types import Float64
from shared.sim.plant.replay import Recorded
from shared.sim.plant.rollouts import Entry, Rollouts
from shared.sim.plant.signals import pose_error

_POSITION = 3e-4
"""By which a joint is put elsewhere, in what it travels in the recording."""
_SPEED = 3e-3
"""By which it is made faster, in what it travels (1/s)."""
_LEAST_TRAVEL = 0.01
"""Of a joint that hardly moves (rad, m)."""
_NOTHING = 1e-8
"""Of the largest singular value: what is less is no direction."""


@dataclass(frozen=True)
class StartErrors:
    """What readings change by, one column for each joint's position, then for each one's speed."""

    joints: Float64
    """float64[T, J, K]."""
    tracker: Float64 | None
    """float64[T', 6, K]."""


@dataclass(frozen=True)
class FreeStarts:
    """What parts of recordings are off by where their first states are, each asked for once."""

    arms: Rollouts
    entry: Entry
    """Of the arm that answers; what friction holds goes on as it does there."""
    _known: dict[tuple[str, float, float], StartErrors] = field(
        default_factory=dict[tuple[str, float, float], StartErrors], repr=False
    )

    def of(self, parts: Sequence[Recorded]) -> list[StartErrors]:
        """Return it of each part."""
        keys = [(each.trajectory, each.begin, float(each.joints_at[-1])) for each in parts]
        new = {key: part for key, part in zip(keys, parts, strict=True) if key not in self._known}
        found = start_errors(self.arms, list(new.values()), self.entry)
        self._known.update(zip(new, found, strict=True))
        return [self._known[key] for key in keys]


def start_errors(arms: Rollouts, parts: Sequence[Recorded], entry: Entry) -> list[StartErrors]:
    """Return what parts are off by where their first states are.

    Args:
        arms: of the plant.
        parts: what is replayed.
        entry: of the one that replays it.
    """
    work = [(entry, each) for part in parts for each in (part, *_otherwise(part, _travel(part)))]
    found = arms.run(work)
    out: list[StartErrors] = []
    for part in parts:
        count = 1 + 2 * len(part.initial_q)
        own, others, found = found[0], found[1:count], found[count:]
        joints = np.stack([each.q - own.q for each in others], axis=-1)
        tracker = None
        if own.tracker is not None:
            moved = [pose_error(each.tracker, own.tracker) for each in others
                     if each.tracker is not None]  # fmt: skip
            tracker = np.nan_to_num(np.stack(moved, axis=-1))
        out.append(StartErrors(np.nan_to_num(joints), tracker))
    return out


def directions(columns: Float64) -> Float64:
    """Return float64[N, K'], orthonormal: what columns float64[N, K] span."""
    left, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(left[:, sizes > _NOTHING * max(sizes[0], 1e-300)], np.float64)


def across(values: Float64, along: Float64) -> Float64:
    """Return values, float64[B, C], without what they have along directions, float64[B C, K]."""
    flat = values.ravel()
    return np.asarray((flat - along @ (along.T @ flat)).reshape(values.shape), np.float64)


def _travel(part: Recorded) -> Float64:
    return np.maximum(np.ptp(part.logged_q.values, axis=0), _LEAST_TRAVEL)


def _otherwise(part: Recorded, travel: Float64) -> list[Recorded]:
    """Return a part from other states: each joint elsewhere, then each one faster."""
    places = np.diag(_POSITION * travel)
    speeds = np.diag(_SPEED * travel)
    return [
        *(replace(part, initial_q=part.initial_q + each) for each in places),
        *(replace(part, initial_qd=part.initial_qd + each) for each in speeds),
    ]
