# pyright: basic, reportMissingModuleSource=false
"""A Zenoh router in this process, with who is connected to it."""

import contextlib
import secrets
from collections import Counter
from collections.abc import Mapping
from typing import TypeVar

import zenoh

from shared.bus.config import BusConfig, router_json, warn_of_plain_network
from shared.bus.counters import Counters
from shared.bus.endpoints import Present
from shared.bus.keys import PREFIX, check_chunk, key_of
from shared.bus.latest import stamp_of
from shared.bus.peers import Peers
from shared.bus.tls import check_files
from shared.bus.zenoh import close_session, open_session
from shared.errors import ConfigError
from shared.messages.message import Message
from shared.messages.topics import Topic
from shared.messages.wire import encode

Out = TypeVar("Out", bound=Message)

MOST_RUNS = 64
"""To which a router says how it is."""


class Router:
    """A Zenoh router in this process."""

    def __init__(
        self, session: zenoh.Session, endpoints: tuple[str, ...], name: str = "router-0"
    ) -> None:
        self.endpoints = endpoints
        self.name = name
        self.boot = secrets.token_hex(8)
        self.peers = Peers()
        self._session = session
        self._counts = Counters()
        self._published = 0
        self._runs = Present()
        self._events = session.info.declare_link_events_listener(self._note, history=True)
        self._tokens = session.liveliness().declare_subscriber(
            f"{PREFIX}/*/alive/*/*/*", self._note_token, history=True
        )

    @property
    def counters(self) -> Mapping[str, int]:
        """Return what was counted of its own values; what it carries is not in it."""
        return self._counts.read()

    def runs(self) -> frozenset[str]:
        """Return the runs of which a process is alive."""
        return self._runs.names()

    def publish(self, topic: Topic[Out], message: Out, **fields: str) -> None:
        """Send a value to every run that is on; a router belongs to none.

        Raises:
            ValueError: a field of the key is not what the topic says.
        """
        key, payload = key_of(topic.key, fields), encode(message)
        for run in sorted(self.runs())[:MOST_RUNS]:
            stamp = stamp_of(self.boot, self._published)
            self._published += 1
            with contextlib.suppress(zenoh.ZError):  # a run's key that is none
                self._session.put(
                    f"{PREFIX}/{run}/{key}", payload, attachment=stamp,
                    congestion_control=zenoh.CongestionControl.DROP,
                )  # fmt: skip
                self._counts.sent(len(payload))

    def sessions(self) -> Counter[str]:
        """Return how many processes are connected, by role; those without are under ``""``."""
        return Counter(link.auth_identifier or "" for link in self._session.info.links())

    def _note(self, event: zenoh.LinkEvent) -> None:
        link, came = event.link, event.kind == zenoh.SampleKind.PUT
        self.peers.note(str(link.zid), link.auth_identifier or "", str(link.dst), came=came)

    def _note_token(self, token: zenoh.Sample) -> None:
        key = str(token.key_expr)
        run = key.removeprefix(f"{PREFIX}/").partition("/")[0]
        self._runs.on_token(key, run, token.kind == zenoh.SampleKind.PUT)

    def close(self) -> None:
        """Stop routing."""
        close_session(self._session)


def open_router(cfg: BusConfig, log_filter: str = "off", name: str = "router-0") -> Router:
    """Return a running router on ``cfg.listen``.

    Args:
        cfg: of the bus.
        log_filter: what the library writes to stdout; it would repeat our one line in twenty.
        name: of this process.

    Raises:
        ConfigError: it cannot listen there, or its certificate is not there.
    """
    check_chunk("name", name)
    if cfg.certificates:
        check_files(cfg.certificates, "router")
    config = router_json(cfg)
    warn_of_plain_network(cfg)
    zenoh.init_log_from_env_or(log_filter)
    try:
        return Router(open_session(config), cfg.listen, name)
    except zenoh.ZError as error:
        text = str(error)
        where = ", ".join(cfg.listen)
        if "in use" in text:
            raise ConfigError(
                f"cannot listen on {where}: the port is in use; stop the other router, "
                "or give another endpoint with --listen"
            ) from error
        raise ConfigError(f"cannot listen on {where}: {text.split(' at /')[0]}") from error
