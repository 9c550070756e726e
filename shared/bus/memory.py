"""The bus inside one process and one thread: serial training and tests.

Everything passes through the wire format, so that serial mode checks what the real bus checks.
Nothing depends on time of day, thread timing or memory layout: the same calls give the same
answers in the same order.
"""

import dataclasses
import hashlib
from collections.abc import Mapping
from typing import Any, TypeVar

from shared.bus.base import NoAnswer, Refused
from shared.bus.counters import Counters
from shared.bus.endpoints import Answer, Host, Requests, Values, ask_of
from shared.bus.keys import check_chunk, key_of, matches, pattern_of
from shared.clock import Clock
from shared.messages.message import Message
from shared.messages.topics import Qos, Service, Topic
from shared.messages.wire import encode

In = TypeVar("In", bound=Message)
Out = TypeVar("Out", bound=Message)


@dataclasses.dataclass(frozen=True)
class _Value:
    """A published value."""

    key: str
    boot: str
    count: int
    payload: bytes


class MemoryHub:
    """Where the buses of one process meet."""

    def __init__(self, clock: Clock, *, max_messages: int = 64, max_bytes: int = 64 << 20) -> None:
        """Make an empty hub.

        Args:
            clock: decides when a request has waited too long.
            max_messages: bound of every inbox and STREAM subscription.
            max_bytes: the same, in bytes.
        """
        self.clock = clock
        self.max_messages = max_messages
        self.max_bytes = max_bytes
        self.buses: list[MemoryBus] = []
        self.latest: dict[str, _Value] = {}
        self._joins: dict[str, int] = {}

    def join(self, name: str, boot: str | None = None) -> "MemoryBus":
        """Return a new end of the bus.

        Args:
            name: of the process it stands for.
            boot: its identity; by default one that depends only on the name and on how often
                it has joined this hub, so that a resumed serial run continues under the same.
        """
        check_chunk("name", name)
        joins = self._joins[name] = self._joins.get(name, 0) + 1
        if boot is None:
            boot = hashlib.sha256(f"{name}/{joins}".encode()).hexdigest()[:16]
        bus = MemoryBus(self, name, boot)
        self.buses.append(bus)
        return bus


class MemoryBus:
    """One end of a MemoryHub."""

    def __init__(self, hub: MemoryHub, name: str, boot: str) -> None:
        self.name = name
        self.boot = boot
        self.subscriptions: list[Values[Any]] = []
        self.inboxes: list[Requests[Any, Any]] = []
        self.roles: set[str] = set()
        self.open_paths: dict[_Path, None] = {}
        """Ways back to askers that have no answer from this bus yet."""
        self._counts = Counters()
        self._host = Host(hub.clock, self._counts, self._wake, hub.max_messages, hub.max_bytes)
        self._hub = hub
        self._published = 0
        self._news = False
        self._is_closed = False

    @property
    def counters(self) -> Mapping[str, int]:
        """Return counts since the start."""
        return self._counts.read()

    def publish(self, topic: Topic[Out], message: Out, **fields: str) -> None:
        """Give a value to every subscription; keep a LATEST one for those that come later."""
        key = key_of(topic.key, fields)
        payload = encode(message)
        if len(payload) > topic.max_bytes:
            self._counts.add("refused_messages")
            return
        if self._is_closed:
            return
        value = _Value(key, self.boot, self._published, payload)
        self._published += 1
        self._counts.sent(len(payload))
        if topic.qos is Qos.LATEST:
            self._hub.latest[key] = value
        for bus in self._hub.buses:
            for subscription in bus.subscriptions:
                _offer(subscription, value)

    def subscribe(self, topic: Topic[Out], **fields: str) -> Values[Out]:
        """Listen; a LATEST topic's present values are there at once."""
        pattern = pattern_of(topic.key, fields)
        subscription = Values(self._host, topic, pattern, self._unsubscribe)
        self.subscriptions.append(subscription)
        for value in self._hub.latest.values():
            _offer(subscription, value)
        return subscription

    def answer(self, service: Service[In, Out], **fields: str) -> Requests[In, Out]:
        """Offer a service."""
        inbox = Requests(self._host, service, key_of(service.key, fields), self._unanswer)
        self.inboxes.append(inbox)
        return inbox

    def ask(
        self, service: Service[In, Out], message: In, timeout: float, **fields: str
    ) -> Answer[Out]:
        """Put a request into the inbox of the answerer that came first."""
        key = key_of(service.key, fields)
        answer, payload = ask_of(self._host, service, key, message, timeout)
        if payload is None:
            return answer
        offers = ((bus, inbox) for bus in self._hub.buses for inbox in bus.inboxes)
        found = next(((bus, inbox) for bus, inbox in offers if inbox.key == key), None)
        if found is None or self._is_closed:
            answer.on_end()
            return answer
        bus, inbox = found
        self._counts.sent(len(payload))
        path = _Path(bus, answer)
        bus.open_paths[path] = None
        if inbox.accepts(len(payload), path):
            inbox.offer(payload, path)
        return answer

    def declare_alive(self, role: str) -> None:
        """Let others see this bus until it is closed."""
        check_chunk("role", role)
        self.roles.add(role)

    def alive(self, role: str) -> frozenset[str]:
        """Return the names of the open buses of a role."""
        return frozenset(bus.name for bus in self._hub.buses if role in bus.roles)

    def wait(self, timeout: float) -> bool:
        """Return at once whether something arrived since the previous call."""
        del timeout  # nothing can arrive while the only thread waits
        news, self._news = self._news, False
        return news

    def close(self) -> None:
        """Leave; requests that this bus has not answered end without an answer."""
        if self._is_closed:
            return
        self._is_closed = True
        self._hub.buses.remove(self)
        for path in list(self.open_paths):
            path.drop()
        self.inboxes.clear()
        self.subscriptions.clear()
        latest = self._hub.latest
        for key in [key for key, value in latest.items() if value.boot == self.boot]:
            del latest[key]

    def _wake(self) -> None:
        self._news = True

    def _unsubscribe(self, subscription: Values[Any]) -> None:
        if subscription in self.subscriptions:
            self.subscriptions.remove(subscription)

    def _unanswer(self, inbox: Requests[Any, Any]) -> None:
        if inbox in self.inboxes:
            self.inboxes.remove(inbox)


class _Path:
    """The way back to an asker on the same hub."""

    def __init__(self, bus: MemoryBus, answer: Answer[Any]) -> None:
        self._bus = bus
        self._answer = answer

    def reply(self, payload: bytes) -> None:
        self._end(payload)

    def refuse(self, refusal: Refused) -> None:
        encode(refusal)  # what could not travel is an error here, too
        self._end(refusal)

    def drop(self) -> None:
        self._end(NoAnswer(f"{self._bus.name} left without an answer"))

    def _end(self, outcome: Refused | NoAnswer | bytes) -> None:
        if self._bus.open_paths.pop(self, self) is None:
            self._answer.on_arrival(outcome)


def _offer(subscription: Values[Any], value: _Value) -> None:
    if matches(subscription.pattern, value.key):
        subscription.offer(value.key, value.boot, value.count, value.payload)
