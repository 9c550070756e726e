# pyright: basic, reportMissingModuleSource=false
"""The bus between processes, over Zenoh; the only door to that library.

Every process is a Zenoh client of one router. The library's threads only put what arrives into
bounded queues and set one event; everything else happens on the service's thread.

==========  =====================================================================================
LATEST      put, DROP, with ``boot:count`` attached; sent again every second
STREAM      put, DROP
REQUEST     query, BLOCK, to the answerer that matches best; an answer, an encoded ``Refused`` as
            the error, or nothing
liveliness  a token ``alive/<role>/<name>/<boot>``
==========  =====================================================================================

The client reconnects by itself within half a second of a router's return, but not always
(1 in 80 after long cuts): a watchdog opens a new session when none was seen for long.
"""

import contextlib
import secrets
import threading
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias, TypeVar

import structlog
import zenoh
from zenoh.handlers import Callback

from shared.bus.arrivals import take_answer, take_request, take_value
from shared.bus.base import NoAnswer, Refused
from shared.bus.config import BusConfig, client_json, warn_of_plain_network
from shared.bus.counters import Counters
from shared.bus.endpoints import Answer, Host, Present, Requests, Values, ask_of, too_long
from shared.bus.keys import PREFIX, check_chunk, is_chunk, key_of, pattern_of
from shared.bus.latest import LatestSent, stamp_of
from shared.bus.tls import check_files, files_of, why_refused
from shared.bus.watchdog import Watchdog
from shared.clock import Clock
from shared.errors import BusError, MessageError
from shared.messages.message import Message
from shared.messages.topics import Qos, Role, Service, Topic
from shared.messages.wire import encode

In = TypeVar("In", bound=Message)
Out = TypeVar("Out", bound=Message)

Declare: TypeAlias = Callable[[zenoh.Session], Any]
"""Declares something in a session; returns the library's object."""

UPKEEP_SECONDS = 0.25
CLOSE_SECONDS = 3.0
"""Longest wait for a session to close; a thread that hangs in it is left behind."""
MOST_RUNS = 64
"""Of one bus that are told apart."""
LOG_FILTER = "error,zenoh::api::session=off"
"""What Zenoh says on stdout, unless RUST_LOG says otherwise: nothing of what still comes for keys
that a session forgot as it was closed, which it calls an error."""

log = structlog.get_logger()


def open_zenoh(
    cfg: BusConfig, name: str, clock: Clock, run: str, role: Role = "operator"
) -> "ZenohBus":
    """Return a session on the bus, once a router has answered.

    Args:
        cfg: where the routers are.
        name: of this process, unique in the run.
        clock: a clock that moves by itself.
        run: name of the run; processes of other runs are not seen.
        role: whose certificate the process shows, where ``cfg`` has certificates.

    Raises:
        BusError: no router answered within ``cfg.open_seconds``.
        ConfigError: the certificates are not there, or an endpoint does not go with them.
        ValueError: ``name`` or ``run`` cannot be part of a key.
    """
    check_chunk("name", name)
    check_chunk("run", run)
    zenoh.init_log_from_env_or(LOG_FILTER)
    if cfg.certificates:
        check_files(cfg.certificates, role)
    config = client_json(cfg, role)
    warn_of_plain_network(cfg)
    endpoints = ", ".join(cfg.routers)
    began_at = clock.now()
    told = False
    while True:
        try:
            return ZenohBus(cfg, name, clock, run, open_session(config), config)
        except zenoh.ZError as error:
            waited = clock.now() - began_at
            if waited > cfg.open_seconds:
                raise BusError(_no_session(cfg, role)) from error
            if waited > 1.0 and not told:
                told = True
                log.info("router_awaited", endpoints=endpoints, deadline=cfg.open_seconds)
            threading.Event().wait(0.1)


def _no_session(cfg: BusConfig, role: Role) -> str:
    """Return what a person should look at when no session opens."""
    where = f"no router at {', '.join(cfg.routers)} within {cfg.open_seconds:g} s"
    tls = [one for one in cfg.routers if one.startswith("tls/")]
    if cfg.certificates and tls:
        reasons = [(one, why_refused(one, files_of(cfg.certificates, role))) for one in tls]
        if said := "; ".join(f"{one}: {reason}" for one, reason in reasons if reason):
            return f"{where}: {said}"
    return f"{where}: start one with `riposte router`, or name another endpoint with --connect"


class ZenohBus:
    """One process's session; made by ``open_zenoh``."""

    def __init__(
        self,
        cfg: BusConfig,
        name: str,
        clock: Clock,
        run: str,
        session: zenoh.Session,
        config: str,
    ) -> None:
        """Take over a session; ``config`` is what it was opened with, to open the next."""
        self.name = name
        self.boot = secrets.token_hex(8)
        self._clock = clock
        self._routers = cfg.routers
        self._prefix = f"{PREFIX}/{run}/"
        self._counts = Counters()
        self._news = threading.Event()
        self._host = Host(
            clock, self._counts, self._news.set, cfg.inbox_messages, cfg.inbox_mib << 20
        )
        self._watchdog = Watchdog(
            cfg, clock, session, _has_router, lambda: _try_open(config), close_session
        )
        self._declared: dict[object, tuple[Declare, Any]] = {}
        self._present: dict[str, Present] = {}
        self._latest = LatestSent(cfg.resend_seconds - UPKEEP_SECONDS / 2)
        self._published = 0
        self._upkeep_at = 0.0

    @property
    def counters(self) -> Mapping[str, int]:
        """Return counts since the start."""
        return self._counts.read()

    def publish(self, topic: Topic[Out], message: Out, **fields: str) -> None:
        """Send a value without waiting; a slow link drops it, and LATEST sends it again."""
        key = self._prefix + key_of(topic.key, fields)
        payload = encode(message)
        if len(payload) > topic.max_bytes:
            self._counts.add("refused_messages")
            log.warning("value_refused", reason=too_long(len(payload), key, topic.max_bytes))
            return
        stamp = stamp_of(self.boot, self._published)
        self._published += 1
        if topic.qos is Qos.LATEST:
            self._latest.keep(key, payload, stamp, self._clock.now())
        self._put(key, payload, stamp, topic.qos)

    def subscribe(self, topic: Topic[Out], **fields: str) -> Values[Out]:
        """Listen; a LATEST topic's present values are there within a second."""
        pattern = self._prefix + pattern_of(topic.key, fields)
        values = Values(self._host, topic, pattern, self._undeclare)
        callback = self._guard(
            lambda it: take_value(values, str(it.key_expr), it.payload, it.attachment)
        )
        self._declare(values, lambda session: session.declare_subscriber(pattern, callback))
        return values

    def answer(self, service: Service[In, Out], **fields: str) -> Requests[In, Out]:
        """Offer a service."""
        key = self._prefix + key_of(service.key, fields)
        inbox = Requests(self._host, service, key, self._undeclare)
        callback = self._guard(lambda query: take_request(inbox, query.payload, _Path(query, key)))
        self._declare(
            inbox, lambda session: session.declare_queryable(key, callback, complete=True)
        )
        return inbox

    def ask(
        self, service: Service[In, Out], message: In, timeout: float, **fields: str
    ) -> Answer[Out]:
        """Send a request; a congested link may hold this up for ``block_seconds``."""
        key = key_of(service.key, fields)
        answer, payload = ask_of(self._host, service, key, message, timeout)
        if payload is None:
            return answer
        if (session := self._watchdog.session) is None:
            answer.on_arrival(NoAnswer(f"{self._watchdog.without_router()} to carry {key}"))
            return answer
        callback = self._guard(
            lambda reply: take_answer(
                answer, reply.ok and reply.ok.payload, reply.err and reply.err.payload
            ),
            answer.on_end,
        )
        try:
            session.get(
                self._prefix + key,
                callback,
                payload=payload,
                timeout=max(timeout, 0.001),
                target=zenoh.QueryTarget.BEST_MATCHING,
                consolidation=zenoh.ConsolidationMode.NONE,
                congestion_control=zenoh.CongestionControl.BLOCK,
                priority=zenoh.Priority.DATA,
            )
            self._counts.sent(len(payload))
        except zenoh.ZError as error:
            answer.on_arrival(NoAnswer(f"{key} cannot be asked: {error}"))
        return answer

    def declare_alive(self, role: str) -> None:
        """Let others see this process for as long as its session lives."""
        check_chunk("role", role)
        token = f"{self._prefix}alive/{role}/{self.name}/{self.boot}"
        if token not in self._declared:
            self._declare(token, lambda session: session.liveliness().declare_token(token))

    def alive(self, role: str) -> frozenset[str]:
        """Return the names of living processes; complete a moment after the first call."""
        present = self._present.get(role)
        if present is None:
            check_chunk("role", role)
            present = self._present[role] = Present()
            pattern = f"{self._prefix}alive/{role}/*/*"
            callback = self._guard(lambda token: _note_token(present, token))
            self._declare(
                present,
                lambda session: session.liveliness().declare_subscriber(
                    pattern, callback, history=True
                ),
            )
        return present.names()

    def runs(self, topic: Topic[Any], seconds: float) -> frozenset[str]:
        """Return the runs on this bus, its own or not, that say something of a topic meanwhile.

        Raises:
            BusError: as ``wait``.
        """
        names: set[str] = set()
        pattern = f"{PREFIX}/*/{pattern_of(topic.key, {})}"
        callback = self._guard(lambda it: _note_run(names, str(it.key_expr)))
        self._declare(names_owner := object(), lambda it: it.declare_subscriber(pattern, callback))
        until = self._clock.now() + seconds
        while (left := until - self._clock.now()) > 0:
            self.wait(left)
        self._undeclare(names_owner)
        return frozenset(names)

    def wait(self, timeout: float) -> bool:
        """Wait until something new arrives, at most ``timeout`` seconds; do the upkeep.

        Raises:
            BusError: no router for ``give_up_seconds``.
        """
        deadline = self._clock.now() + timeout
        while True:
            now = self._clock.now()
            if now >= self._upkeep_at:
                self._upkeep_at = now + UPKEEP_SECONDS
                if self._watchdog.look(now):
                    self._restore()
                for sent in self._latest.due(now):
                    self._put(sent.key, sent.payload, sent.stamp, Qos.LATEST)
            if self._news.is_set():
                self._news.clear()
                return True
            if now >= deadline:
                return False
            self._news.wait(min(deadline, self._upkeep_at) - now)

    def close(self) -> None:
        """Leave the bus, in ``CLOSE_SECONDS`` at most."""
        self._watchdog.close()

    def _guard(
        self, take: Callable[[Any], None], end: Callable[[], None] | None = None
    ) -> "Callback[Any]":
        """Return a callback that says what went wrong; Zenoh would swallow it."""

        def run(argument: Any) -> None:
            try:
                take(argument)
            except MessageError as error:
                self._counts.add("refused_messages")
                log.warning("value_refused", reason=str(error))
            except Exception:
                log.exception("bus_callback_failed")

        return Callback(run, end)

    def _put(self, key: str, payload: bytes, stamp: bytes, qos: Qos) -> None:
        if (session := self._watchdog.session) is None:
            return
        latest = qos is Qos.LATEST
        with contextlib.suppress(zenoh.ZError):  # the watchdog sees a closed session
            session.put(
                key,
                payload,
                attachment=stamp,
                congestion_control=zenoh.CongestionControl.DROP,
                priority=zenoh.Priority.DATA_HIGH if latest else zenoh.Priority.DATA_LOW,
            )
            self._counts.sent(len(payload))

    def _declare(self, owner: object, declare: Declare) -> None:
        """Declare something now and in every later session, until its owner is closed."""
        entity = None
        if (session := self._watchdog.session) is not None:
            with contextlib.suppress(zenoh.ZError):  # a closed session: the watchdog's business
                entity = declare(session)
        self._declared[owner] = (declare, entity)

    def _undeclare(self, owner: object) -> None:
        _, entity = self._declared.pop(owner, (None, None))
        if entity is not None:
            with contextlib.suppress(zenoh.ZError):
                entity.undeclare()

    def _restore(self) -> None:
        """Declare everything in the new session, and send every LATEST value again."""
        self._counts.add("reconnects")
        for present in self._present.values():
            present.clear()
        for owner, (declare, _) in list(self._declared.items()):
            self._declare(owner, declare)
        for sent in self._latest.all():
            self._put(sent.key, sent.payload, sent.stamp, Qos.LATEST)
        self._news.set()
        log.info("session_restored", routers=", ".join(self._routers))


class _Path:
    """The way back to an asker: its query, which must be dropped to end."""

    def __init__(self, query: zenoh.Query, key: str) -> None:
        self._query = query
        self._key = key

    def reply(self, payload: bytes) -> None:
        with contextlib.suppress(zenoh.ZError), self._query:  # the asker may have left
            self._query.reply(self._key, payload)

    def refuse(self, refusal: Refused) -> None:
        with contextlib.suppress(zenoh.ZError), self._query:
            self._query.reply_err(encode(refusal))

    def drop(self) -> None:
        self._query.drop()


def _note_token(present: Present, token: zenoh.Sample) -> None:
    key = str(token.key_expr)
    present.on_token(key, key.split("/")[-2], token.kind == zenoh.SampleKind.PUT)


def _note_run(names: set[str], key: str) -> None:
    name = key.removeprefix(f"{PREFIX}/").partition("/")[0]
    if len(names) < MOST_RUNS and is_chunk(name):  # another is none of ours, and people see these
        names.add(name)


def open_session(config: str) -> zenoh.Session:
    """Return a session of Zenoh's own.

    Raises:
        ZError: it does not open.
    """
    return zenoh.open(zenoh.Config.from_json5(config))


def _has_router(session: zenoh.Session) -> bool:
    return bool(session.info.routers_zid())


def _try_open(config: str) -> zenoh.Session | None:
    with contextlib.suppress(zenoh.ZError):
        return open_session(config)
    return None


def close_session(session: zenoh.Session) -> None:
    """Close a session, at most ``CLOSE_SECONDS`` long."""

    def close() -> None:
        with contextlib.suppress(zenoh.ZError):
            session.close()

    thread = threading.Thread(target=close, name="bus-close", daemon=True)
    thread.start()
    thread.join(CLOSE_SECONDS)
    if thread.is_alive():
        log.warning("session_left_open", after_seconds=CLOSE_SECONDS)
