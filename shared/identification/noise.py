"""The noise floor: how far two recordings of the same commands differ.

Half the mean square of the difference of repeats, of the block means that residuals are made of.
It has everything that a model cannot know: sensors, and whatever pushes the arm at random. It is
never less than what an encoder's steps hide: of a joint at rest two recordings may say the same
to the last digit.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from shared.identification.dataset.resolution import steps_of
from shared.identification.dataset.types import Dataset, Float64, Trajectory
from shared.identification.pushed import Pushed, pushed_of, whitening
from shared.identification.smoothing import smooth
from shared.identification.starts import Starts
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.signals import pose_error, sampled, sampled_poses

_BAND = 25
"""Without repeats: readings that a local cubic is taken through."""
_STRETCH = 25
"""Blocks whose power is looked at together."""
_FEWEST = 10
"""Readings that two recordings have to share, else the last of the shorter one is held."""
_ROUND = np.sqrt(12.0)
"""A step, in standard deviations of what rounding to it does."""
_SAMPLES = 200
"""Of simulated noise, to learn what leaving out the noisiest stretches takes off."""


@dataclass(frozen=True)
class Noise:
    """Standard deviations of block means."""

    joints: Float64
    """float64[J] (rad, m)."""
    tracker: Float64 | None
    """float64[6] (m, rad)."""
    correlation: Float64
    """float64[C], of neighbouring blocks, joints first."""
    is_measured: bool
    """Whether repeats were there; else only what is faster than the arm was seen."""
    pushed: Pushed | None = None
    """Where a controller holds the tool alone: what joints differ by otherwise."""
    whitened: Float64 | None = None
    """float64[J], standard deviations of whitened residuals (1)."""

    def floors(self, residuals: Float64, whiten: Float64 | None) -> Float64:
        """Return residuals of joints in noise floors.

        Args:
            residuals: float64[B, J], block means (rad, m).
            whiten: float64[B, J, J], from :meth:`whitening`.
        """
        if whiten is None or self.whitened is None:
            return residuals / self.joints
        return np.einsum("bij,bj->bi", whiten, residuals) / self.whitened

    def whitening(self, nominal: Rollouts, q: Float64) -> Float64 | None:
        """Return what :meth:`floors` needs of an arm at postures float64[B, J]; None for most."""
        return None if self.pushed is None else whitening(self.pushed, nominal, q)


@dataclass(frozen=True)
class Difference:
    """What a recording and its repeat differ by, as block means."""

    joints: Float64
    """float64[B, J] (rad, m)."""
    tracker: Float64 | None
    """float64[B', 6] (m, rad)."""
    q: Float64
    """float64[B, J], where the joints were (rad, m)."""


def noise_of(
    dataset: Dataset, block: float, starts: Starts, nominal: Rollouts | None = None
) -> Noise:
    """Return the noise floor of a data set.

    Args:
        dataset: the recordings; those with ``repeats`` are compared with what they repeat.
        block: what residuals are averaged over (s).
        starts: what repeats differ by for starting elsewhere.
        nominal: the arm; None for one that is held by its joints.
    """
    pairs = repeat_differences(dataset, block, starts)
    joints = [each.joints for each in pairs]
    tracker = [each.tracker for each in pairs if each.tracker is not None]
    if pairs:
        scale = np.sqrt(0.5)
    else:
        joints = [block_means(each.joints_at, _fast(each.joints_at, each.q), block)
                  for each in dataset.trajectories]  # fmt: skip
        tracker = [
            block_means(each.tracker_at, _fast(each.tracker_at, each.tracker), block)
            for each in dataset.trajectories
            if each.tracker_at is not None and each.tracker is not None
        ]
        scale = 1.0
    of_joints, joint_correlation = _floor(joints, scale)
    of_joints = np.maximum(of_joints, steps_of([each.q for each in dataset.trajectories]) / _ROUND)
    of_tracker, correlation = None, joint_correlation
    if dataset.has_tracker and tracker:
        of_tracker, tracker_correlation = _floor(tracker, scale)
        if not pairs:  # poses have seven numbers, their errors six
            of_tracker = np.r_[of_tracker[:3], np.repeat(2.0 * of_tracker[4:].mean(), 3)]
            tracker_correlation = tracker_correlation[:6]
        correlation = np.r_[joint_correlation, tracker_correlation]
    found = Noise(of_joints, of_tracker, correlation, is_measured=bool(pairs))
    differences = [(each.joints, each.q) for each in pairs]
    pushed = None if nominal is None else pushed_of(nominal, differences, scale)
    if nominal is None or pushed is None:
        return found
    unit = replace(found, pushed=pushed, whitened=np.ones(len(of_joints)))
    whole = [unit.floors(each.joints, unit.whitening(nominal, each.q)) for each in pairs]
    _, correlation = _floor(whole, scale)
    whitened = scale * np.sqrt(np.mean(np.concatenate(whole) ** 2, axis=0))
    correlation = np.r_[correlation, found.correlation[len(whitened) :]]
    return replace(unit, whitened=whitened, correlation=correlation)


def repeat_differences(dataset: Dataset, block: float, starts: Starts) -> list[Difference]:
    """Return what repeats differ by.

    The variance of a difference is twice that of the noise. What follows from where they started
    is taken off.
    """
    by_name = {each.name: each for each in dataset.trajectories}
    return [
        _difference(by_name[each.repeats], each, block, starts)
        for each in dataset.trajectories
        if each.repeats
    ]


def _difference(first: Trajectory, second: Trajectory, block: float, starts: Starts) -> Difference:
    joints = block_means(first.joints_at, _against(first, second, starts), block)
    tracker = None
    if first.tracker_at is not None and second.tracker_at is not None:
        tracker = block_means(first.tracker_at, _tracker_against(first, second, starts), block)
        tracker = tracker[np.isfinite(tracker).all(axis=1)]
    q = block_means(first.joints_at, first.q, block)[: len(joints)]
    is_known = np.isfinite(joints).all(axis=1)
    return Difference(joints[is_known], tracker, q[is_known])


def _against(first: Trajectory, second: Trajectory, starts: Starts) -> Float64:
    at = first.joints_at
    inside = at <= second.joints_at[-1]
    out = first.q - sampled(second.joints_at, second.q, at)
    if (apart := starts.get(second.name)) is not None:
        out = out - apart.joints
    return out[inside] if inside.sum() > _FEWEST else out


def _tracker_against(first: Trajectory, second: Trajectory, starts: Starts) -> Float64:
    assert first.tracker_at is not None
    assert first.tracker is not None
    assert second.tracker_at is not None
    assert second.tracker is not None
    other = sampled_poses(second.tracker_at, second.tracker, first.tracker_at)
    out = pose_error(first.tracker, other)
    apart = starts.get(second.name)
    if apart is not None and apart.tracker is not None:
        out = out - apart.tracker
    inside = first.tracker_at <= second.tracker_at[-1]
    return out[inside] if inside.sum() > _FEWEST else out


def _fast(at: Float64, values: Float64) -> Float64:
    """Return what a local quadratic leaves: faster than the arm moves."""
    width = min(_BAND, (len(at) - 1) // 2 * 2 - 1)
    return values - smooth(values, max(width, 5))


def block_means(at: Float64, values: Float64, block: float) -> Float64:
    """Return float64[B, D]: means over blocks that follow each other from the first instant.

    Args:
        at: float64[T] (s), rising.
        values: float64[T', D] of the first T' instants.
        block: length (s); one without a reading is left out.
    """
    number = np.floor((at[: len(values)] - at[0]) / block + 1e-6).astype(np.int64)
    starts = np.flatnonzero(np.r_[True, np.diff(number) > 0])
    counts = np.diff(np.r_[starts, len(values)])[:, None]
    return np.add.reduceat(values, starts, axis=0) / counts


def _floor(parts: list[Float64], scale: float) -> tuple[Float64, Float64]:
    """Return standard deviations and neighbours' correlations, by column.

    A stretch in which repeats part company (contact, a singular posture) would hide everything, so
    the floor is taken from the stretches of 0.5 s without their noisiest fifth, and so are the
    correlations: what parts slowly correlates like nothing else.
    """
    stretches = [
        part[begin : begin + _STRETCH]
        for part in parts
        for begin in range(0, max(len(part) - _STRETCH + 1, 1), _STRETCH)
    ]
    power = np.array([np.mean(stretch**2, axis=0) for stretch in stretches])
    pairs = [np.stack([stretch[1:], stretch[:-1]]) for stretch in stretches]
    moved = np.array([np.prod(pair, axis=0).mean(axis=0) for pair in pairs])
    total = np.array([np.mean(pair**2, axis=(0, 1)) for pair in pairs])
    shared = _quieter(moved, power) / np.maximum(_quieter(total, power), 1e-30)
    correlation = np.clip(shared, 0.0, 0.99)
    variance = _quieter(power, power) / _lost(float(correlation.mean()), len(power))
    return scale * np.sqrt(np.maximum(variance, 1e-16)), correlation


def _quieter(values: Float64, power: Float64) -> Float64:
    """Return the mean over stretches without the noisiest fifth: float64[D] of float64[S, D]."""
    count = max(int(np.ceil(0.8 * len(power))), 1)
    kept = np.argsort(power, axis=0, kind="stable")[:count]
    return np.take_along_axis(values, kept, axis=0).mean(axis=0)


@cache
def _lost(correlation: float, stretches: int) -> float:
    """Return which share of the power that leaves of noise that is the same everywhere."""
    rng = np.random.default_rng(0)
    noise = np.empty((_STRETCH, stretches, _SAMPLES))
    noise[0] = rng.standard_normal((stretches, _SAMPLES))
    for index in range(1, _STRETCH):
        fresh = rng.standard_normal((stretches, _SAMPLES))
        noise[index] = correlation * noise[index - 1] + np.sqrt(1 - correlation**2) * fresh
    power = np.mean(noise**2, axis=0)
    return float(_quieter(power, power).mean())
