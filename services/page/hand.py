"""A person's hand: makes the pose of a bat of the point that its tip shall be at.

The hand lies on the way from a pivot, about where the person's elbow is, to the tip, and the blade
is tilted from that way; roll turns the blade about it. However fast the mouse is, the tip and the
roll are not: a bat that jumps would not be believed, and could not be parried.

Tuples of floats: a hundred times a second and one at a time, they are ten times faster than arrays.
"""

import dataclasses
import math
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from shared.game.geometry import BatShape, Target

Floats = NDArray[np.float64]
Vector: TypeAlias = tuple[float, float, float]

MAX_STEP_SECONDS: Final = 0.012
"""A step covers no more time than this: what was held up does not become a leap."""
TILT: Final = math.radians(25.0)
"""Of the blade from the way it points; its tip is higher than the hand where roll is 0."""
_UP: Final = (0.0, 0.0, 1.0)


@dataclasses.dataclass(frozen=True)
class Reach:
    """Where a person's bat can be, in the world frame (m)."""

    pivot: Vector
    """Behind the hand."""
    low: Vector
    """Corner of the box that the tip stays in."""
    high: Vector
    """The other corner."""
    rest: Vector
    """The tip before the mouse has said anything."""

    @staticmethod
    def of(half_distance: float, target: Target) -> "Reach":
        """Return the reach of a person who stands where the antagonist does.

        Args:
            half_distance: from the target to where the antagonist's torso would be (m).
            target: between the players.
        """
        x, y, z = target.centre
        return Reach(
            pivot=(x + half_distance + 0.25, y + 0.22, z - 0.05),
            low=(x - 0.45, y - 0.9, max(z - 0.7, 0.1)),
            high=(x + half_distance - 0.35, y + 0.9, z + 0.7),
            rest=(x + 0.45, y + 0.2, z + 0.15),
        )


class Hand:
    """The bat that follows the mouse."""

    def __init__(self, reach: Reach, bat: BatShape, max_speed: float, turn_speed: float) -> None:
        """Hold the bat at rest.

        Args:
            reach: where it can be.
            bat: its shape.
            max_speed: of the tip (m/s).
            turn_speed: of the roll (rad/s).
        """
        self._reach = reach
        self._length = bat.front
        self._max_speed = max_speed
        self._turn_speed = turn_speed
        self._tip = self._wanted = reach.rest
        self._roll = self._wanted_roll = 0.0

    @property
    def tip(self) -> Vector:
        """Return where the tip is (m)."""
        return self._tip

    def want(self, tip: Vector, roll: float) -> None:
        """Say where the tip shall be (m), as far as the bat reaches, and its roll (rad)."""
        x, y, z = (
            min(max(wish, low), high)
            for wish, low, high in zip(tip, self._reach.low, self._reach.high, strict=True)
        )
        self._wanted = (x, y, z)
        self._wanted_roll = roll

    def step(self, seconds: float) -> Floats:
        """Go on for so long; return float64[7], position (m) and orientation (w x y z)."""
        seconds = min(max(seconds, 0.0), MAX_STEP_SECONDS)
        far = math.dist(self._tip, self._wanted)
        most = self._max_speed * seconds
        if far <= most:
            self._tip = self._wanted
        else:
            self._tip = _sum(1.0 - most / far, self._tip, most / far, self._wanted)
        turn = math.remainder(self._wanted_roll - self._roll, math.tau)
        most = self._turn_speed * seconds
        self._roll = math.remainder(self._roll + min(max(turn, -most), most), math.tau)
        return self.pose()

    def pose(self) -> Floats:
        """Return float64[7], where the bat is: its grip (m), and its orientation (w x y z)."""
        ahead = _unit(_sum(1.0, self._tip, -1.0, self._reach.pivot))
        right = _unit(_cross(ahead, _UP))
        above = _cross(right, ahead)
        up = _sum(math.cos(self._roll), above, math.sin(self._roll), right)
        blade = _sum(math.cos(TILT), ahead, math.sin(TILT), up)
        across = _sum(math.cos(TILT), up, -math.sin(TILT), ahead)
        grip = _sum(1.0, self._tip, -self._length, blade)
        return np.array([*grip, *_quaternion(blade, _cross(across, blade), across)])


def _sum(a: float, one: Vector, b: float, other: Vector) -> Vector:
    """Return ``a * one + b * other``."""
    return (
        a * one[0] + b * other[0],
        a * one[1] + b * other[1],
        a * one[2] + b * other[2],
    )


def _cross(one: Vector, other: Vector) -> Vector:
    return (
        one[1] * other[2] - one[2] * other[1],
        one[2] * other[0] - one[0] * other[2],
        one[0] * other[1] - one[1] * other[0],
    )


def _unit(vector: Vector) -> Vector:
    return _sum(1.0 / math.hypot(*vector), vector, 0.0, vector)


def _quaternion(x: Vector, y: Vector, z: Vector) -> tuple[float, ...]:
    """Return the orientation (w x y z) of the frame with these axes."""
    # The largest of 4w^2, 4x^2, 4y^2, 4z^2 divides (Shepperd 1978).
    a, b, c = x[0], y[1], z[2]
    ww, xx, yy, zz = 1 + a + b + c, 1 + a - b - c, 1 - a + b - c, 1 - a - b + c
    wx, wy, wz = y[2] - z[1], z[0] - x[2], x[1] - y[0]
    xy, xz, yz = y[0] + x[1], z[0] + x[2], z[1] + y[2]
    rows = ((ww, wx, wy, wz), (wx, xx, xy, xz), (wy, xy, yy, yz), (wz, xz, yz, zz))
    row = max(zip((ww, xx, yy, zz), rows, strict=True))[1]
    size = math.hypot(*row)
    return tuple(number / size for number in row)
