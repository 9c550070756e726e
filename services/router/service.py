"""The router's loop: it only waits, the library routes on its own threads."""

import threading

import structlog

from shared.bus.config import BusConfig
from shared.bus.zenoh import open_router

REPORT_SECONDS = 10.0
"""Period in which the number of connected processes is looked at."""

log = structlog.get_logger()


def run(cfg: BusConfig, stop: threading.Event) -> None:
    """Route on ``cfg.listen`` until ``stop`` is set.

    Raises:
        ConfigError: it cannot listen there.
    """
    router = open_router(cfg)
    log.info("router_started", endpoints=list(router.endpoints))
    connected = -1
    try:
        while not stop.wait(REPORT_SECONDS):
            if router.num_sessions != connected:
                connected = router.num_sessions
                log.info("sessions_counted", sessions=connected)
    finally:
        router.close()
        log.info("router_stopped")
