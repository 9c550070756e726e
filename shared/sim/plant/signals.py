"""Signals over time: a command as a controller gets it, a pose as a tracker sees it."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from shared.sim.arm import Float64
from shared.sim.servo import CYCLE

_BETWEEN = 10
"""So many values of a smooth signal come where one came."""
POSE = 7
"""Numbers of a pose: position (m) and quaternion (w, x, y, z)."""


@dataclass(frozen=True, eq=False)
class Signal:
    """Values that each hold from their instant to the next; equal to itself alone."""

    at: Float64
    """float64[C] (s), rising."""
    values: Float64
    """float64[C, U]."""

    def held(self, at: Float64) -> Float64:
        """Return float64[T, U], the values in force at instants; the first one before its time."""
        index = np.searchsorted(self.at, at + 1e-9, side="right") - 1
        return self.values[np.maximum(index, 0)]

    def mean(self, at: Float64, span: float) -> Float64:
        """Return float64[T, U], the mean over a span from each instant on.

        A command that comes between two steps of the physics counts by how much of the step it
        is in force, so that a delay changes the motion smoothly.
        """
        ends = np.r_[self.at[1:], np.inf]
        index = np.maximum(np.searchsorted(self.at, at + 1e-9, side="right") - 1, 0)
        later = np.maximum(np.searchsorted(self.at, at + span - 1e-9, side="right") - 1, 0)
        share = np.clip((ends[index] - at) / span, 0.0, 1.0)[:, None]
        now, then = self.values[index], self.values[later]
        return np.where(index[:, None] == later[:, None], now, share * now + (1.0 - share) * then)

    def later(self, seconds: float) -> "Signal":
        """Return the signal delayed; fractions of a period count."""
        return Signal(self.at + seconds, self.values)


def instants(signal: Signal, period: float, begin: float, until: float) -> Float64:
    """Return float64[T], even ones from a begin, or a signal's own if later, past an end (s)."""
    first = max(begin, float(signal.at[0]))
    count = max(int((until - first) / period) + 2, 2)
    return first + period * np.arange(count, dtype=np.float64)


def filtered(signal: Signal, share: float, until: float) -> Signal:
    """Return what the PR2 controller's command filter makes of poses, once per 1 ms cycle.

    Args:
        signal: float64[C, 7] poses.
        share: of the remaining way per cycle (``pose_command_filter``), 1 is off.
        until: when the result may end (s).
    """
    if share >= 1.0:
        return signal
    at: Float64 = CYCLE * np.arange(int(until / CYCLE) + 2, dtype=np.float64)
    targets = signal.held(at)
    out = np.empty_like(targets)
    pose = targets[0]
    for begin, end in held_spans(targets):
        cycles: Float64 = np.arange(1, end - begin + 1, dtype=np.float64)
        covered: Float64 = 1.0 - (1.0 - share) ** cycles
        out[begin:end] = _between(pose, targets[begin], covered)
        pose = out[end - 1]
    return Signal(at, out)


def held_spans(values: Float64) -> list[tuple[int, int]]:
    """Return begin and end of the rows of float64[T, U] that are the same, one span after another.

    The end is the first row that is not in the span.
    """
    changes = np.flatnonzero(np.any(np.diff(values, axis=0) != 0.0, axis=1)) + 1
    return list(pairwise([0, *changes.tolist(), len(values)]))


def _between(start: Float64, end: Float64, shares: Float64) -> Float64:
    """Return float64[K, 7]: poses on the way from one to another, on the great arc."""
    out = start + shares[:, None] * (end - start)
    target = -end[3:] if start[3:] @ end[3:] < 0.0 else end[3:]
    angle = 2.0 * np.arctan2(np.linalg.norm(target - start[3:]), np.linalg.norm(target + start[3:]))
    if angle > 1e-6:
        out[:, 3:] = (
            np.sin((1.0 - shares) * angle)[:, None] * start[3:]
            + np.sin(shares * angle)[:, None] * target
        ) / np.sin(angle)
    else:
        out[:, 3:] = target
    return out


def sampled(at: Float64, values: Float64, wanted: Float64) -> Float64:
    """Return float64[K, D]: values between instants on a straight line; the ends hold."""
    index = np.clip(np.searchsorted(at, wanted, side="right") - 1, 0, len(at) - 2)
    span = at[index + 1] - at[index]
    share = np.clip((wanted - at[index]) / span, 0.0, 1.0)[:, None]
    return values[index] + share * (values[index + 1] - values[index])


def sampled_poses(at: Float64, poses: Float64, wanted: Float64) -> Float64:
    """Return float64[K, 7]: poses between instants; quaternions on the short way round."""
    index = np.clip(np.searchsorted(at, wanted, side="right") - 1, 0, len(at) - 2)
    share = np.clip((wanted - at[index]) / (at[index + 1] - at[index]), 0.0, 1.0)[:, None]
    start, end = poses[index], poses[index + 1].copy()
    end[:, 3:] *= np.where(np.einsum("ij,ij->i", start[:, 3:], end[:, 3:]) < 0.0, -1.0, 1.0)[
        :, None
    ]
    out = start + share * (end - start)
    out[:, 3:] /= np.linalg.norm(out[:, 3:], axis=1, keepdims=True)
    return out


def smoothed(signal: Signal, is_pose: bool) -> Signal:
    """Return values that move on straight lines, half a period late, as they are while they hold.

    Args:
        signal: its values come about as often all the time.
        is_pose: whether they are poses.
    """
    if len(signal.at) < 2:
        return signal
    every = float(np.median(np.diff(signal.at)))
    at = np.arange(signal.at[0], signal.at[-1] + every, every / _BETWEEN)
    line = sampled_poses if is_pose else sampled
    return Signal(at, line(signal.at + 0.5 * every, signal.values, at))


def pose_error(measured: Float64, predicted: Float64) -> Float64:
    """Return float64[K, 6]: measured less predicted, position (m) and rotation vector (rad)."""
    w, x, y, z = measured[:, 3:].T
    a, b, c, d = predicted[:, 3:].T
    # measured times the conjugate of predicted, its vector part
    scalar = w * a + x * b + y * c + z * d
    vector = np.stack(
        [
            -w * b + x * a - y * d + z * c,
            -w * c + y * a - z * b + x * d,
            -w * d + z * a - x * c + y * b,
        ],
        axis=1,
    )
    sign = np.where(scalar < 0.0, -1.0, 1.0)[:, None]
    return np.concatenate([measured[:, :3] - predicted[:, :3], 2.0 * sign * vector], axis=1)
