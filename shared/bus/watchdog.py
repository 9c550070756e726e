"""Keeps a session that has a router: opens another when none was seen for long, then gives up."""

from collections.abc import Callable
from typing import Generic, TypeVar

import structlog

from shared.bus.config import BusConfig
from shared.bus.reopening import Reopening
from shared.clock import Clock
from shared.errors import BusError

S = TypeVar("S")

log = structlog.get_logger()


class Watchdog(Generic[S]):
    """Owns a session; everything here is called on the service's thread."""

    def __init__(
        self,
        cfg: BusConfig,
        clock: Clock,
        session: S,
        has_router: Callable[[S], bool],
        open: Callable[[], S | None],
        close: Callable[[S], None],
    ) -> None:
        """Take over a session that is open.

        Args:
            cfg: where the routers are, and how long to wait for one.
            clock: measures that.
            session: the first one.
            has_router: whether a session is connected to a router.
            open: returns a new session, or None when there is nobody to connect to.
            close: ends a session; must return in bounded time.
        """
        self.session: S | None = session
        """None while a new one is opened, and once closed."""
        self._cfg = cfg
        self._clock = clock
        self._has_router = has_router
        self._open = open
        self._close = close
        self._opening: Reopening[S] | None = None
        self._seen_at = clock.now()
        self._is_closed = False

    def look(self, now: float) -> bool:
        """Look for a router; return whether there is a new session, in which nothing is declared.

        Raises:
            BusError: no router for ``give_up_seconds``.
        """
        if self._is_closed:
            return False
        if self.session is not None and self._has_router(self.session):
            self._seen_at = now
            return False
        if now - self._seen_at > self._cfg.give_up_seconds:
            raise BusError(f"{self.without_router()}: giving up")
        if self._opening is not None:
            self.session = self._opening.take()
            if self.session is None:
                return False
            self._opening = None
            self._seen_at = now
            return True
        if now - self._seen_at > self._cfg.watchdog_seconds:
            log.warning("session_reopened", reason=self.without_router())
            old, self.session = self.session, None
            self._opening = Reopening(old, self._open, self._close)
        return False

    def without_router(self) -> str:
        """Return for how long there has been no router, in words."""
        seconds = self._clock.now() - self._seen_at
        return f"no router at {', '.join(self._cfg.routers)} for {seconds:.1f} s"

    def close(self) -> None:
        """End the session, or whatever opens the next."""
        self._is_closed = True
        if self._opening is not None:
            self._opening.cancel()
        session, self.session = self.session, None
        if session is not None:
            self._close(session)
