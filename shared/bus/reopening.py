"""Opening a new session in the background, for a service that must not stand still."""

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

S = TypeVar("S")

RETRY_SECONDS = 0.2


class Reopening(Generic[S]):
    """A thread that closes an old session and opens a new one, trying until it succeeds."""

    def __init__(
        self, old: S | None, open: Callable[[], S | None], close: Callable[[S], None]
    ) -> None:
        """Start.

        Args:
            old: the session to close first.
            open: returns a new session, or None when there is nobody to connect to.
            close: ends a session; must return in bounded time.
        """
        self._old = old
        self._open = open
        self._close = close
        self._session: S | None = None
        self._lock = threading.Lock()
        self._cancelled = threading.Event()
        threading.Thread(target=self._run, name="bus-reopen", daemon=True).start()

    def take(self) -> S | None:
        """Return the new session, once, when it is open."""
        with self._lock:
            session, self._session = self._session, None
            return session

    def cancel(self) -> None:
        """Open no session from now on, and close the one that nobody took."""
        self._cancelled.set()
        session = self.take()
        if session is not None:
            self._close(session)

    def _run(self) -> None:
        if self._old is not None:
            self._close(self._old)
        while not self._cancelled.is_set():
            session = self._open()
            if session is None:
                self._cancelled.wait(RETRY_SECONDS)
                continue
            with self._lock:
                self._session = session
            if self._cancelled.is_set():
                self.cancel()
            return
