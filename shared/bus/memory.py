"""The bus inside one process and one thread: serial training and tests.

Everything passes through the wire format, so that serial mode checks what the real bus checks.
Nothing depends on time of day, thread timing or memory layout: the same calls give the same
answers in the same order.
"""

import dataclasses
import hashlib
from collections.abc import Mapping
from typing import Any, Generic, TypeVar

from shared.bus.base import NoAnswer, Refused
from shared.bus.counters import Counters
from shared.bus.keys import check_chunk, key_of, matches, pattern_of
from shared.bus.queues import Fifo, Newest
from shared.clock import Clock
from shared.errors import MessageError
from shared.messages.message import Message
from shared.messages.topics import Qos, Service, Topic
from shared.messages.wire import decode, encode

In = TypeVar("In", bound=Message)
Out = TypeVar("Out", bound=Message)


@dataclasses.dataclass(frozen=True)
class _Value:
    """A value under way."""

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
        self.counts = Counters()
        self.subscriptions: list[_Subscription[Any]] = []
        self.inboxes: list[_Inbox[Any, Any]] = []
        self.roles: set[str] = set()
        self.is_closed = False
        self._hub = hub
        self._published = 0
        self._news = False

    @property
    def counters(self) -> Mapping[str, int]:
        """Return counts since the start."""
        return self.counts.read()

    def publish(self, topic: Topic[Out], message: Out, **fields: str) -> None:
        """Give a value to every subscription; keep a LATEST one for those that come later."""
        key = key_of(topic.key, fields)
        payload = encode(message)
        if len(payload) > topic.max_bytes:
            self.counts.add("refused_messages")
            return
        if self.is_closed:
            return
        value = _Value(key, self.boot, self._published, payload)
        self._published += 1
        self.counts.sent(len(payload))
        if topic.qos is Qos.LATEST:
            self._hub.latest[key] = value
        for bus in self._hub.buses:
            for subscription in bus.subscriptions:
                subscription.offer(value)

    def subscribe(self, topic: Topic[Out], **fields: str) -> "_Subscription[Out]":
        """Listen; a LATEST topic's present values are there at once."""
        subscription = _Subscription(self, self._hub, topic, pattern_of(topic.key, fields))
        self.subscriptions.append(subscription)
        for value in self._hub.latest.values():
            subscription.offer(value)
        return subscription

    def answer(self, service: Service[In, Out], **fields: str) -> "_Inbox[In, Out]":
        """Offer a service."""
        inbox = _Inbox(self, self._hub, service, key_of(service.key, fields))
        self.inboxes.append(inbox)
        return inbox

    def ask(
        self, service: Service[In, Out], message: In, timeout: float, **fields: str
    ) -> "_Pending[Out]":
        """Put a request into the inbox of the answerer that came first."""
        key = key_of(service.key, fields)
        payload = encode(message)
        deadline = self._hub.clock.now() + timeout
        pending = _Pending(self, self._hub.clock, service, key, timeout, deadline)
        self.counts.add("asks")
        if len(payload) > service.max_bytes:
            self.counts.add("refused_messages")
            pending.settle(Refused(too_long(len(payload), key, service.max_bytes)))
            return pending
        inboxes = [i for bus in self._hub.buses for i in bus.inboxes if i.key == key]
        if not inboxes or self.is_closed:
            pending.settle(NoAnswer(f"nobody answers {key}"))
            return pending
        self.counts.sent(len(payload))
        inboxes[0].offer(pending, payload)
        return pending

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
        """Leave; requests that this bus has not answered end without one."""
        if self.is_closed:
            return
        self.is_closed = True
        self._hub.buses.remove(self)
        for inbox in list(self.inboxes):
            inbox.close()
        self.subscriptions.clear()
        latest = self._hub.latest
        for key in [key for key, value in latest.items() if value.boot == self.boot]:
            del latest[key]

    def wake(self) -> None:
        """Make the next ``wait`` return true."""
        self._news = True


class _Subscription(Generic[Out]):
    def __init__(self, bus: MemoryBus, hub: MemoryHub, topic: Topic[Out], pattern: str) -> None:
        self._bus = bus
        self._topic = topic
        self._pattern = pattern
        self._newest = Newest[_Value]() if topic.qos is Qos.LATEST else None
        self._fifo = Fifo[_Value](hub.max_messages, hub.max_bytes)

    def offer(self, value: _Value) -> None:
        if not matches(self._pattern, value.key):
            return
        if self._newest is None:
            dropped = self._fifo.push(value, len(value.payload))
            self._bus.counts.add("dropped_values", dropped)
        elif not self._newest.offer(value.key, value.boot, value.count, value):
            return
        self._bus.wake()

    def take(self) -> Out | None:
        queue = self._newest or self._fifo
        while (value := queue.pop()) is not None:
            try:
                message = decode(self._topic.message, value.payload, self._topic.max_bytes)
            except MessageError:
                self._bus.counts.add("refused_messages")
                continue
            self._bus.counts.taken(len(value.payload))
            return message
        return None

    def close(self) -> None:
        if self in self._bus.subscriptions:
            self._bus.subscriptions.remove(self)


class _Pending(Generic[Out]):
    def __init__(
        self, bus: MemoryBus, clock: Clock, service: Service[Any, Out], key: str,
        timeout: float, deadline: float,
    ) -> None:  # fmt: skip
        self._bus = bus
        self._clock = clock
        self._service = service
        self._key = key
        self._timeout = timeout
        self._deadline = deadline
        self._result: Out | Refused | NoAnswer | None = None

    def settle(self, result: Out | Refused | NoAnswer) -> None:
        """Decide the outcome, unless it is decided."""
        if self._result is not None or self._expired():
            return
        if isinstance(result, NoAnswer):
            self._bus.counts.add("asks_unanswered")
        self._result = result
        self._bus.wake()

    def settle_payload(self, payload: bytes) -> None:
        """Decide the outcome by an answer's bytes."""
        if self._result is not None or self._expired():
            return
        try:
            answer = decode(self._service.reply, payload, self._service.max_reply_bytes)
        except MessageError as error:
            self._bus.counts.add("refused_messages")
            self.settle(Refused(str(error)))
            return
        self._bus.counts.taken(len(payload))
        self.settle(answer)

    def take(self) -> Out | Refused | NoAnswer | None:
        if self._result is None:
            self._expired()
        return self._result

    def _expired(self) -> bool:
        if self._result is None and self._clock.now() >= self._deadline:
            self._bus.counts.add("asks_unanswered")
            self._result = NoAnswer(f"no answer from {self._key} within {self._timeout:g} s")
        return self._result is not None


class _Inbox(Generic[In, Out]):
    def __init__(self, bus: MemoryBus, hub: MemoryHub, service: Service[In, Out], key: str) -> None:
        self.key = key
        self._bus = bus
        self._service = service
        self._waiting = Fifo[tuple[_Pending[Out], bytes]](hub.max_messages, hub.max_bytes)
        self._open: dict[int, _Pending[Out]] = {}

    def offer(self, pending: _Pending[Out], payload: bytes) -> None:
        if not self._waiting.offer((pending, payload), len(payload)):
            self._bus.counts.add("refused_requests")
            pending.settle(Refused(inbox_full(self.key), retry=True))
            return
        self._open[id(pending)] = pending
        self._bus.wake()

    def take(self) -> "_Request[In, Out] | None":
        while (item := self._waiting.pop()) is not None:
            pending, payload = item
            try:
                message = decode(self._service.request, payload, self._service.max_bytes)
            except MessageError as error:
                self._bus.counts.add("refused_messages")
                self.settled(pending)
                pending.settle(Refused(str(error)))
                continue
            self._bus.counts.taken(len(payload))
            return _Request(self, self._bus, self._service, pending, message)
        return None

    def settled(self, pending: _Pending[Out]) -> None:
        """Forget a request that has its answer."""
        self._open.pop(id(pending), None)

    def close(self) -> None:
        if self in self._bus.inboxes:
            self._bus.inboxes.remove(self)
        for pending in self._open.values():
            pending.settle(NoAnswer(f"{self._bus.name}, which answered {self.key}, has left"))
        self._open.clear()


class _Request(Generic[In, Out]):
    def __init__(
        self, inbox: _Inbox[In, Out], bus: MemoryBus, service: Service[In, Out],
        pending: _Pending[Out], message: In,
    ) -> None:  # fmt: skip
        self._inbox = inbox
        self._bus = bus
        self._service = service
        self._pending = pending
        self._message = message

    @property
    def message(self) -> In:
        return self._message

    def reply(self, message: Out) -> None:
        payload = encode(message)
        if len(payload) > self._service.max_reply_bytes:
            limit = self._service.max_reply_bytes
            raise ValueError(too_long(len(payload), self._inbox.key, limit))
        self._bus.counts.sent(len(payload))
        self._inbox.settled(self._pending)
        self._pending.settle_payload(payload)

    def refuse(self, reason: str, *, retry: bool = False) -> None:
        self._inbox.settled(self._pending)
        self._pending.settle(Refused(reason, retry=retry))


def too_long(size: int, key: str, limit: int) -> str:
    """Return why a payload is not sent."""
    return f"a message of {size} B on {key} is over its limit of {limit} B"


def inbox_full(key: str) -> str:
    """Return why a request is turned away for now."""
    return f"too many requests wait on {key}; ask again later"
