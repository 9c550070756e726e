"""Where arrivals wait until the service takes them; bounded, and shared by both buses."""

import threading
from collections import OrderedDict, deque
from typing import Generic, TypeVar

T = TypeVar("T")

MAX_KEYS = 4096
"""Keys of one LATEST subscription."""
MAX_WRITERS = 8
"""Boots remembered for one key."""


class Fifo(Generic[T]):
    """Oldest first, bounded by number and by bytes."""

    def __init__(self, max_items: int, max_bytes: int) -> None:
        self._items: deque[tuple[T, int]] = deque()
        self._bytes = 0
        self._max_items = max_items
        self._max_bytes = max_bytes
        self._lock = threading.Lock()

    def offer(self, item: T, size: int) -> bool:
        """Add an item unless there is no room; one that is alone always has."""
        with self._lock:
            if not self._has_room(size):
                return False
            self._append(item, size)
            return True

    def push(self, item: T, size: int) -> int:
        """Add an item, dropping the oldest for it; return how many were dropped."""
        dropped = 0
        with self._lock:
            while not self._has_room(size):
                self._bytes -= self._items.popleft()[1]
                dropped += 1
            self._append(item, size)
        return dropped

    def pop(self) -> T | None:
        """Return the oldest item, or None."""
        with self._lock:
            if not self._items:
                return None
            item, size = self._items.popleft()
            self._bytes -= size
            return item

    def _has_room(self, size: int) -> bool:
        return not self._items or (
            len(self._items) < self._max_items and self._bytes + size <= self._max_bytes
        )

    def _append(self, item: T, size: int) -> None:
        self._items.append((item, size))
        self._bytes += size


class Newest(Generic[T]):
    """The newest value of each key, once: what is not newer than the last one seen is dropped.

    Of more than ``MAX_KEYS`` keys the one that was silent longest is forgotten.
    """

    def __init__(self) -> None:
        self._values: OrderedDict[str, T] = OrderedDict()
        self._seen: OrderedDict[str, dict[str, int]] = OrderedDict()
        """By key, the one that was silent longest first: the newest count of each writer."""
        self._lock = threading.Lock()

    def offer(self, key: str, boot: str, count: int, value: T) -> bool:
        """Keep a value if it is the newest its writer sent under this key.

        Args:
            key: of the value.
            boot: its writer.
            count: how many values the writer had sent before it.
            value: anything.
        """
        with self._lock:
            seen = self._seen.get(key)
            if seen is None:
                if len(self._seen) >= MAX_KEYS:
                    silent, _ = self._seen.popitem(last=False)
                    self._values.pop(silent, None)
                seen = self._seen[key] = {}
            self._seen.move_to_end(key)
            if count <= seen.get(boot, -1):
                return False
            if boot not in seen and len(seen) >= MAX_WRITERS:
                del seen[next(iter(seen))]
            seen[boot] = count
            self._values[key] = value
            return True

    def pop(self) -> T | None:
        """Return the value that waits longest, or None."""
        with self._lock:
            if not self._values:
                return None
            return self._values.popitem(last=False)[1]
