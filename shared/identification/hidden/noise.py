"""What a recording has on top of what the robot did: coloured noise, slow drift, disturbances."""

from dataclasses import dataclass

import numpy as np

from shared.identification.dataset.types import Float64


@dataclass(frozen=True)
class NoiseLevels:
    """Standard deviations, and how long each remembers."""

    encoder: float = 0.3e-3
    """(rad, m)."""
    tracker_position: float = 0.9e-3
    """Of each axis (m)."""
    tracker_rotation: float = 2.0e-3
    """About each axis (rad)."""
    drift_position: float = 0.3e-3
    """Of the tracker, within about ten seconds (m)."""
    drift_rotation: float = 0.4e-3
    """(rad)."""
    torque: float = 0.004
    """Of a joint's largest torque, as a disturbance of it (1)."""
    initial: float = 0.1e-3
    """Of the posture that a recording says it began in (rad)."""
    encoder_memory: float = 0.02
    """(s)."""
    tracker_memory: float = 0.04
    """(s)."""
    drift_memory: float = 8.0
    """(s)."""
    torque_memory: float = 0.1
    """(s)."""

    @property
    def tracker(self) -> Float64:
        """Return float64[6], noise and drift together (m, rad)."""
        position = np.hypot(self.tracker_position, self.drift_position)
        rotation = np.hypot(self.tracker_rotation, self.drift_rotation)
        return np.array([position] * 3 + [rotation] * 3)


def coloured(
    count: int, columns: int, period: float, memory: float, rng: np.random.Generator
) -> Float64:
    """Return float64[count, columns] of unit variance, correlated as exp(-lag / memory).

    Args:
        count: of instants.
        columns: independent of each other.
        period: between instants (s).
        memory: (s).
        rng: what is drawn from.
    """
    keep = float(np.exp(-period / memory))
    drawn = rng.standard_normal((count, columns))
    drawn[1:] *= np.sqrt(1.0 - keep**2)
    for row in range(1, count):
        drawn[row] += keep * drawn[row - 1]
    return drawn


def disturbance(
    levels: NoiseLevels, torque: Float64, steps: int, timestep: float, rng: np.random.Generator
) -> Float64:
    """Return float64[steps, J]: torques that push the joints at random (N m).

    Args:
        levels: how much.
        torque: float64[J], the largest torque of each joint (N m).
        steps: of the physics.
        timestep: (s).
        rng: what is drawn from.
    """
    return (
        levels.torque * torque * coloured(steps, len(torque), timestep, levels.torque_memory, rng)
    )


def on_joints(levels: NoiseLevels, at: Float64, q: Float64, rng: np.random.Generator) -> Float64:
    """Return readings of the encoders: float64[T, J], at instants float64[T] (s)."""
    period = float(np.median(np.diff(at)))
    return q + levels.encoder * coloured(len(q), q.shape[1], period, levels.encoder_memory, rng)


def on_tracker(
    levels: NoiseLevels, at: Float64, poses: Float64, rng: np.random.Generator
) -> Float64:
    """Return what the tracker writes: float64[K, 7], at instants float64[K] (s)."""
    period = float(np.median(np.diff(at)))
    fast = coloured(len(poses), 6, period, levels.tracker_memory, rng)
    slow = coloured(len(poses), 6, period, levels.drift_memory, rng)
    fast[:, :3] *= levels.tracker_position
    fast[:, 3:] *= levels.tracker_rotation
    slow[:, :3] *= levels.drift_position
    slow[:, 3:] *= levels.drift_rotation
    out = poses.copy()
    out[:, :3] += fast[:, :3] + slow[:, :3]
    out[:, 3:] = turned(poses[:, 3:], fast[:, 3:] + slow[:, 3:])
    return out


def turned(quaternions: Float64, vectors: Float64) -> Float64:
    """Return float64[K, 4], each turned in its own frame by a rotation vector: float64[K, 3]."""
    angle = np.linalg.norm(vectors, axis=1)
    half = 0.5 * angle
    scale = 0.5 * np.sinc(half / np.pi)
    w2, x2, y2, z2 = np.cos(half), *(scale[:, None] * vectors).T
    w1, x1, y1, z1 = quaternions.T
    return np.stack(
        [
            w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2,
            w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2,
            w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
            w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2,
        ],
        axis=1,
    )
