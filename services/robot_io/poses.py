"""Poses as tuples of floats: the gate's arithmetic, a hundred times a second and one at a time.

For single poses this is ten times faster than arrays. Quaternions are (w, x, y, z).
"""

import math
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Vector: TypeAlias = tuple[float, float, float]
Quaternion: TypeAlias = tuple[float, float, float, float]

ZERO: Vector = (0.0, 0.0, 0.0)


class Pose(NamedTuple):
    """Where a tool is, in its agent's torso frame."""

    position: Vector
    """m."""
    orientation: Quaternion
    """Unit length."""


def is_pose(pose: Pose, tolerance: float = 0.01) -> bool:
    """Return whether all numbers are finite and the quaternion is of unit length."""
    if not all(map(math.isfinite, (*pose.position, *pose.orientation))):
        return False
    return abs(math.hypot(*pose.orientation) - 1.0) <= tolerance


def unit(quaternion: Quaternion) -> Quaternion:
    """Return the quaternion at length one."""
    length = math.hypot(*quaternion)
    w, x, y, z = quaternion
    return w / length, x / length, y / length, z / length


def add(one: Vector, other: Vector, factor: float = 1.0) -> Vector:
    """Return ``one + factor * other``."""
    return (
        one[0] + factor * other[0],
        one[1] + factor * other[1],
        one[2] + factor * other[2],
    )


def scale(vector: Vector, factor: float) -> Vector:
    """Return the vector times a number."""
    return vector[0] * factor, vector[1] * factor, vector[2] * factor


def length(vector: Vector) -> float:
    """Return how long a vector is."""
    return math.sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2])


def shortened(vector: Vector, limit: float) -> Vector:
    """Return the vector, at most ``limit`` long."""
    size = length(vector)
    return vector if size <= limit else scale(vector, limit / size)


def distance(one: Vector, other: Vector) -> float:
    """Return how far apart two points are."""
    return length(add(one, other, -1.0))


def product(one: Quaternion, other: Quaternion) -> Quaternion:
    """Return the rotation ``other`` followed by the rotation ``one``."""
    a, b, c, d = one
    w, x, y, z = other
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def rotation_between(start: Quaternion, end: Quaternion) -> Vector:
    """Return the shortest turn from ``start`` to ``end`` in the fixed frame: axis times angle."""
    w, x, y, z = product(end, (start[0], -start[1], -start[2], -start[3]))
    sine = math.sqrt(x * x + y * y + z * z)
    if sine < 1e-12:
        return ZERO
    angle = 2.0 * math.atan2(sine, abs(w))
    return scale((x, y, z), math.copysign(angle / sine, w))


def turned(orientation: Quaternion, rotation: Vector) -> Quaternion:
    """Return an orientation after a turn in the fixed frame: axis times angle."""
    angle = length(rotation)
    if angle < 1e-12:
        return orientation
    factor = math.sin(0.5 * angle) / angle
    turn = (
        math.cos(0.5 * angle),
        rotation[0] * factor,
        rotation[1] * factor,
        rotation[2] * factor,
    )
    return unit(product(turn, orientation))


def rotated(orientation: Quaternion, vector: Vector) -> Vector:
    """Return a vector of the rotated frame in the fixed one."""
    w, x, y, z = orientation
    a, b, c = vector
    # v + 2 u x (u x v + w v)
    p = y * c - z * b + w * a
    q = z * a - x * c + w * b
    r = x * b - y * a + w * c
    return (
        a + 2.0 * (y * r - z * q),
        b + 2.0 * (z * p - x * r),
        c + 2.0 * (x * q - y * p),
    )


def pose_of(numbers: Floats) -> Pose:
    """Return float64[7] as a pose, its quaternion at unit length where it has one."""
    x, y, z, *four = (float(number) for number in numbers)
    size = float(np.linalg.norm(four))
    if size > 0.5:
        four = [number / size for number in four]
    return Pose((x, y, z), (four[0], four[1], four[2], four[3]))


def array_of(pose: Pose) -> Floats:
    """Return a pose as float64[7]."""
    return np.array([*pose.position, *pose.orientation])
