"""The noise floor of an arm under torques that answer what happens to it.

Given twice, such commands are not the same: a controller that is not in the model sent them, and
what pushes an arm is in them a moment later. So what a part and its repeat are compared by is what
the model is off by, each under its own commands, beyond what first states may be off by. Where
there are parts enough to say so it grows as what pushes the arm makes it (``drift.py``): counted
block by block it would be known fifty times as well as it is.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from shared.identification.arm.parts import Cut, spans_of
from shared.identification.arm.segments import Segment, parts_at
from shared.identification.arm.start_errors import Doubt, start_errors
from shared.identification.dataset.programmes import difference
from shared.identification.dataset.types import Dataset, Float64, Trajectory
from shared.identification.noise.blocks import beside, block_means
from shared.identification.noise.drift import Drift, drift_of
from shared.identification.noise.quiet import OF_PAIR
from shared.sim.plant.replay import Recorded
from shared.sim.plant.rollouts import Rollouts, as_it_is
from shared.sim.plant.signals import pose_error

_SAME = 1e-3
"""Share of their movement by which commands differ that are the same but for rounding."""
_TINY = 1e-12
"""Less than any noise (rad, m)."""
_ROUNDS = 4
"""Times that it is asked what is noise and what a first state: each depends on the other."""
_LOUD = 4.0
"""Times the usual power, from which a part has no more of a say than that."""


@dataclass(frozen=True)
class Answered:
    """What repeats differ by beyond first states."""

    levels: Float64
    """float64[C], standard deviations of block means, joints first (rad, m)."""
    correlation: Float64
    """float64[C], of neighbouring blocks."""
    drift: Drift | None = None
    """How it grows in a part from a first state that is known, in levels."""
    blocks: int = 0
    """Of a part."""


def answers(dataset: Dataset) -> bool:
    """Return whether commands answer what happens: given twice, they are not quite the same."""
    by_name = {each.name: each for each in dataset.trajectories}
    return any(
        difference(by_name[each.repeats], each) > _SAME
        for each in dataset.trajectories
        if each.repeats
    )


def answered_noise(
    dataset: Dataset, nominal: Rollouts, cut: Cut, block: float, starts: Float64, rounding: Float64
) -> Answered | None:
    """Return the noise floor beyond first states; None of recordings too short for parts.

    Args:
        dataset: the recordings.
        nominal: the arm.
        cut: says how recordings are replayed in parts.
        block: what residuals are averaged over (s).
        starts: float64[2, J], standard deviations of first states.
        rounding: float64[J], what an encoder's steps hide (rad, m).
    """
    by_name = {each.name: each for each in dataset.trajectories}
    found: list[tuple[Float64, Float64]] = []
    for second in dataset.trajectories:
        if second.repeats:
            first = by_name[second.repeats]
            found += _differences(first, second, cut, nominal, block, dataset.has_tracker)
    if not found:
        return None
    level = np.full(found[0][0].shape[1], _TINY)
    left: list[Float64] = []
    for _ in range(_ROUNDS):
        unit = level[:, None]
        left = [
            level * Doubt.of(columns * starts.ravel() / unit).without(off / level)
            for off, columns in found
        ]
        level = np.maximum(_level_of(left), _TINY)
    correlation = _correlation_of(left)
    parts = [off for off, _ in found]
    usual = OF_PAIR * np.sqrt(np.mean(np.concatenate(parts) ** 2, axis=0))
    usual = np.maximum(usual, _TINY)
    least = np.zeros_like(usual)
    least[: len(rounding)] = rounding / usual[: len(rounding)]
    drift = drift_of([each / usual for each in parts], OF_PAIR, least)
    if drift is None:
        return Answered(level, correlation)
    return Answered(usual, correlation, drift.of_pushes(), max(len(each) for each in parts))


def _level_of(parts: Sequence[Float64]) -> Float64:
    """Return float64[C]; a part in which something happened has no more of a say than others.

    What friction holds is moved by nothing, and what slides by all that pushes it: parts differ.
    """
    power = np.stack([np.mean(each**2, axis=0) for each in parts])
    usual = np.median(power, axis=0)
    return OF_PAIR * np.sqrt(np.mean(np.minimum(power, _LOUD * usual), axis=0))


def _correlation_of(parts: Sequence[Float64]) -> Float64:
    """Return float64[C], of neighbouring blocks."""
    moved = np.sum([np.sum(each[1:] * each[:-1], axis=0) for each in parts], axis=0)
    own = np.sum([0.5 * np.sum(each[1:] ** 2 + each[:-1] ** 2, axis=0) for each in parts], axis=0)
    return np.clip(moved / np.maximum(own, 1e-30), 0.0, 0.99)


def _differences(
    first: Trajectory, second: Trajectory, cut: Cut, nominal: Rollouts, block: float,
    is_tracked: bool,
) -> Iterable[tuple[Float64, Float64]]:  # fmt: skip
    """Return what each part and its repeat differ by, float64[B, C], and first states with it.

    The latter are float64[B, C, K], what a part is off by where its first state is.
    """
    spans = spans_of(first, cut)
    spans = spans[spans[:, 1] <= second.joints_at[-1]]
    if not len(spans):
        return []
    step = nominal.plant.timestep
    ones, others = (parts_at(0, each, spans, cut, step) for each in (first, second))
    errors = start_errors(nominal, [each.recorded for each in ones], as_it_is)
    off = [_off(each, nominal, block, is_tracked) for each in (ones, others)]
    out: list[tuple[Float64, Float64]] = []
    for one, left, right, error in zip(ones, *off, errors, strict=True):
        rows = min(len(left), len(right))
        tracker = error.tracker if is_tracked else None
        columns = _means(one.recorded, error.joints, tracker, block)
        out.append((left[:rows] - right[:rows], columns[:rows]))
    return out


def _off(
    parts: Sequence[Segment], nominal: Rollouts, block: float, is_tracked: bool
) -> list[Float64]:
    """Return float64[B, C] of each part, block means of what the nominal arm is off by."""
    out: list[Float64] = []
    for part, found in zip(
        parts, nominal.run([(as_it_is, part.recorded) for part in parts]), strict=True
    ):
        tracker = None
        if is_tracked and part.tracker is not None and found.tracker is not None:
            tracker = np.nan_to_num(pose_error(part.tracker, found.tracker))
        out.append(_means(part.recorded, np.nan_to_num(part.q - found.q), tracker, block))
    return out


def _means(of: Recorded, joints: Float64, tracker: Float64 | None, block: float) -> Float64:
    """Return float64[B, C, ...], block means of joints float64[T, J, ...], and of the tracker."""
    out = block_means(of.joints_at, joints, block)
    if tracker is None or of.tracker_at is None:
        return out
    return beside(out, block_means(of.tracker_at, tracker, block))
