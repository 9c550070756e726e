"""What a recording programme may do to an arm, and how much of that a motion takes."""

import dataclasses
from dataclasses import dataclass

import numpy as np

from shared.identification.dataset.types import Float64
from shared.sim.plant.poses import rotated
from shared.sim.plant.signals import pose_error

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Blade:
    """What the tool carries: a capsule on a line through the tool's origin."""

    direction: Vector
    """Of its axis in the tool's frame, unit length."""
    front: float
    """Where the axis ends, from the tool (m)."""
    back: float
    """Where it begins; negative behind the tool (m)."""
    radius: float
    """(m)."""


@dataclass(frozen=True)
class ToolLimits:
    """Where the tool may be told to go and how fast, in the frame of its commands."""

    box_low: Vector
    """(m)."""
    box_high: Vector
    """(m)."""
    speed: float = np.inf
    """(m/s)."""
    acceleration: float = np.inf
    """(m/s^2)."""
    turn_speed: float = np.inf
    """(rad/s)."""
    turn_acceleration: float = np.inf
    """(rad/s^2)."""
    lead: float = np.inf
    """Furthest that a command may be from where the tool is (m)."""
    turn_lead: float = np.inf
    """The same of the orientation (rad)."""
    ceiling: float = np.inf
    """Highest point of the blade (m)."""
    keep_out: tuple[float, float] = (0.0, 0.0)
    """Where a person stands, x and y: axis of a cylinder that the blade stays out of (m)."""
    keep_out_radius: float = 0.0
    """Of that cylinder (m); 0 is nobody."""
    blade: Blade | None = None

    def clearance(self, poses: Float64) -> Float64:
        """Return float64[T], how far poses are from the nearest limit (m); negative outside.

        Args:
            poses: float64[T, 7].
        """
        at = poses[:, :3]
        inside = np.minimum(at - self.box_low, np.asarray(self.box_high) - at).min(axis=1)
        if self.blade is None:
            return inside
        along = rotated(poses[:, 3:], np.asarray(self.blade.direction))
        front, back = at + self.blade.front * along, at + self.blade.back * along
        below = self.ceiling - np.maximum(front[:, 2], back[:, 2]) - self.blade.radius
        return np.minimum(np.minimum(inside, below), self._from_person(front, back))

    def _from_person(self, front: Float64, back: Float64) -> Float64:
        """Return float64[T], the gap between blade and cylinder, seen from above (m)."""
        if self.blade is None or self.keep_out_radius <= 0.0:
            return np.full(len(front), np.inf)
        way = front[:, :2] - back[:, :2]
        to_axis = np.asarray(self.keep_out) - back[:, :2]
        square = np.maximum(np.einsum("ti,ti->t", way, way), 1e-12)
        share = np.clip(np.einsum("ti,ti->t", to_axis, way) / square, 0.0, 1.0)
        gap = np.linalg.norm(share[:, None] * way - to_axis, axis=1)
        return gap - self.keep_out_radius - self.blade.radius


@dataclass(frozen=True)
class Limits:
    """Everything a programme keeps to."""

    low: Float64
    """float64[J] (rad, m); -inf where a joint turns without end."""
    high: Float64
    """float64[J] (rad, m)."""
    speed: Float64
    """float64[J] (rad/s, m/s)."""
    acceleration: Float64
    """float64[J] (rad/s^2, m/s^2)."""
    effort: Float64
    """float64[J], largest torque of each joint (N m, N); inf where unknown."""
    tool: ToolLimits | None = None
    effort_share: float = 0.8
    """Of a torque limit: more than this only for ``effort_seconds`` at a time."""
    effort_seconds: float = 0.1
    """(s)."""

    def within(self, share: float) -> "Limits":
        """Return limits of speed and acceleration that are a share of these; places stay."""
        tool = self.tool and dataclasses.replace(
            self.tool,
            speed=share * self.tool.speed,
            acceleration=share * self.tool.acceleration,
            turn_speed=share * self.tool.turn_speed,
            turn_acceleration=share * self.tool.turn_acceleration,
        )
        return dataclasses.replace(
            self, speed=share * self.speed, acceleration=share * self.acceleration, tool=tool
        )


def is_inside(limits: Limits, q: Float64, poses: Float64, margin: float = 0.0) -> bool:
    """Return whether a motion stays where it may: float64[T, J] and float64[T, 7]."""
    if np.any(q < limits.low) or np.any(q > limits.high):
        return False
    return limits.tool is None or float(limits.tool.clearance(poses).min()) >= margin


def hurry(limits: Limits, q: Float64, poses: Float64, period: float) -> float:
    """Return how many times slower a motion has to be to be slow enough; up to 1 if it is.

    Speeds go with the pace and accelerations with its square, so that the answer is exact.

    Args:
        limits: of speed and acceleration.
        q: float64[T, J], what is commanded of the joints.
        poses: float64[T, 7], what is commanded of the tool.
        period: between instants (s).
    """
    speed = np.diff(q, axis=0) / period
    found = [
        _most(np.abs(speed) / limits.speed),
        _most(np.abs(np.diff(speed, axis=0)) / period / limits.acceleration) ** 0.5,
    ]
    if limits.tool is not None:
        found.append(tool_hurry(limits.tool, poses, period))
    return float(max(found))


def tool_hurry(tool: ToolLimits, poses: Float64, period: float) -> float:
    """Return how many times slower poses float64[T, 7] have to be, as ``hurry`` does."""
    found: list[float] = []
    step = pose_error(poses[1:], poses[:-1]) / period
    for part, most, sharpest in (
        (step[:, :3], tool.speed, tool.acceleration),
        (step[:, 3:], tool.turn_speed, tool.turn_acceleration),
    ):
        change = np.diff(part, axis=0) / period
        found.append(_most(np.linalg.norm(part, axis=1)) / most)
        found.append((_most(np.linalg.norm(change, axis=1)) / sharpest) ** 0.5)
    return max(found)


def strain(limits: Limits, efforts: Float64, period: float) -> Float64:
    """Return float64[J], how far efforts are from what is allowed: above 1 is too much.

    Args:
        limits: of effort.
        efforts: float64[T, J], at even instants (N m, N).
        period: between them (s).
    """
    shares = np.abs(efforts) / limits.effort
    window = max(round(limits.effort_seconds / period), 1)
    peak = shares.max(axis=0)
    if len(shares) < window:
        return peak
    # The share that is exceeded all through some window trips a gate.
    windows = np.lib.stride_tricks.sliding_window_view(shares, window, axis=0)
    return np.maximum(peak, windows.min(axis=-1).max(axis=0) / limits.effort_share)


def _most(values: Float64) -> float:
    return float(values.max(initial=0.0))
