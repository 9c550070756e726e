"""The router's loop: the library routes on its own threads; this says who came and was refused."""

import threading
from collections import Counter

import structlog

from services.router.listening import LibraryLog
from shared.bus.config import BusConfig
from shared.bus.refusals import LOG_FILTER, Refusals, read_log
from shared.bus.routing import Router, open_router

LOOK_SECONDS = 1.0
"""Period of looking at what was refused; each session is in at most one line of each."""
LOOKS_PER_COUNT = 10
"""After so many looks the connected processes are counted."""

log = structlog.get_logger()


def run(cfg: BusConfig, stop: threading.Event) -> None:
    """Route on ``cfg.listen`` until ``stop`` is set.

    Raises:
        ConfigError: it cannot listen there.
    """
    library = LibraryLog() if cfg.certificates else None
    router = open_router(cfg, LOG_FILTER if library else "off")
    log.info("router_started", endpoints=list(router.endpoints))
    connected: Counter[str] = Counter({"": -1})
    looks = 0
    try:
        while not stop.wait(LOOK_SECONDS):
            if library is not None:
                tell(router, *library.take())
            looks += 1
            if looks % LOOKS_PER_COUNT == 0 and (now := router.sessions()) != connected:
                connected = now
                roles = {role: count for role, count in sorted(now.items()) if role}
                log.info("sessions_counted", sessions=now.total(), **roles)
    finally:
        if library is not None:
            tell(router, *library.take())
        router.close()
        log.info("router_stopped")


def tell(router: Router, lines: bytes, lost: int) -> None:
    """Log who came and went, and who was refused how much."""
    for what, role, address in router.peers.news():
        log.info(f"session_{what}", role=role, address=address)
    found: Refusals = read_log(lines)
    for zid, count in found.messages.items():
        log.warning("messages_refused", count=count, **router.peers.who(zid))
    for zid in found.strangers:
        log.warning("stranger_connected", zid=zid, may="nothing", **router.peers.who(zid))
    for reason, count in found.connections.items():
        log.warning("connection_refused", reason=reason, count=count)
    if lost:
        log.warning("refusals_not_logged", log_bytes=lost)
