"""The router's loop: the library routes on its own threads; this says who came and was refused."""

import threading
from collections import Counter
from pathlib import Path

import structlog

from services.router.listening import LibraryLog
from shared.bus.config import BusConfig
from shared.bus.refusals import LOG_FILTER, Refusals, read_log
from shared.bus.routing import Router, open_router
from shared.clock import Clock
from shared.runtime.service import Health, StatusReporter

TURN_SECONDS = 0.25
LOOK_SECONDS = 1.0
"""Period of looking at what was refused; each session is in at most one line of each."""
REFUSED = ("refused_messages", "refused_connections", "refused_strangers")
"""Counters; an alert is raised when one grows (deploy/prometheus)."""
LOOKS_PER_COUNT = 10
"""After so many looks the connected processes are counted in the log."""

log = structlog.get_logger()


def run(cfg: BusConfig, stop: threading.Event, clock: Clock, name: str, log_path: Path) -> None:
    """Route on ``cfg.listen`` until ``stop`` is set.

    Args:
        cfg: of the bus.
        stop: set when it shall end.
        clock: a clock that moves by itself.
        name: of this process.
        log_path: its log file, whose time says that the loop turns.

    Raises:
        ConfigError: it cannot listen there.
    """
    library = LibraryLog() if cfg.certificates else None
    router = open_router(cfg, LOG_FILTER if library else "off", name)
    watch = Watch(router, library)
    reporter = StatusReporter(watch, router, clock, "router", log_path)
    log.info("router_started", endpoints=list(router.endpoints))
    look_at = clock.now()
    try:
        while not stop.wait(TURN_SECONDS):
            reporter.tick()
            if clock.now() >= look_at:
                look_at = clock.now() + LOOK_SECONDS
                watch.look()
    finally:
        watch.look()
        router.close()
        log.info("router_stopped")


class Watch:
    """Looks after one router."""

    def __init__(self, router: Router, library: LibraryLog | None) -> None:
        """Have seen nothing; ``library`` is what Zenoh says, where there are certificates."""
        self._router = router
        self._library = library
        self._counted: Counter[str] = Counter({"": -1})
        self._looks = 0
        self._refused: Counter[str] = Counter(dict.fromkeys(REFUSED, 0))

    def look(self) -> None:
        """Log who came and went and who was refused, and now and then how many are there."""
        if self._library is not None:
            self._tell(*self._library.take())
        self._looks += 1
        if self._looks % LOOKS_PER_COUNT == 0 and (now := self._router.sessions()) != self._counted:
            self._counted = now
            log.info("sessions_counted", sessions=now.total(), **_by_role(now))

    def health(self) -> Health:
        """Return who is connected, and what was refused."""
        now = self._router.sessions()
        roles = ", ".join(f"{count} {role}" for role, count in _by_role(now).items())
        return Health(
            state=f"carries {now.total()} sessions" + (f": {roles}" if roles else ""),
            counters={"sessions": now.total(), **self._refused},
        )

    def _tell(self, lines: bytes, lost: int) -> None:
        router = self._router
        for what, role, address in router.peers.news():
            log.info(f"session_{what}", role=role, address=address)
        found: Refusals = read_log(lines)
        for zid, count in found.messages.items():
            self._refused["refused_messages"] += count
            log.warning("messages_refused", count=count, **router.peers.who(zid))
        for zid in found.strangers:
            self._refused["refused_strangers"] += 1
            log.warning("stranger_connected", zid=zid, may="nothing", **router.peers.who(zid))
        for reason, count in found.connections.items():
            self._refused["refused_connections"] += count
            log.warning("connection_refused", reason=reason, count=count)
        if lost:
            log.warning("refusals_not_logged", log_bytes=lost)


def _by_role(sessions: Counter[str]) -> dict[str, int]:
    return {role: count for role, count in sorted(sessions.items()) if role}
