"""When a tracker may have slipped, from the tracker and the encoders alone.

Two looks: at the clearest step within a second or two of one recording, and at the instants after
which the tracker sits elsewhere on the hand in all recordings than it did before. The second one
shows slips of a millimetre, which readings of a second do not.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from shared.identification.arm.projection import basis_of, without
from shared.identification.dataset.types import Float64, Trajectory
from shared.sim.plant.kinematics import tool_poses
from shared.sim.plant.poses import conjugate, rotated
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.signals import sampled

_WINDOWS = ((0.25, 4.0), (1.0, 2.6))
"""Before and after an instant (s), and from how many times the median step one is worth a look: a
long one shows a step that is hardly more than a reading is off by, a short one what is fast."""
_FEWEST = 5
"""Readings of a window."""
_MOST = 6
"""Instants of all recordings after which the tracker may sit elsewhere, the likeliest."""
_APART = 0.4
"""Instants of one recording are as far from each other (s)."""
_LASTS = 40.0
"""Of the square of a lasting step in its standard errors, from which it is worth a look. White
noise alone comes to some 16, noise that drifts to 60."""
_BLOCK = 0.1
"""For standard errors: what noise is like within it is all the same (s)."""
_RANK = 1e-6
"""Of the largest singular value: what is less changes nothing."""
_TINY = 1e-18
"""Less than any noise (m^2): a planar arm without any is nowhere off across."""


def slips_of(rollouts: Rollouts, recordings: Sequence[Trajectory]) -> dict[str, tuple[float, ...]]:
    """Return the likeliest instants by recording, on the tracker's clock (s).

    Args:
        rollouts: of the arm as the model has it.
        recordings: of it, in the order of recording; only those to fit to are looked at.
    """
    seen = [
        one
        for each in recordings
        if each.split == "train" and (one := _seen(rollouts, each)) is not None
    ]
    found = [(one.name, at) for one in seen if (at := _clearest(one)) is not None]
    known: dict[str, set[float]] = {}
    for name, at in (*found, *_lasting(seen)):
        known.setdefault(name, set()).add(at)
    return {one.name: tuple(sorted(known[one.name])) for one in seen if one.name in known}


def slip_of(rollouts: Rollouts, recording: Trajectory) -> float | None:
    """Return the instant of the clearest step, on the tracker's clock (s); None if none stands out.

    Args:
        rollouts: of the arm as the model has it.
        recording: of it.
    """
    seen = _seen(rollouts, recording)
    return None if seen is None else _clearest(seen)


class _Seen(NamedTuple):
    """Where a tracker is beside where it should be."""

    name: str
    """Of the recording."""
    at: Float64
    """float64[K] (s)."""
    off: Float64
    """float64[K, 3], in the hand's frame (m)."""
    bends: Float64
    """float64[K, 2 J + 4] of the posture and the hand's velocity, in which what wrong encoders,
    links and clocks do is about linear."""


def _seen(rollouts: Rollouts, recording: Trajectory) -> _Seen | None:
    """Return a recording's tracker; None if it has too few readings to tell a step."""
    at, tracker = recording.tracker_at, recording.tracker
    if at is None or tracker is None or len(at) < 2 * _FEWEST:
        return None
    q = sampled(recording.joints_at, recording.q, at)
    expected = tool_poses(rollouts.plant, rollouts.model, q)
    to_hand = conjugate(expected[:, 3:])
    off = rotated(to_hand, tracker[:, :3] - expected[:, :3])
    velocity = rotated(to_hand, np.gradient(expected[:, :3], at, axis=0))
    bends = np.column_stack([np.ones(len(at)), np.sin(q), np.cos(q), velocity])
    return _Seen(recording.name, at, off, bends)


def _clearest(seen: _Seen) -> float | None:
    """Return when the clearest step is (s); None if none stands out."""
    at, off = seen.at, seen.off
    period = float(np.median(np.diff(at)))
    looks = [
        _looked(off, max(_FEWEST, round(length / period)), clear) for length, clear in _WINDOWS
    ]
    found = max((look for look in looks if look is not None), default=None)
    if found is None or found.clear <= 1.0:
        return None
    edge = _sharpened(off, found.edge, found.length)
    return 0.5 * float(at[edge - 1] + at[edge])


def _lasting(seen: Sequence[_Seen]) -> list[tuple[str, float]]:
    """Return recordings and instants after which a tracker sits elsewhere, the likeliest first."""
    if not seen:
        return []
    at, off, bends = (np.concatenate(each) for each in zip(*(one[1:] for one in seen), strict=True))
    which = np.repeat(np.arange(len(seen)), [len(one.at) for one in seen])
    is_first = np.r_[True, np.diff(which) > 0]
    size = np.where(is_first, 0.0, _lasting_steps(off, bends, at))
    found: list[tuple[str, float]] = []
    while len(found) < _MOST and size.max() >= _LASTS:
        edge = int(np.argmax(size))
        found.append((seen[int(which[edge])].name, 0.5 * float(at[edge - 1] + at[edge])))
        size[(which == which[edge]) & (np.abs(at - at[edge]) < _APART)] = 0.0
    return found


def _lasting_steps(off: Float64, bends: Float64, at: Float64) -> Float64:
    """Return float64[K], how sure a step is from each reading on: its square in standard errors.

    Args:
        off: float64[K, 3], in the order of recording.
        bends: float64[K, N], what the rest of it may be a sum of.
        at: float64[K], of one recording after the other (s).
    """
    basis = basis_of(bends, _RANK)
    left = without(basis, off)
    count = max(round(_BLOCK / float(np.median(np.diff(at)))), 1)
    blocks = left[: len(left) // count * count].reshape(-1, count, off.shape[1]).mean(axis=1)
    variance = np.maximum(count * np.mean(blocks**2, axis=0), _TINY)
    later, shown = (np.cumsum(each[::-1], axis=0)[::-1] for each in (left, basis))
    own = np.arange(len(off), 0, -1) - np.sum(shown**2, axis=1)
    is_told = own > _FEWEST
    return np.where(is_told, np.sum(later**2 / variance, axis=1) / np.maximum(own, 1.0), 0.0)


class _Look(NamedTuple):
    """The largest step in windows of one length."""

    clear: float
    """How large, in what is worth a look."""
    edge: int
    """Which reading is the first after it."""
    length: int
    """Readings of a window."""


def _looked(off: Float64, count: int, clear: float) -> _Look | None:
    """Return the largest step of float64[K, 3] (m); None where a recording is too short."""
    if len(off) < 4 * count:
        return None
    sizes = np.linalg.norm(_steps(off, count), axis=1)
    size = float(sizes.max() / max(float(np.median(sizes)), 1e-12))
    return _Look(size / clear, int(np.argmax(sizes)) + count, count)


def _steps(values: Float64, count: int) -> Float64:
    """Return float64[K - 2 count + 1, D]: steps between straight lines before and after.

    Row k is about the edge between the readings ``k + count - 1`` and ``k + count``.
    """
    x = np.arange(count) - 0.5 * (count - 1)
    ahead = 1.0 / count + x * 0.5 * count / np.sum(x**2)  # extrapolates half a reading
    columns = [
        np.correlate(column[count:], ahead[::-1], "valid")
        - np.correlate(column[:-count], ahead, "valid")
        for column in values.T
    ]
    return np.stack(columns, axis=1)


def _sharpened(values: Float64, edge: int, count: int) -> int:
    """Return the edge that a line with a step fits best near a first guess."""
    begin = max(edge - count, 0)
    part = values[begin : edge + count]
    x = np.linspace(-1.0, 1.0, len(part))
    misfits: list[float] = []
    tries = range(2, len(part) - 1)
    for first in tries:
        basis = np.stack([np.ones_like(x), x, (np.arange(len(part)) >= first) * 1.0], axis=1)
        found, *_ = np.linalg.lstsq(basis, part, rcond=None)
        misfits.append(float(np.sum((part - basis @ found) ** 2)))
    return begin + tries[int(np.argmin(misfits))]
