"""A person's hand: makes the pose of a bat of the point that its tip shall be at.

The hand lies on the way from a pivot, about where the person's elbow is, to the tip, and the blade
is tilted from that way; roll turns the blade about it. However fast the mouse is, the tip and the
roll are not: a bat that jumps would not be believed, and could not be parried.
"""

import dataclasses
import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from shared.game.geometry import BatShape, Target

Floats = NDArray[np.float64]

MAX_STEP_SECONDS: Final = 0.012
"""A step covers no more time than this: what was held up does not become a leap."""
TILT: Final = math.radians(25.0)
"""Of the blade from the way it points; its tip is higher than the hand where roll is 0."""
_UP: Final = np.array([0.0, 0.0, 1.0])


@dataclasses.dataclass(frozen=True)
class Reach:
    """Where a person's bat can be, in the world frame."""

    pivot: Floats
    """float64[3], behind the hand (m)."""
    low: Floats
    """float64[3], corner of the box that the tip stays in (m)."""
    high: Floats
    """float64[3], the other corner (m)."""
    rest: Floats
    """float64[3], the tip before the mouse has said anything (m)."""

    @staticmethod
    def of(half_distance: float, target: Target) -> "Reach":
        """Return the reach of a person who stands where the antagonist does.

        Args:
            half_distance: from the target to where the antagonist's torso would be (m).
            target: between the players.
        """
        x, y, z = target.centre
        return Reach(
            pivot=np.array([x + half_distance + 0.25, y + 0.22, z - 0.05]),
            low=np.array([x - 0.45, y - 0.9, max(z - 0.7, 0.1)]),
            high=np.array([x + half_distance - 0.35, y + 0.9, z + 0.7]),
            rest=np.array([x + 0.45, y + 0.2, z + 0.15]),
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
    def tip(self) -> Floats:
        """Return float64[3], where the tip is (m)."""
        return self._tip.copy()

    def want(self, tip: tuple[float, float, float], roll: float) -> None:
        """Say where the tip shall be (m), as far as the bat reaches, and its roll (rad)."""
        self._wanted = np.clip(np.array(tip), self._reach.low, self._reach.high)
        self._wanted_roll = roll

    def step(self, seconds: float) -> Floats:
        """Go on for so long; return float64[7], position (m) and orientation (w x y z)."""
        seconds = min(max(seconds, 0.0), MAX_STEP_SECONDS)
        way = self._wanted - self._tip
        far = float(np.linalg.norm(way))
        most = self._max_speed * seconds
        self._tip = self._wanted if far <= most else self._tip + way * (most / far)
        turn = math.remainder(self._wanted_roll - self._roll, math.tau)
        most = self._turn_speed * seconds
        self._roll = math.remainder(self._roll + min(max(turn, -most), most), math.tau)
        return self.pose()

    def pose(self) -> Floats:
        """Return float64[7], where the bat is: its grip (m), and its orientation (w x y z)."""
        ahead = _unit(self._tip - self._reach.pivot)
        right = _unit(np.cross(ahead, _UP))
        above = np.cross(right, ahead)
        up = math.cos(self._roll) * above + math.sin(self._roll) * right
        blade = math.cos(TILT) * ahead + math.sin(TILT) * up
        across = math.cos(TILT) * up - math.sin(TILT) * ahead
        axes = np.column_stack([blade, np.cross(across, blade), across])
        return np.concatenate([self._tip - self._length * blade, _quaternion(axes)])


def _unit(vector: Floats) -> Floats:
    out: Floats = vector / np.linalg.norm(vector)
    return out


def _quaternion(axes: Floats) -> Floats:
    """Return the orientation (w x y z) of a frame whose axes are the columns of float64[3, 3]."""
    # The largest of 4w^2, 4x^2, 4y^2, 4z^2 divides (Shepperd 1978).
    a, b, c = axes[0, 0], axes[1, 1], axes[2, 2]
    squares = np.array([1 + a + b + c, 1 + a - b - c, 1 - a + b - c, 1 - a - b + c])
    k = int(np.argmax(squares))
    yz, zx, xy = axes[2, 1] - axes[1, 2], axes[0, 2] - axes[2, 0], axes[1, 0] - axes[0, 1]
    xy2, zx2, yz2 = axes[0, 1] + axes[1, 0], axes[0, 2] + axes[2, 0], axes[1, 2] + axes[2, 1]
    rows = (
        (squares[0], yz, zx, xy),
        (yz, squares[1], xy2, zx2),
        (zx, xy2, squares[2], yz2),
        (xy, zx2, yz2, squares[3]),
    )
    return _unit(np.array(rows[k]))
