"""Whether the controller was restarted, or is commanded by another: its generation.

A restarted controller takes where the arm is for its target, and its filter begins there. So a
target that was never sent tells of a restart, or of another node that commands, and so does a
filtered target that is not where its filter led it; what the gate knew is void then. A stream that
was silent, or went back in time, tells the same.

The controller's command thread writes the target while its realtime thread reads it, unlocked
(JTCartesianController, ``commandPose``), so that one state in many thousands has a target that is
half of one command and half of the next. Hence one strange target counts for nothing.
"""

import math
from collections import deque
from typing import Final

from services.robot_io.poses import Vector, add, distance, scale

SILENT_SECONDS: Final = 0.2
"""A running controller says its state a hundred times a second."""
SAME_M: Final = 1e-6
"""A target this near to one that was sent is that one."""
REMEMBERED: Final = 256
STRANGE_IN_A_ROW: Final = 2
STRANGE_A_SECOND: Final = 3
OFF_M: Final = 0.001
"""The filtered target may be so far from where its filter leads it."""
CYCLES: Final = 2.0
"""By so many milliseconds may a state be earlier or later than its stamp says."""
STATE_SECONDS: Final = 0.015
"""Between two states, if none was lost."""
LEAP_MARGIN: Final = 1.5
"""Where some were, the filter may have followed targets that nobody saw: so much further."""


class Restarts:
    """Counts the controller's generations."""

    def __init__(self, share: float) -> None:
        """Know of nothing yet.

        Args:
            share: of the way to its target that the filtered one goes in a millisecond.
        """
        self.generation = 0
        self.reason = ""
        """Of the last change."""
        self._share = share
        self._sent: deque[Vector] = deque(maxlen=REMEMBERED)
        self._stamp = -math.inf
        self._target: Vector | None = None
        """The last that was taken for good."""
        self._last: Vector | None = None
        """As the last state had it."""
        self._filtered: Vector | None = None
        self._strange: deque[float] = deque(maxlen=STRANGE_A_SECOND)
        """Stamps of targets that were not sent."""
        self._row = 0

    def sent(self, position: Vector) -> None:
        """Take it that this was commanded (m)."""
        self._sent.append(position)

    def observe(self, stamp: float, target: Vector, filtered: Vector) -> None:
        """Take one state of the controller.

        Args:
            stamp: by the robot's clock (s).
            target: ``x_desi`` (m); may be NaN.
            filtered: ``x_desi_filtered`` (m); may be NaN.
        """
        before, self._stamp = self._stamp, stamp
        passed = stamp - before
        if math.isfinite(before):
            if passed < 0.0:
                self.bump(f"the robot's time went back by {-passed:.3f} s")
            elif passed > SILENT_SECONDS:
                self.bump(f"the controller was silent for {passed:.2f} s")
            elif self._leaps(passed, target, filtered):
                self.bump("its filtered target leapt")
        self._last, self._filtered = target, filtered
        self._judge(stamp, target)

    def bump(self, reason: str) -> None:
        """Begin a new generation."""
        self.generation += 1
        self.reason = reason

    def _judge(self, stamp: float, target: Vector) -> None:
        """Count targets that were not sent."""
        if self._target is None or self._is_known(target):
            self._target, self._row = target, 0
            return
        self._row += 1
        self._strange.append(stamp)
        many = len(self._strange) == STRANGE_A_SECOND and stamp - self._strange[0] <= 1.0
        if self._row >= STRANGE_IN_A_ROW or many:
            self.bump("its target changed to what was not sent")
            self._target, self._row = target, 0
            self._strange.clear()

    def _is_known(self, target: Vector) -> bool:
        """Return whether the target is the one before, or was sent, or is not a number."""
        if self._target is None or not distance(self._target, target) > SAME_M:
            return True
        return any(distance(one, target) <= SAME_M for one in reversed(self._sent))

    def _leaps(self, passed: float, target: Vector, filtered: Vector) -> bool:
        """Return whether the filtered target is where its filter cannot have led it.

        It went towards the last target, then from some moment on towards the new one: so it is
        between the ends of following only the one and only the other.
        """
        old, last = self._filtered, self._last
        if old is None or last is None:
            return False
        kept = (1.0 - self._share) ** (1000.0 * passed)
        ends = [add(scale(old, kept), followed, 1.0 - kept) for followed in (last, target)]
        reach = max(distance(old, last), distance(old, target))
        allowed = OFF_M + CYCLES * self._share * reach
        if passed > STATE_SECONDS:
            allowed += LEAP_MARGIN * (1.0 - kept) * reach
        return _from_between(filtered, ends[0], ends[1]) > allowed


def _from_between(point: Vector, first: Vector, second: Vector) -> float:
    """Return how far a point is from the straight line that ends at two others (m)."""
    along = add(second, first, -1.0)
    size = math.hypot(*along)
    if size == 0.0:
        return distance(point, first)
    there = add(point, first, -1.0)
    share = sum(a * b for a, b in zip(there, along, strict=True)) / size**2
    return distance(point, add(first, along, min(max(share, 0.0), 1.0)))
