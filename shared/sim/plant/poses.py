"""Rigid motions of many poses at once; a pose is position (m) and unit quaternion (w, x, y, z)."""

import numpy as np

from shared.sim.arm import Float64


def product(one: Float64, other: Float64) -> Float64:
    """Return float64[..., 4], the rotation ``other`` followed by ``one``."""
    w, x, y, z = one[..., 0], one[..., 1], one[..., 2], one[..., 3]
    a, b, c, d = other[..., 0], other[..., 1], other[..., 2], other[..., 3]
    scalar = w * a - x * b - y * c - z * d
    out = np.empty((*scalar.shape, 4))
    out[..., 0] = scalar
    out[..., 1] = w * b + x * a + y * d - z * c
    out[..., 2] = w * c - x * d + y * a + z * b
    out[..., 3] = w * d + x * c - y * b + z * a
    return out


def conjugate(quaternions: Float64) -> Float64:
    """Return float64[..., 4], the rotations back."""
    return quaternions * np.array([1.0, -1.0, -1.0, -1.0])


def rotated(quaternions: Float64, vectors: Float64) -> Float64:
    """Return float64[..., 3], vectors turned by rotations."""
    axis = quaternions[..., 1:]
    twice = 2.0 * cross(axis, vectors)
    return vectors + quaternions[..., :1] * twice + cross(axis, twice)


def cross(one: Float64, other: Float64) -> Float64:
    """Return float64[..., 3], as ``np.cross`` does in a quarter of its time."""
    a, b, c = one[..., 0], one[..., 1], one[..., 2]
    x, y, z = other[..., 0], other[..., 1], other[..., 2]
    first = b * z - c * y
    out = np.empty((*first.shape, 3))
    out[..., 0] = first
    out[..., 1] = c * x - a * z
    out[..., 2] = a * y - b * x
    return out


def turn(vectors: Float64) -> Float64:
    """Return float64[..., 4], the rotations of rotation vectors (rad)."""
    half = 0.5 * np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * vectors], axis=-1)


def rotation_vectors(quaternions: Float64) -> Float64:
    """Return float64[..., 3], what :func:`turn` makes them of; up to half a turn (rad)."""
    sign = np.where(quaternions[..., :1] < 0.0, -1.0, 1.0)
    part = sign * quaternions[..., 1:]
    sine = np.linalg.norm(part, axis=-1, keepdims=True)
    half = np.arctan2(sine, sign * quaternions[..., :1])
    return 2.0 * part / np.sinc(half / np.pi)  # half / sin(half), and 1 at 0


def seen_from(frames: Float64, poses: Float64) -> Float64:
    """Return float64[..., 7]: poses that are given in frames, where the frames are given."""
    at = frames[..., :3] + rotated(frames[..., 3:], poses[..., :3])
    return np.concatenate([at, product(frames[..., 3:], poses[..., 3:])], axis=-1)


def inverse(frames: Float64) -> Float64:
    """Return float64[..., 7], the motions back."""
    back = conjugate(frames[..., 3:])
    return np.concatenate([-rotated(back, frames[..., :3]), back], axis=-1)


def frame(values: Float64) -> Float64:
    """Return float64[7] of a translation (m) and a rotation vector (rad): float64[6]."""
    return np.concatenate([values[:3], turn(values[3:6])])
