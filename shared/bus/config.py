"""The ``[bus]`` section of a site file, and what it means to Zenoh."""

import ipaddress
import json
import re
from collections.abc import Sequence
from typing import Any

import msgspec
import structlog

from shared.bus.access import access_control, size_limits
from shared.bus.tls import files_of, tls_json
from shared.errors import ConfigError
from shared.messages.topics import MIB, SERVICES, TOPICS, Role

MAX_MESSAGE = max(
    *(topic.max_bytes for topic in TOPICS),
    *(max(service.max_bytes, service.max_reply_bytes) for service in SERVICES),
) + MIB  # fmt: skip
"""Nothing longer leaves the network layer (bytes)."""

MAX_NAMED = 4 * MAX_MESSAGE
"""Up to here a locked router reads a message that is too long, to say whose it was (bytes): what is
longer the library throws away without a word."""

SHARED_MEMORY_POOLS = {"actor": 4 * MIB}
"""What a process passes to others at a time, by role (bytes); what does not fit goes through the
socket, and so does everything of other roles. Rollouts, 0.9 MB at the default sizes, are nearly all
that is sent; a router passes on where they lie. Whoever gets something this way maps the pool of
its sender and keeps 4 MB of books beside it, so an actor had 27 MB for a policy a second."""

_ENDPOINT = re.compile(
    r"(?P<protocol>tcp|tls|quic)/(?P<host>\[[0-9a-fA-F:.]+\]|[^:/\[\]?#]+):[0-9]{1,5}"
)
_ENCRYPTED = ("tls", "quic")


log = structlog.get_logger()


class BusConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the processes of a site reach each other."""

    connect: tuple[str, ...] = ()
    """Endpoints of routers, tried in order; empty: those of ``listen``."""
    listen: tuple[str, ...] = ("tcp/127.0.0.1:7447",)
    """Where this site's router listens; only itself by default."""
    certificates: str = ""
    """Folder of ``riposte certs``: encrypted, and everyone known by role. Empty: this machine
    only."""
    plain_network: bool = False
    """Let anyone on the network read and command everything, where certificates is empty."""
    open_seconds: float = 10.0
    """How long a process waits for a router when it starts."""
    watchdog_seconds: float = 5.0
    """Without a router for so long, the session is opened anew."""
    give_up_seconds: float = 60.0
    """Without a router for so long, the process exits for its supervisor to restart it."""
    lease_seconds: float = 2.0
    """A silent link is given up after this; a dead process is noticed at once."""
    block_seconds: float = 2.0
    """Longest time a send may wait for a congested link."""
    resend_seconds: float = 1.0
    """Period in which LATEST values are sent again."""
    inbox_messages: int = 64
    """Requests that may wait in one inbox, values in one STREAM subscription."""
    inbox_mib: int = 64
    """The same, in MiB."""
    shared_memory: bool = True
    """Pass large messages between processes of one machine through /dev/shm."""

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        for name in ("connect", "listen"):
            for endpoint in getattr(self, name):
                if not _ENDPOINT.fullmatch(endpoint):
                    raise ValueError(
                        f"{name} has {endpoint!r}, expected an endpoint such as tcp/127.0.0.1:7447"
                    )
        if not self.connect and not self.listen:
            raise ValueError("connect and listen are both empty: give an endpoint to one of them")
        self._check_network()
        for name in (
            "open_seconds", "watchdog_seconds", "give_up_seconds", "lease_seconds",
            "block_seconds", "resend_seconds",
        ):  # fmt: skip
            value = getattr(self, name)
            if not 0.1 <= value <= 3600:
                raise ValueError(f"{name} ({value} s) must be between 0.1 and 3600")
        if self.give_up_seconds < self.watchdog_seconds:
            raise ValueError(
                f"give_up_seconds ({self.give_up_seconds}) must be at least "
                f"watchdog_seconds ({self.watchdog_seconds})"
            )
        for name in ("inbox_messages", "inbox_mib"):
            value = getattr(self, name)
            if not 1 <= value <= 65536:
                raise ValueError(f"{name} ({value}) must be between 1 and 65536")

    def with_endpoints(
        self, connect: tuple[str, ...] = (), listen: tuple[str, ...] = ()
    ) -> "BusConfig":
        """Return the same with other endpoints where some are given, as on a command line.

        Raises:
            ConfigError: one of them is not an endpoint.
        """
        try:
            return msgspec.structs.replace(
                self, connect=connect or self.connect, listen=listen or self.listen
            )
        except ValueError as error:
            raise ConfigError(str(error)) from error

    @property
    def routers(self) -> tuple[str, ...]:
        """Return the endpoints a client connects to."""
        return self.connect or self.listen

    @property
    def exposed(self) -> tuple[str, ...]:
        """Return the endpoints that other machines can reach, or that are on them."""
        return tuple(one for one in (*self.connect, *self.listen) if not _is_loopback(one))

    @property
    def local_protocol(self) -> str:
        """Return how the processes of one machine reach their router."""
        return "tls" if self.certificates else "tcp"

    def _check_network(self) -> None:
        if self.certificates and self.plain_network:
            raise ValueError(
                "plain_network is for a bus without certificates: leave one of them out"
            )
        if self.plain_network:
            return
        for name in ("connect", "listen"):
            for endpoint in getattr(self, name):
                if _is_loopback(endpoint):
                    continue
                if not self.certificates:
                    raise ValueError(
                        f"{name} has {endpoint}, which is off this machine, and there are no "
                        "certificates: make them with `riposte certs DIR --host NAME_OR_ADDRESS`, "
                        'and say where they are with certificates = "DIR" in [bus] or '
                        "--certificates DIR"
                    )
                _check_encrypted(name, endpoint)


def warn_of_plain_network(cfg: BusConfig) -> None:
    """Log once that everybody on the network may read and command everything."""
    if cfg.plain_network and cfg.exposed:
        log.warning("network_unprotected", endpoints=", ".join(cfg.exposed))


def client_json(cfg: BusConfig, role: Role) -> str:
    """Return Zenoh's configuration of a client: no scouting, no open socket.

    Raises:
        ConfigError: there are certificates, and an endpoint is not encrypted.
    """
    config: dict[str, Any] = {
        "mode": "client",
        "connect": {
            "endpoints": list(cfg.routers),
            "timeout_ms": 500,
            "exit_on_failure": True,
            "retry": {
                "period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 1.5,
            },
        },
        "listen": {"endpoints": []},
        **_common(cfg, role),
    }  # fmt: skip
    _secure(config, cfg, role, "connect", cfg.routers)
    return json.dumps(config)


def router_json(cfg: BusConfig) -> str:
    """Return Zenoh's configuration of a router, for ours and for zenohd.

    Raises:
        ConfigError: it has no endpoint, or there are certificates and one is not encrypted.
    """
    if not cfg.listen:
        raise ConfigError(
            "[bus] listen is empty: a router needs an endpoint, as tcp/127.0.0.1:7447"
        )
    config: dict[str, Any] = {
        "mode": "router",
        "connect": {"endpoints": list(cfg.connect)},
        "listen": {"endpoints": list(cfg.listen), "exit_on_failure": True, "timeout_ms": 0},
        **_common(cfg, "router"),
    }
    config["transport"]["unicast"] = {
        "max_sessions": 5000, "accept_pending": 1000, "accept_timeout": 2000,
    }  # fmt: skip
    _secure(config, cfg, "router", "listen", (*cfg.listen, *cfg.connect))
    if cfg.certificates:
        config["access_control"] = access_control()
        config["low_pass_filter"] = size_limits()
        config["transport"]["link"]["rx"]["max_message_size"] = MAX_NAMED
    return json.dumps(config, indent=1)


def _secure(
    config: dict[str, Any], cfg: BusConfig, role: str, name: str, endpoints: Sequence[str]
) -> None:
    """Say which protocols are spoken, and with which certificates."""
    link = config["transport"]["link"]
    link["protocols"] = sorted({endpoint.partition("/")[0] for endpoint in endpoints})
    if not cfg.certificates:
        return
    for endpoint in endpoints:
        try:
            _check_encrypted(name, endpoint)
        except ValueError as error:
            raise ConfigError(f"[bus] {error}") from error
    link["tls"] = tls_json(files_of(cfg.certificates, role))


def _check_encrypted(name: str, endpoint: str) -> None:
    protocol, _, rest = endpoint.partition("/")
    if protocol not in _ENCRYPTED:
        raise ValueError(f"{name} has {endpoint}, and there are certificates: say tls/{rest}")


def _is_loopback(endpoint: str) -> bool:
    """Return whether an endpoint is only for this machine."""
    found = _ENDPOINT.fullmatch(endpoint)
    host = found["host"].strip("[]") if found else ""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _common(cfg: BusConfig, role: str) -> dict[str, Any]:
    return {
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "adminspace": {"enabled": False},
        "transport": {
            "link": {
                "rx": {"max_message_size": MAX_MESSAGE},
                "tx": {
                    "lease": round(cfg.lease_seconds * 1000),
                    "queue": {
                        "size": {"data": 16, "data_high": 16},
                        "congestion_control": {
                            "block": {"wait_before_close": round(cfg.block_seconds * 1e6)}
                        },
                    },
                },
            },
            "shared_memory": {"enabled": cfg.shared_memory, "transport_optimization": _pool(role)},
        },
    }


def _pool(role: str) -> dict[str, Any]:
    """Return how a role passes large messages on by itself."""
    size = SHARED_MEMORY_POOLS.get(role)
    return {"enabled": False} if size is None else {"enabled": True, "pool_size": size}
