"""What every bus counts since its start."""

import threading
from collections.abc import Mapping

NAMES: tuple[str, ...] = (
    "messages_out", "bytes_out",     # values, requests and answers sent, re-sent ones included
    "messages_in", "bytes_in",       # the same, taken by the service
    "refused_messages",              # undecodable or oversize, either way
    "refused_requests",              # turned away because the inbox was full
    "dropped_values",                # of STREAM topics, because the reader was slow
    "asks", "asks_unanswered",       # requests made, and how many ended in NoAnswer
    "reconnects",                    # sessions reopened by the watchdog
)  # fmt: skip


class Counters:
    """Named counts that any thread may raise."""

    def __init__(self) -> None:
        self._counts: dict[str, int] = dict.fromkeys(NAMES, 0)
        self._lock = threading.Lock()

    def add(self, name: str, amount: int = 1) -> None:
        """Raise one count; its name must be in NAMES."""
        with self._lock:
            self._counts[name] += amount

    def sent(self, size: int) -> None:
        """Count one payload of ``size`` bytes that left."""
        with self._lock:
            self._counts["messages_out"] += 1
            self._counts["bytes_out"] += size

    def taken(self, size: int) -> None:
        """Count one payload of ``size`` bytes that was taken."""
        with self._lock:
            self._counts["messages_in"] += 1
            self._counts["bytes_in"] += size

    def read(self) -> Mapping[str, int]:
        """Return a copy."""
        with self._lock:
            return dict(self._counts)
