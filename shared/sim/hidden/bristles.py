"""Dry friction as bristles that bend before they slide (Dahl 1968).

The other way than a friction constraint: it has no corner, and a joint moves a little before it
breaks away.
"""

import math

BEND = 4e-4
"""How far bristles bend before they slide (rad)."""


class Bristles:
    """The friction of one joint."""

    def __init__(self) -> None:
        self._bent = 0.0
        """As a share of the most."""

    def torque(self, level: float, speed: float, timestep: float) -> float:
        """Return the torque on the joint of one step (N m).

        Args:
            level: where it slides (N m), at least 0.
            speed: of the joint (rad/s).
            timestep: (s).
        """
        # dz/dt = v - |v| z / most, over one step at constant speed
        keep = math.exp(-abs(speed) * timestep / BEND)
        goal = math.copysign(1.0, speed) if speed else 0.0
        self._bent = goal + (self._bent - goal) * keep if speed else self._bent
        return -level * self._bent
