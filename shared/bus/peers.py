"""Who is, and was, connected to a router."""

import threading
from typing import Literal, NamedTuple

MOST_PEERS = 10_000
"""Sessions whose names are remembered, to say whom a router refused."""


class News(NamedTuple):
    """A session that came or went."""

    what: Literal["opened", "closed"]
    role: str
    address: str


class Peers:
    """The sessions of a router by identity; ``note`` may be called on any thread."""

    def __init__(self) -> None:
        self._known: dict[str, tuple[str, str]] = {}
        self._news: list[News] = []
        self._lock = threading.Lock()

    def note(self, zid: str, role: str, address: str, *, came: bool) -> None:
        """Note that a session opened or closed.

        Args:
            zid: identity of the session; it lasts as long as the session does.
            role: common name of its certificate, empty where it has none.
            address: endpoint it came from.
            came: whether it opened.
        """
        with self._lock:
            self._known[zid] = (role, address)
            while len(self._known) > MOST_PEERS:
                self._known.pop(next(iter(self._known)))
            if role and len(self._news) < MOST_PEERS:
                self._news.append(News("opened" if came else "closed", role, address))

    def news(self) -> list[News]:
        """Return which sessions with a role opened and closed since the last time."""
        with self._lock:
            news, self._news = self._news, []
        return news

    def who(self, zid: str) -> dict[str, str]:
        """Return whose session an identity, or the beginning of one, is or was."""
        with self._lock:
            found = [peer for known, peer in self._known.items() if known.startswith(zid)]
        if len(found) != 1:
            return {"role": "unknown", "zid": zid}
        role, address = found[0]
        return {"role": role or "unknown", "address": address}
