"""What a part is off by because its first state is.

A part is replayed from a state that is measured: positions to a fraction of a reading, speeds from
what a few readings around differ by. Nothing takes a wrong speed away where nothing holds the arm,
so at the end of a part it is off by ten times what a reading is off by, the same way for a right
model as for a wrong one. What first states can be off by is known, as the arm answers it: along
that a residual says the less of a model the less is known of them, and all it can say across it.
That is what a fit with first states of its own for every part would leave (multiple shooting; Bock
1983), each held to what was measured as far as that is known.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

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


@dataclass(frozen=True)
class StartErrors:
    """What readings change by for a first state that is off by 1.

    One column for each joint's position (rad, m), then for each one's speed (rad/s, m/s).
    """

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
        by = np.outer([_POSITION, _SPEED], _travel(part)).ravel()
        joints = np.stack([each.q - own.q for each in others], axis=-1) / by
        tracker = None
        if own.tracker is not None:
            moved = [pose_error(each.tracker, own.tracker) for each in others
                     if each.tracker is not None]  # fmt: skip
            tracker = np.nan_to_num(np.stack(moved, axis=-1)) / by
        out.append(StartErrors(np.nan_to_num(joints), tracker))
    return out


@dataclass(frozen=True)
class Doubt:
    """What there is in residuals of one part that its first state could be."""

    columns: Float64
    """float64[..., K], standard deviations of each number for each that a state is off by."""
    along: Float64
    """float64[N, K], orthonormal, of N numbers."""
    kept: Float64
    """float64[K], share of a residual along each that is left."""

    @classmethod
    def of(cls, columns: Float64) -> "Doubt":
        """Return it of float64[..., K], how far each number is off by first states, in floors."""
        along, sizes, _ = np.linalg.svd(columns.reshape(-1, columns.shape[-1]), full_matrices=False)
        return cls(columns, along, 1.0 / np.hypot(1.0, sizes))

    def without(self, values: Float64, uncounted: NDArray[np.bool_] | None = None) -> Float64:
        """Return N values as they would be of noise alone: white if they are no more than that.

        Their covariance is 1 and, along each direction, the square of how far first states lead
        there: by the root of its inverse.

        Args:
            values: float64[B, C].
            uncounted: bool[B], rows that have no say in it, and stay as they are.
        """
        if uncounted is not None and uncounted.any():
            out, counted = values.copy(), ~uncounted
            if counted.any():
                out[counted] = Doubt.of(self.columns[counted]).without(values[counted])
            return out
        flat = values.ravel()
        less = self.along @ ((1.0 - self.kept) * (self.along.T @ flat))
        return np.asarray((flat - less).reshape(values.shape), np.float64)


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
