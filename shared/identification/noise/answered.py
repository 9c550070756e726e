"""The noise floor of an arm under torques that answer what happens to it.

Given twice, such commands are not the same: a controller that is not in the model sent them. How
noise grows in a part cannot be told from that, as what pushes an arm is in its commands a moment
later. What is left of a part beyond what its first state may be off by does not grow much, and
what repeats differ by of that is the noise floor.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from shared.identification.arm.parts import Cut, part_of, spans_of, states_of
from shared.identification.arm.start_errors import across, as_it_is, directions, start_errors
from shared.identification.dataset.programmes import difference
from shared.identification.dataset.types import Dataset, Float64, Trajectory
from shared.identification.noise.blocks import block_means
from shared.sim.plant.replay import Recorded
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.signals import pose_error

_SAME = 1e-3
"""Share of their movement by which commands differ that are the same but for rounding."""
_OF_PAIR = np.sqrt(0.5)
"""Of what two recordings differ by, that is the noise of one."""
_LOUD = 4.0
"""Times the usual power, from which a part has no more of a say than that."""


@dataclass(frozen=True)
class Answered:
    """What repeats differ by beyond first states."""

    levels: Float64
    """float64[C], standard deviations of block means, joints first (rad, m)."""
    correlation: Float64
    """float64[C], of neighbouring blocks."""


@dataclass(frozen=True)
class _Part:
    """A part of a recording, or of its repeat."""

    recorded: Recorded
    q: Float64
    """float64[T, J], as logged (rad, m)."""
    tracker: Float64 | None
    """float64[K, 7]."""


def answers(dataset: Dataset) -> bool:
    """Return whether commands answer what happens: given twice, they are not quite the same."""
    by_name = {each.name: each for each in dataset.trajectories}
    return any(
        difference(by_name[each.repeats], each) > _SAME
        for each in dataset.trajectories
        if each.repeats
    )


def answered_noise(dataset: Dataset, nominal: Rollouts, cut: Cut, block: float) -> Answered | None:
    """Return the noise floor beyond first states; None of recordings too short for parts.

    Args:
        dataset: the recordings.
        nominal: the arm.
        cut: says how recordings are replayed in parts.
        block: what residuals are averaged over (s).
    """
    by_name = {each.name: each for each in dataset.trajectories}
    found: list[tuple[Float64, Float64]] = []
    for second in dataset.trajectories:
        if second.repeats:
            found += _differences(by_name[second.repeats], second, cut, nominal, block)
    if not found:
        return None
    unit = np.sqrt(np.mean(np.concatenate([off for off, _ in found]) ** 2, axis=0)) + 1e-12
    left = [
        unit * across(off / unit, directions((columns / unit[:, None]).reshape(off.size, -1)))
        for off, columns in found
    ]
    return Answered(_level_of(left), _correlation_of(left))


def _level_of(parts: Sequence[Float64]) -> Float64:
    """Return float64[C]; a part in which something happened has no more of a say than others.

    What friction holds is moved by nothing, and what slides by all that pushes it: parts differ.
    """
    power = np.stack([np.mean(each**2, axis=0) for each in parts])
    usual = np.median(power, axis=0)
    return _OF_PAIR * np.sqrt(np.mean(np.minimum(power, _LOUD * usual), axis=0))


def _correlation_of(parts: Sequence[Float64]) -> Float64:
    """Return float64[C], of neighbouring blocks."""
    moved = np.sum([np.sum(each[1:] * each[:-1], axis=0) for each in parts], axis=0)
    own = np.sum([0.5 * np.sum(each[1:] ** 2 + each[:-1] ** 2, axis=0) for each in parts], axis=0)
    return np.clip(moved / np.maximum(own, 1e-30), 0.0, 0.99)


def _differences(
    first: Trajectory, second: Trajectory, cut: Cut, nominal: Rollouts, block: float
) -> Iterable[tuple[Float64, Float64]]:
    """Return what each part and its repeat differ by, float64[B, C], and first states with it.

    The latter are float64[B, C, K], what a part is off by where its first state is.
    """
    spans = spans_of(first, cut)
    spans = spans[spans[:, 1] <= second.joints_at[-1]]
    if not len(spans):
        return []
    ones, others = (_parts(each, spans, nominal, cut) for each in (first, second))
    errors = start_errors(nominal, [each.recorded for each in ones])
    off = [_off(each, nominal, block) for each in (ones, others)]
    out: list[tuple[Float64, Float64]] = []
    for one, left, right, error in zip(ones, *off, errors, strict=True):
        at, rows = one.recorded.joints_at, min(len(left), len(right))
        columns = _means(at, error.joints, block)
        if error.tracker is not None and one.recorded.tracker_at is not None:
            seen = _means(one.recorded.tracker_at, error.tracker, block)
            columns = np.concatenate([columns[:rows], seen[:rows]], axis=1)
        out.append((left[:rows] - right[:rows], columns[:rows]))
    return out


def _parts(of: Trajectory, spans: Float64, nominal: Rollouts, cut: Cut) -> list[_Part]:
    states = states_of(of, spans[:, 0], nominal.plant.timestep, cut)
    out: list[_Part] = []
    for (begin, end), state in zip(spans, states, strict=True):
        recorded, joints, tracker = part_of(of, float(begin), float(end), state)
        poses = None if of.tracker is None or not len(tracker) else of.tracker[tracker]
        out.append(_Part(recorded, of.q[joints], poses))
    return out


def _off(parts: Sequence[_Part], nominal: Rollouts, block: float) -> list[Float64]:
    """Return float64[B, C] of each part, block means of what the nominal arm is off by."""
    out: list[Float64] = []
    for part, found in zip(
        parts, nominal.run([(as_it_is, part.recorded) for part in parts]), strict=True
    ):
        off = block_means(part.recorded.joints_at, np.nan_to_num(part.q - found.q), block)
        at = part.recorded.tracker_at
        if at is not None and part.tracker is not None and found.tracker is not None:
            seen = block_means(at, np.nan_to_num(pose_error(part.tracker, found.tracker)), block)
            rows = min(len(off), len(seen))
            off = np.concatenate([off[:rows], seen[:rows]], axis=1)
        out.append(off)
    return out


def _means(at: Float64, columns: Float64, block: float) -> Float64:
    """Return float64[B, C, K], block means of columns float64[T, C, K]."""
    count = columns.shape[1:]
    return block_means(at, columns.reshape(len(columns), -1), block).reshape(-1, *count)
