"""Dry friction that turns round over a way rather than at once: surfaces bend before they slide.

What bends is a bristle (Dahl 1968): its share of the friction comes to 1, in the direction of the
motion, to 63 % within the way. A stuck joint is held by a spring then, mostly a stiff one.
"""

import numpy as np

from shared.sim.arm import Float64

_BEFORE = 0.05
"""A joint is taken to have moved for so long as it does at the start (s): where it stands bristles
are straight, as nobody knows better."""
_NONE = 1e-12
"""A way that is none (rad, m)."""


class Bristles:
    """Of K arms."""

    def __init__(self, ways: Float64, speed: Float64) -> None:
        """Bend them as they are at the start.

        Args:
            ways: float64[K, J], over which friction turns round (rad, m); 0 where it does at once.
            speed: float64[K, J], at the start (rad/s, m/s).
        """
        self.are_there = ways > 0.0
        self._ways = np.maximum(ways, _NONE)
        self._bent = np.tanh(_BEFORE * speed / self._ways)

    def act(self, level: Float64, speed: Float64, timestep: float) -> tuple[Float64, Float64]:
        """Return float64[K, J] twice: the torque (N m, N) and the damping (N m s/rad) of a step.

        The damping is what they bend by within it. That is for the simulator to take implicitly,
        so that no bristle is too stiff for a step (backward Euler). Both are 0 where there is none.

        Args:
            level: float64[K, J], what they slide with (N m, N).
            speed: float64[K, J], at the begin of the step, which bent them in the one before.
            timestep: (s).
        """
        way = np.sign(speed)
        keep = np.exp(-np.abs(speed) * timestep / self._ways)
        self._bent = way + (self._bent - way) * keep
        stiffness = level / self._ways * (1.0 - self._bent * way)
        torque, damping = -level * self._bent, timestep * stiffness
        return np.where(self.are_there, torque, 0.0), np.where(self.are_there, damping, 0.0)
