"""Geometry of blades: directions that are perpendicular, turned, or tangent to the target.

Pure functions of float64[3, N], component first.
"""

import numpy as np
from numpy.typing import NDArray

from shared.game.geometry import dot, length

Floats = NDArray[np.float64]

_TINY = 1e-9
_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])
"""The components after each, and before it, in turn."""


def cross(a: Floats, b: Floats) -> Floats:
    """Return the vector products."""
    return a.take(_NEXT, 0) * b.take(_LAST, 0) - a.take(_LAST, 0) * b.take(_NEXT, 0)


def unit(vectors: Floats) -> Floats:
    """Return the vectors at length one; a vanishing one stays (nearly) zero."""
    return vectors / np.maximum(length(vectors), _TINY)


def across(vectors: Floats, axes: Floats, fallback: Floats) -> Floats:
    """Return unit vectors perpendicular to axes, as near as possible to given vectors.

    Args:
        vectors: float64[3, N], what to be near to.
        axes: float64[3, N], unit vectors.
        fallback: float64[3] or [3, N], near to this where a vector is parallel to its axis.
    """
    rest = vectors - dot(vectors, axes) * axes
    parallel = dot(rest, rest) < 1e-6
    if parallel.any():
        instead = np.broadcast_to(fallback.reshape(3, -1), rest.shape)
        rest = np.where(parallel, instead - dot(instead, axes) * axes, rest)
    return unit(rest)


def turned(vectors: Floats, rotations: Floats) -> Floats:
    """Return vectors turned by rotation vectors (axis times angle, rad; Rodrigues' formula)."""
    angle = length(rotations)
    axes = rotations / np.maximum(angle, _TINY)
    cosine = np.cos(angle)
    return (
        cosine * vectors
        + np.sin(angle) * cross(axes, vectors)
        + ((1.0 - cosine) * dot(axes, vectors)) * axes
    )


def turn_between(start: Floats, end: Floats) -> Floats:
    """Return float64[3, N], the shortest rotation vectors from unit vectors to unit vectors (rad).

    Opposite vectors have no shortest one: any half turn is returned then.
    """
    axes = cross(start, end)
    sine = length(axes)
    angle = np.arctan2(sine, dot(start, end))
    opposite = (sine < _TINY) & (angle > 1.0)
    if opposite.any():
        sideways = np.where(np.abs(start[0]) < 0.9, [[1.0], [0.0], [0.0]], [[0.0], [1.0], [0.0]])
        axes = np.where(opposite, across(sideways, start, sideways), axes)
        sine = np.where(opposite, 1.0, sine)
    return axes * (angle / np.maximum(sine, _TINY))


def gibbs_between(start: Floats, end: Floats) -> Floats:
    """Return float64[3, N], twice the Gibbs vectors of the shortest turns between unit vectors.

    That is the axis times 2 tan(angle / 2): what an action says. Nothing for opposite vectors,
    which have no shortest turn.
    """
    return cross(start, end) * (2.0 / np.maximum(1.0 + dot(start, end), 1e-6))


def tangent_back(outward: Floats, distance: float, radius: float, sideways: Floats) -> Floats:
    """Return unit vectors from points along a line that touches a sphere around the origin.

    Of all such lines the one is taken that passes the sphere on the side of ``sideways``.

    Args:
        outward: float64[3, N], unit vectors from the origin to the points.
        distance: of the points from the origin (m), at least ``radius``.
        radius: of the sphere (m).
        sideways: float64[3, N], unit vectors perpendicular to ``outward``.
    """
    sine = radius / distance
    return sine * sideways - np.sqrt(1.0 - sine * sine) * outward
