"""A free hand that holds a bat: late, noisy, not endlessly fast, and pushed aside by nothing.

The noise of a movement grows with its speed (Harris & Wolpert 1998, Nature 394:780); what it has
added up to is corrected by what is seen and felt. Muscles follow with a lag of the first order.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MAX_SPEED: Final = 3.0
"""Of the grip (m/s); the page lets the tip of a mouse's bat go no faster."""
MAX_TURN_SPEED: Final = 8.0
"""Of the blade (rad/s)."""
LAG: Final = 0.05
"""Time constant of the muscles (s)."""
NOISE_SECONDS: Final = 0.1
"""For so long the noise of a movement points the same way (s)."""
CORRECTION_SECONDS: Final = 0.3
"""Time constant in which an error is felt and undone (s)."""
_LIMITS: Final = np.repeat([MAX_SPEED, MAX_TURN_SPEED], 3)


class Hand:
    """Grip and blade in the arena frame of the own side, for one bat."""

    def __init__(self, grip: Floats, blade: Floats) -> None:
        """Hold the bat still.

        Args:
            grip: float64[3], where (m).
            blade: float64[3], unit vector along it.
        """
        self._at = np.concatenate([grip, blade])
        self._wanted = self._at.copy()
        self._error = np.zeros(6)

    def step(
        self, grip: Floats, blade: Floats, noise: float, seconds: float, rng: np.random.Generator
    ) -> None:
        """Go on towards where the bat is wanted.

        Args:
            grip: float64[3] (m).
            blade: float64[3], unit vector.
            noise: standard deviation over speed of a movement.
            seconds: for so long.
            rng: draws the noise.
        """
        wanted = np.concatenate([grip, blade])
        way = wanted - self._wanted
        self._wanted = wanted
        size = np.minimum(np.sqrt(np.add.reduce((way * way).reshape(2, 3), axis=1)), 0.1)
        spread = noise * np.sqrt(NOISE_SECONDS / seconds) * np.repeat(size, 3)
        self._error *= np.exp(-seconds / CORRECTION_SECONDS)
        self._error += spread * rng.standard_normal(6)
        step = (wanted + self._error - self._at) * -np.expm1(-seconds / LAG)
        self._at += np.clip(step, -seconds * _LIMITS, seconds * _LIMITS)
        self._at[3:] /= np.sqrt(np.add.reduce(self._at[3:] ** 2))

    def pose(self) -> Floats:
        """Return float64[7], position (m) and orientation (w x y z) of the bat, own arena frame."""
        x, y, z = self._at[3:]
        # the shortest turn that takes the x axis onto the blade
        turn = np.array([1.0 + x, 0.0, -z, y])
        return np.concatenate([self._at[:3], turn / np.sqrt(np.add.reduce(turn * turn))])
