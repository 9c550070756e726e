"""The noise floor: how far two recordings of the same commands differ.

Half the mean square of the difference of repeats, of the block means that residuals are made of.
It has everything that a model cannot know: sensors, and whatever pushes the arm at random. It is
never less than what an encoder's steps hide: of a joint at rest two recordings may say the same
to the last digit.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from shared.identification.arm.parts import CUTS, Cut, spans_of, states_doubt
from shared.identification.arm.smoothing import smooth
from shared.identification.arm.starts import Starts
from shared.identification.dataset.resolution import steps_of
from shared.identification.dataset.types import Dataset, Float64, Trajectory
from shared.identification.noise.answered import answered_noise, answers
from shared.identification.noise.blocks import block_means
from shared.identification.noise.drift import Drift, drift_of
from shared.identification.noise.memory import Memory, memory_of, wandering
from shared.identification.noise.pushed import Pushed, pushed_of, whitening
from shared.identification.noise.quiet import OF_PAIR, level_of
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.signals import pose_error, sampled, sampled_poses

Integers = NDArray[np.intp]

_BAND = 25
"""Without repeats: readings that a local cubic is taken through."""
_FEWEST = 10
"""Readings that two recordings have to share, else the last of the shorter one is held."""
_AXES = (slice(0, 3), slice(3, 6))
"""Of a tracker's error: how far off it is along each, and about each."""
_ROUND = np.sqrt(12.0)
"""A step, in standard deviations of what rounding to it does."""


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
    memory: Memory | Drift | None = None
    """How much of it is carried on from block to block, or how it grows where nothing holds the
    arm; None where no repeat says so, and nothing else does."""
    torque: Float64 | None = None
    """float64[J], of the torques that joints lack (N m, N), where residuals are these and not what
    was read, see :mod:`shared.identification.fitting.lacking`."""
    start_doubt: Float64 | None = None
    """float64[2, J], standard deviations of a part's first positions (rad, m) and speeds (rad/s,
    m/s), where residuals are without what they may be off by, see
    :mod:`shared.identification.arm.start_errors`."""

    @property
    def has_free_starts(self) -> bool:
        """Return whether residuals are without what a part's first state may be off by."""
        return self.start_doubt is not None

    @property
    def is_torque(self) -> bool:
        """Return whether residuals are torques that the model lacks, not readings."""
        return self.torque is not None

    @property
    def is_adrift(self) -> bool:
        """Return whether it grows from the start of a part, since nothing holds the arm."""
        return isinstance(self.memory, Drift)

    @property
    def is_white(self) -> bool:
        """Return whether what is new in each block is known to be noise, as repeats say."""
        return self.is_measured and self.memory is not None

    def floors(self, residuals: Float64, whiten: Float64 | None) -> Float64:
        """Return residuals of joints in noise floors.

        Args:
            residuals: float64[B, J], block means (rad, m).
            whiten: float64[B, J, J], from :meth:`whitening`.
        """
        if whiten is None or self.whitened is None:
            return residuals / self.joints
        return np.einsum("bij,bj->bi", whiten, residuals) / self.whitened

    def news(self, residuals: Float64) -> Float64:
        """Return what is new in each block of residuals in noise floors: float64[B, C].

        All of it where nothing is known of what noise carries on, see :class:`Memory`.
        """
        return residuals if self.memory is None else self.memory.news(residuals)

    def growing(self, drift: Drift, blocks: int) -> "Noise":
        """Return the same of an arm that nothing holds.

        Args:
            drift: how noise grows, in these noise floors.
            blocks: of a part; over so many its mean square becomes 1.
        """
        size = np.sqrt(np.mean(drift.spread(blocks) ** 2, axis=0))
        count = len(self.joints)
        return replace(
            self,
            joints=self.joints * size[:count],
            tracker=None if self.tracker is None else self.tracker * size[count:],
            memory=drift.scaled(size),
        )

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
    joints_parts: Integers
    """int[B], of which part of the recording each is."""
    tracker_parts: Integers | None
    """int[B']."""


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
    rounding = steps_of([each.q for each in dataset.trajectories]) / _ROUND
    doubt = None if nominal is None else _doubt(dataset, nominal, rounding)
    if nominal is not None and doubt is not None:
        answered = _answered(dataset, nominal, rounding, block, doubt)
        if answered is not None:
            return answered
    cut = None if nominal is None else CUTS.get(nominal.plant.control)
    pairs = repeat_differences(dataset, block, starts, cut)
    joints = [each.joints for each in pairs]
    tracker = [each.tracker for each in pairs if each.tracker is not None]
    if pairs:
        scale = OF_PAIR
    else:
        joints = [block_means(each.joints_at, _fast(each.joints_at, each.q), block)
                  for each in dataset.trajectories]  # fmt: skip
        tracker = [
            block_means(each.tracker_at, _fast(each.tracker_at, each.tracker), block)
            for each in dataset.trajectories
            if each.tracker_at is not None and each.tracker is not None
        ]
        scale = 1.0
    of_joints, joint_correlation = level_of(joints, scale)
    of_joints = np.maximum(of_joints, rounding)
    of_tracker, correlation = None, joint_correlation
    if dataset.has_tracker and tracker:
        of_tracker, tracker_correlation = level_of(tracker, scale)
        if not pairs:  # poses have seven numbers, their errors six
            of_tracker = np.r_[of_tracker[:3], np.repeat(2.0 * of_tracker[4:].mean(), 3)]
            tracker_correlation = tracker_correlation[:6]
        correlation = np.r_[joint_correlation, tracker_correlation]
    found = Noise(
        of_joints, of_tracker, correlation, is_measured=bool(pairs),
        start_doubt=None if pairs else doubt,
    )  # fmt: skip
    differences = [(each.joints, each.q) for each in pairs]
    pushed = None if nominal is None else pushed_of(nominal, differences, scale)
    if not pairs:
        return found
    hidden = rounding / of_joints
    if nominal is not None and pushed is not None:
        unit = replace(found, pushed=pushed, whitened=np.ones(len(of_joints)))
        whole = [unit.floors(each.joints, unit.whitening(nominal, each.q)) for each in pairs]
        _, correlation = level_of(whole, scale)
        whitened = scale * np.sqrt(np.mean(np.concatenate(whole) ** 2, axis=0))
        correlation = np.r_[correlation, found.correlation[len(whitened) :]]
        found = replace(unit, whitened=whitened, correlation=correlation)
        hidden = np.zeros(len(whitened))
    doubt = None
    if nominal is not None and nominal.plant.control == "torque":
        doubt = states_doubt(dataset.trajectories, rounding, CUTS["torque"])
    return _remembered(found, pairs, nominal, hidden, doubt, block)


def _remembered(
    noise: Noise,
    pairs: Sequence[Difference],
    nominal: Rollouts | None,
    rounding: Float64,
    doubt: Float64 | None,
    block: float,
) -> Noise:
    """Return the noise with how much of it is carried on, or how it grows.

    Args:
        noise: its floor.
        pairs: what repeats differ by.
        nominal: the arm; None for one that is held by its joints.
        rounding: float64[J], what an encoder's steps hide, in noise floors.
        doubt: float64[2, J], how well first states are known (rad, m; rad/s, m/s): what a motion
            that is no polynomial makes of them is the same each time, so that no repeat tells.
        block: what residuals are averaged over (s).
    """
    joints: list[Float64] = []
    tracker: list[Float64] = []
    for each in pairs:
        whiten = None if nominal is None else noise.whitening(nominal, each.q)
        joints += _split(noise.floors(each.joints, whiten), each.joints_parts)
        if noise.tracker is None or each.tracker is None or each.tracker_parts is None:
            continue
        tracker += _split(each.tracker / noise.tracker, each.tracker_parts)
    no_steps = np.zeros(0 if noise.tracker is None else len(noise.tracker))
    if nominal is not None and nominal.plant.control == "torque":
        drift = drift_of(joints, OF_PAIR, rounding)
        if drift is not None and doubt is not None:
            drift = drift.begun_as(doubt[0] / noise.joints, block * doubt[1] / noise.joints)
        seen = drift_of(tracker, OF_PAIR, no_steps) if tracker else None
        if drift is not None and (noise.tracker is None or seen is not None):
            blocks = max(len(each) for each in joints)
            return noise.growing(drift if seen is None else drift.beside(seen), blocks)
    found = memory_of(joints, OF_PAIR, rounding)
    if noise.tracker is not None:
        seen = memory_of(tracker, OF_PAIR, no_steps)
        found = found.beside(wandering(seen, tracker, OF_PAIR, _AXES))
    return replace(noise, memory=found)


def _doubt(dataset: Dataset, nominal: Rollouts, rounding: Float64) -> Float64 | None:
    """Return float64[2, J], how well first states are known where residuals are to be without them.

    None where a controller holds the arm, and where repeats of the same commands say how far apart
    parts come for having begun elsewhere.
    """
    if nominal.plant.control != "torque":
        return None
    if any(each.repeats for each in dataset.trajectories) and not answers(dataset):
        return None
    return states_doubt(dataset.trajectories, rounding, CUTS["torque"])


def _answered(
    dataset: Dataset, nominal: Rollouts, rounding: Float64, block: float, doubt: Float64
) -> Noise | None:
    """Return the noise beyond first states; None where nothing that is long enough repeats.

    Args:
        dataset: the recordings.
        nominal: the arm.
        rounding: float64[J], what an encoder's steps hide (rad, m).
        block: what residuals are averaged over (s).
        doubt: float64[2, J], standard deviations of first states.
    """
    found = answered_noise(dataset, nominal, CUTS["torque"], block, doubt, rounding)
    if found is None:
        return None
    count = len(rounding)
    noise = Noise(
        joints=np.maximum(found.levels[:count], rounding),
        tracker=found.levels[count:] if dataset.has_tracker else None,
        correlation=found.correlation,
        is_measured=True,
        start_doubt=doubt,
    )
    return noise if found.drift is None else noise.growing(found.drift, found.blocks)


def _split(values: Float64, parts: Integers) -> list[Float64]:
    """Return the rows of each part by themselves."""
    return np.split(values, np.flatnonzero(np.diff(parts)) + 1)


def repeat_differences(
    dataset: Dataset, block: float, starts: Starts, cut: Cut | None = None
) -> list[Difference]:
    """Return what repeats differ by.

    The variance of a difference is twice that of the noise. What follows from where they started
    is taken off.
    """
    by_name = {each.name: each for each in dataset.trajectories}
    return [
        _difference(by_name[each.repeats], each, block, starts, cut)
        for each in dataset.trajectories
        if each.repeats
    ]


def _difference(
    first: Trajectory, second: Trajectory, block: float, starts: Starts, cut: Cut | None
) -> Difference:
    spans = np.zeros((0, 2)) if cut is None else spans_of(first, cut)
    if not len(spans):
        spans = np.array([[-np.inf, np.inf]])
    off = _against(first, second, starts)
    beside_it = np.concatenate([off, first.q[: len(off)]], axis=1)
    both, parts = _in_parts(first.joints_at, beside_it, spans, block)
    joints, q = np.split(both, 2, axis=1)
    found = Difference(joints, None, q, parts, None)
    if first.tracker_at is None or second.tracker_at is None:
        return found
    off = _tracker_against(first, second, starts)
    tracker, parts = _in_parts(first.tracker_at, off, spans, block)
    return replace(found, tracker=tracker, tracker_parts=parts)


def _in_parts(
    at: Float64, values: Float64, spans: Float64, block: float
) -> tuple[Float64, Integers]:
    """Return float64[B, D], block means as residuals have them, and int[B], of which part each is.

    Args:
        at: float64[T] (s), rising.
        values: float64[T', D] of the first T' instants; blocks with one that is NaN are left out.
        spans: float64[P, 2], when parts begin and end (s): blocks are counted from there.
        block: length (s).
    """
    at = at[: len(values)]
    found: list[Float64] = []
    for begin, end in spans:
        inside = (at >= begin) & (at < end)
        if inside.any():
            means = block_means(at[inside], values[inside], block)
            found.append(means[np.isfinite(means).all(axis=1)])
        else:
            found.append(values[:0])
    return np.concatenate(found), np.repeat(np.arange(len(found)), [len(each) for each in found])


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
