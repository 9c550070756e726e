"""Bats are capsules and the target is a sphere; both judges ask their questions here.

Everything is vectorised and works on positions in metres in one common frame. Vectors stand
component first, ``[3, ...]``: a component of all worlds is then one contiguous stretch of memory,
which is what makes judging a step cheap beside simulating it.
"""

import dataclasses

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclasses.dataclass(frozen=True)
class BatShape:
    """A bat: a capsule along the x axis of the bat frame, whose origin is the grip."""

    back: float = -0.05
    """Where the axis begins (m); negative is behind the grip."""
    front: float = 0.70
    """Where the axis ends (m)."""
    radius: float = 0.025
    """Of the capsule (m)."""


@dataclasses.dataclass(frozen=True)
class Target:
    """The spherical target area between the players, fixed in the world."""

    centre: tuple[float, float, float] = (0.0, 0.0, 1.05)
    """In the world frame (m)."""
    radius: float = 0.20
    """(m)."""


def blade_direction(quaternions: Floats) -> Floats:
    """Return the unit x axes of the frames with these orientations.

    Args:
        quaternions: float64[4, ...], unit, w x y z.

    Returns:
        float64[3, ...].
    """
    w, x, y, z = quaternions
    direction: Floats = x * quaternions[1:]
    direction[0] += w * w
    direction[1] += w * z
    direction[2] -= w * y
    direction *= 2.0
    direction[0] -= 1.0
    return direction


def distance_to_target(grips: Floats, directions: Floats, bat: BatShape, target: Target) -> Floats:
    """Return how far each bat's surface is from the surface of the target (m); negative inside.

    Args:
        grips: float64[3, ...], origins of the bat frames.
        directions: float64[3, ...], unit vectors along the blades.
        bat: shape of the bats.
        target: the sphere.

    Returns:
        float64[...].
    """
    to_centre = np.array(target.centre).reshape(3, *[1] * (grips.ndim - 1)) - grips
    along = _on_bat(dot(to_centre, directions), bat)
    return length(to_centre - along * directions) - (bat.radius + target.radius)


def distance_between_bats(
    grips_a: Floats, directions_a: Floats, grips_b: Floats, directions_b: Floats, bat: BatShape
) -> Floats:
    """Return the distance between the surfaces of two bats (m); negative where they overlap.

    Closest points of two segments (Ericson 2005, section 5.1.9), with unit directions: the first
    guess on A is clamped, B answers it, and A answers B; exact because the problem is convex.

    Args:
        grips_a: float64[3, ...], origin of each first bat's frame.
        directions_a: float64[3, ...], unit vector along each first blade.
        grips_b: of the second bats.
        directions_b: of the second bats.
        bat: shape of both bats.

    Returns:
        float64[...].
    """
    offset = grips_a - grips_b
    cosine = dot(directions_a, directions_b)
    a_offset = dot(directions_a, offset)
    b_offset = dot(directions_b, offset)
    # Parallel blades leave the first guess free; any finite one is corrected by the two answers.
    sine_squared = np.maximum(1.0 - cosine * cosine, 1e-12)
    on_a = _on_bat((cosine * b_offset - a_offset) / sine_squared, bat)
    on_b = _on_bat(cosine * on_a + b_offset, bat)
    on_a = _on_bat(cosine * on_b - a_offset, bat)
    return length(offset + on_a * directions_a - on_b * directions_b) - 2.0 * bat.radius


def _on_bat(along: Floats, bat: BatShape) -> Floats:
    """Return positions along the blade, those beyond its ends moved to them."""
    return np.minimum(np.maximum(along, bat.back), bat.front)


def dot(a: Floats, b: Floats) -> Floats:
    """Return the scalar products of vectors that stand component first."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def length(a: Floats) -> Floats:
    """Return the lengths of vectors that stand component first."""
    return np.sqrt(dot(a, a))
