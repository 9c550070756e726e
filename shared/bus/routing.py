# pyright: basic, reportMissingModuleSource=false
"""A Zenoh router in this process, with who is connected to it."""

from collections import Counter

import zenoh

from shared.bus.config import BusConfig, router_json, warn_of_plain_network
from shared.bus.peers import Peers
from shared.bus.tls import check_files
from shared.bus.zenoh import close_session, open_session
from shared.errors import ConfigError


class Router:
    """A Zenoh router in this process."""

    def __init__(self, session: zenoh.Session, endpoints: tuple[str, ...]) -> None:
        self.endpoints = endpoints
        self.peers = Peers()
        self._session = session
        self._events = session.info.declare_link_events_listener(self._note, history=True)

    def sessions(self) -> Counter[str]:
        """Return how many processes are connected, by role; those without are under ``""``."""
        return Counter(link.auth_identifier or "" for link in self._session.info.links())

    def _note(self, event: zenoh.LinkEvent) -> None:
        link, came = event.link, event.kind == zenoh.SampleKind.PUT
        self.peers.note(str(link.zid), link.auth_identifier or "", str(link.dst), came=came)

    def close(self) -> None:
        """Stop routing."""
        close_session(self._session)


def open_router(cfg: BusConfig, log_filter: str = "off") -> Router:
    """Return a running router on ``cfg.listen``.

    Args:
        cfg: of the bus.
        log_filter: what the library writes to stdout; it would repeat our one line in twenty.

    Raises:
        ConfigError: it cannot listen there, or its certificate is not there.
    """
    if cfg.certificates:
        check_files(cfg.certificates, "router")
    config = router_json(cfg)
    warn_of_plain_network(cfg)
    zenoh.init_log_from_env_or(log_filter)
    try:
        return Router(open_session(config), cfg.listen)
    except zenoh.ZError as error:
        text = str(error)
        where = ", ".join(cfg.listen)
        if "in use" in text:
            raise ConfigError(
                f"cannot listen on {where}: the port is in use; stop the other router, "
                "or give another endpoint with --listen"
            ) from error
        raise ConfigError(f"cannot listen on {where}: {text.split(' at /')[0]}") from error
