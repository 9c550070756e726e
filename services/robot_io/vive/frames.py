"""Frames in frames: poses composed, inverted, and read from matrices."""

import math
from collections.abc import Sequence

from services.robot_io.poses import (
    ZERO,
    Pose,
    Quaternion,
    Vector,
    add,
    product,
    rotated,
    scale,
    unit,
)

IDENTITY = Pose(ZERO, (1.0, 0.0, 0.0, 0.0))


def composed(outer: Pose, inner: Pose) -> Pose:
    """Return ``a_from_c`` of ``a_from_b`` and ``b_from_c``."""
    position = add(outer.position, rotated(outer.orientation, inner.position))
    return Pose(position, unit(product(outer.orientation, inner.orientation)))


def inverse(pose: Pose) -> Pose:
    """Return ``b_from_a`` of ``a_from_b``."""
    w, x, y, z = pose.orientation
    back = (w, -x, -y, -z)
    return Pose(scale(rotated(back, pose.position), -1.0), back)


def pose_of_rows(rows: Sequence[float]) -> Pose:
    """Return the pose of 12 numbers: three rows of a rotation, each followed by a place (m).

    A matrix that is no rotation gives a quaternion that is not of unit length, or not finite.
    """
    a, b, c, x, d, e, f, y, g, h, i, z = rows
    return Pose((x, y, z), _quaternion(a, b, c, d, e, f, g, h, i))


def heading(position: Vector, yaw: float) -> Pose:
    """Return a frame that stands upright in the world, turned about its z (rad)."""
    return Pose(position, (math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw)))


def _quaternion(
    a: float, b: float, c: float, d: float, e: float, f: float, g: float, h: float, i: float
) -> Quaternion:
    """Return (w, x, y, z) of a rotation matrix, from its largest diagonal (Shepperd 1978)."""
    trace = a + e + i
    if trace >= max(a, e, i):
        size = math.sqrt(max(1.0 + trace, 0.0)) * 2.0
        parts = (0.25 * size * size, h - f, c - g, d - b)
    elif a >= e and a >= i:
        size = math.sqrt(max(1.0 + a - e - i, 0.0)) * 2.0
        parts = (h - f, 0.25 * size * size, b + d, c + g)
    elif e >= i:
        size = math.sqrt(max(1.0 - a + e - i, 0.0)) * 2.0
        parts = (c - g, b + d, 0.25 * size * size, f + h)
    else:
        size = math.sqrt(max(1.0 - a - e + i, 0.0)) * 2.0
        parts = (d - b, c + g, f + h, 0.25 * size * size)
    if not size > 0.0:  # also where it is not a number
        return (math.nan, math.nan, math.nan, math.nan)
    w, x, y, z = parts
    return w / size, x / size, y / size, z / size
