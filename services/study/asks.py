"""The asks of both pages, each let through once, on their way to the service and back."""

import threading
from collections import OrderedDict, deque
from collections.abc import Callable, Iterable

from services.study.view import Ask, Reply

MAX_WAITING = 32
MAX_KNOWN = 1024
"""Replies that are kept for a page that asks again; far more than a page has under way."""


class Asks:
    """A bounded queue that knows which ids it has seen; for any thread."""

    def __init__(self, replies: Iterable[Reply] = ()) -> None:
        """Wait for asks.

        Args:
            replies: given before this process began, from the journal: asks with these ids are
                answered with them and not let through again.
        """
        self._lock = threading.Lock()
        self._waiting: deque[Ask] = deque()
        self._under_way: set[str] = set()
        self._replies: OrderedDict[str, Reply] = OrderedDict()
        self._follower: Callable[[Reply], None] | None = None
        self.dropped = 0
        """Asks that found the queue full; their pages ask again."""
        for reply in replies:
            self._keep(reply)

    def follow(self, follower: Callable[[Reply], None]) -> None:
        """Have each reply told to somebody, on the thread that gives it."""
        self._follower = follower

    def put(self, ask: Ask) -> Reply | None:
        """Take an ask in, unless its id is known; return the reply where there is one already."""
        with self._lock:
            if (reply := self._replies.get(ask.id)) is not None:
                return reply
            if ask.id in self._under_way:
                return None
            if len(self._under_way) >= MAX_WAITING:
                self.dropped += 1
                return None
            self._under_way.add(ask.id)
            self._waiting.append(ask)
            return None

    def take(self) -> Ask | None:
        """Return the oldest ask that was not taken yet; it has to be answered."""
        with self._lock:
            return self._waiting.popleft() if self._waiting else None

    def answer(self, reply: Reply) -> None:
        """Say what came of an ask that was taken."""
        with self._lock:
            self._keep(reply)
        if self._follower is not None:
            self._follower(reply)

    def _keep(self, reply: Reply) -> None:
        self._under_way.discard(reply.id)
        self._replies[reply.id] = reply
        if len(self._replies) > MAX_KNOWN:
            self._replies.popitem(last=False)
