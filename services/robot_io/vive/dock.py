"""A dock that a bat is laid into: whether the tracker is where it was when it was calibrated.

A tracker may be off by centimetres after it was lost (Niehorster 2017); a known place shows it.
"""

import math

from services.robot_io.poses import Vector, add, distance, scale

STILL_SECONDS = 0.5
STILL_M = 0.005
"""A bat that moved less than this for so long lies still."""
NEAR_M = 0.15
"""One that lies still within this of the dock lies in it."""


class DockCheck:
    """Compares a bat that lies in its dock with the place that was recorded."""

    def __init__(self, dock: Vector | None, limit: float) -> None:
        """Begin with a check that is due.

        Args:
            dock: where the tracker was, in the base stations' frame (m); None if none is known.
            limit: how far it may be from there (m).
        """
        self._dock = dock
        self._limit = limit
        self._from: Vector = (math.inf, 0.0, 0.0)
        self._sum: Vector = (0.0, 0.0, 0.0)
        self._count = 0
        self._since = math.inf
        self.error: float | None = None
        """Of the last check (m)."""
        self.is_due = dock is not None
        """Whether the bat should be laid into its dock."""
        self.counters = {"dock_checks": 0, "dock_failures": 0}

    @property
    def problem(self) -> str:
        """Return why the tracker cannot be believed; empty if it can."""
        if self._dock is None:
            return ""
        if self.error is None:
            return "lay the bat into its dock for a second, to check the tracker"
        if self.error > self._limit:
            return (
                f"the bat in its dock is seen {1e3 * self.error:.0f} mm from where that was "
                f"recorded, limit {1e3 * self._limit:.0f}: look for reflections and moved base "
                "stations, lay it in again, or run riposte robot calibrate"
            )
        return ""

    def offer(self, position: Vector, at: float) -> None:
        """Take where the tracker is, in the base stations' frame (m)."""
        if self._dock is None:
            return
        if not distance(position, self._from) <= STILL_M:
            self._from, self._since = position, at
            self._sum, self._count = (0.0, 0.0, 0.0), 0
        self._sum = add(self._sum, position)
        self._count += 1
        if at - self._since < STILL_SECONDS:
            return
        error = distance(scale(self._sum, 1.0 / self._count), self._dock)
        if error <= NEAR_M:
            self._judge(error)
        self._since = math.inf  # once each time that it is laid in

    def lost(self) -> None:
        """Take it that the tracker was lost for a while: a check is due again."""
        self.is_due = self._dock is not None
        self._from = (math.inf, 0.0, 0.0)

    def _judge(self, error: float) -> None:
        self.error = error
        self.counters["dock_checks"] += 1
        if error <= self._limit:
            self.is_due = False
        else:
            self.counters["dock_failures"] += 1
