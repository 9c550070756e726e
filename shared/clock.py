"""Time as an argument: every service is handed one of these clocks."""

import time
from typing import Protocol


class Clock(Protocol):
    """Where a service reads the time."""

    def now(self) -> float:
        """Return seconds on a monotonic clock; only differences mean anything."""
        ...

    def wall_ns(self) -> int:
        """Return nanoseconds since 1970-01-01 UTC, for people and logs; it may jump."""
        ...


class SystemClock:
    """The clock of this machine."""

    def now(self) -> float:
        """Return seconds on the machine's monotonic clock."""
        return time.monotonic()

    def wall_ns(self) -> int:
        """Return nanoseconds since 1970-01-01 UTC."""
        return time.time_ns()


class ManualClock:
    """A clock that stands still until it is moved: serial training and tests."""

    def __init__(self, seconds: float = 0.0) -> None:
        self._ns = round(seconds * 1e9)

    def now(self) -> float:
        """Return the seconds this clock was moved to."""
        return self._ns / 1e9

    def wall_ns(self) -> int:
        """Return the same instant in nanoseconds."""
        return self._ns

    def advance(self, seconds: float) -> None:
        """Move the clock forward.

        Raises:
            ValueError: if ``seconds`` is negative.
        """
        if seconds < 0:
            raise ValueError(f"a clock cannot go back ({seconds} s)")
        self._ns += round(seconds * 1e9)
