"""Whether the controller was restarted, or is commanded by another: its generation.

A restarted controller takes where the arm is for its target. So a target that changes to what was
never sent tells of a restart, or of another node that commands; either way what the gate knew of
it is void. A stream that was silent, or went back in time, tells the same.
"""

import math
from collections import deque
from typing import Final

from services.robot_io.poses import Vector, distance

SILENT_SECONDS: Final = 0.2
"""A running controller says its state a hundred times a second."""
SAME_M: Final = 1e-6
"""A target this near to one that was sent is that one."""
REMEMBERED: Final = 256


class Restarts:
    """Counts the controller's generations."""

    def __init__(self) -> None:
        self.generation = 0
        self.reason = ""
        """Of the last change."""
        self._sent: deque[Vector] = deque(maxlen=REMEMBERED)
        self._stamp = -math.inf
        self._target: Vector | None = None

    def sent(self, position: Vector) -> None:
        """Take it that this was commanded (m)."""
        self._sent.append(position)

    def observe(self, stamp: float, target: Vector) -> None:
        """Take one state of the controller.

        Args:
            stamp: by the robot's clock (s).
            target: ``x_desi`` (m); may be NaN.
        """
        before, self._stamp = self._stamp, stamp
        if math.isfinite(before):
            if stamp < before:
                self.bump(f"the robot's time went back by {before - stamp:.3f} s")
            elif stamp - before > SILENT_SECONDS:
                self.bump(f"the controller was silent for {stamp - before:.2f} s")
        old, self._target = self._target, target
        if old is None or not distance(old, target) > SAME_M:
            return
        if not any(distance(one, target) <= SAME_M for one in reversed(self._sent)):
            self.bump("its target changed to what was not sent")

    def bump(self, reason: str) -> None:
        """Begin a new generation."""
        self.generation += 1
        self.reason = reason
