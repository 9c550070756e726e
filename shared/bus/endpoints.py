"""The ends that a service holds: subscriptions, inboxes, requests and answers under way.

They are the same on every bus; a bus brings bytes to them and takes bytes away. ``offer`` and
``on_...`` may be called on any thread, everything else on the service's.
"""

import dataclasses
import functools
import threading
from collections.abc import Callable
from typing import Any, Generic, Protocol, TypeVar, cast

import structlog

from shared.bus.base import NoAnswer, Refused
from shared.bus.counters import Counters
from shared.bus.keys import fields_in
from shared.bus.queues import Fifo, Newest
from shared.clock import Clock
from shared.errors import MessageError
from shared.messages.message import Message
from shared.messages.texts import clipped
from shared.messages.topics import Qos, Service, Topic
from shared.messages.wire import decode, encode

In = TypeVar("In", bound=Message)
Out = TypeVar("Out", bound=Message)

MAX_REFUSAL = 64 << 10
"""Longest encoded refusal (bytes)."""
MAX_SHARED = 4 << 10
"""Longest value whose message the subscriptions of a process share (bytes)."""

log = structlog.get_logger()


def _decoded(topic: Topic[Out], payload: bytes) -> Out:
    """Return the message in a value; the bus in memory brings the same bytes to many."""
    if len(payload) > MAX_SHARED:
        return decode(topic.message, payload, topic.max_bytes)
    return cast("Out", _shared(topic.message, payload, topic.max_bytes))


@functools.lru_cache(maxsize=16)
def _shared(message: type[Message], payload: bytes, max_bytes: int) -> Message:
    return decode(message, payload, max_bytes)


def _check_claims(topic: Topic[Any], key: str, message: Message) -> None:
    """Refuse a message that says to be of somebody else than its key does.

    Who may write under a key is checked; what is written there is not, by anybody but this.

    Raises:
        MessageError: a field of the message has another value than the key's field of its name.
    """
    for name, value in fields_in(topic.key, key).items():
        claimed = getattr(message, name, value)
        if str(claimed).replace("_", "-") != value.replace("_", "-"):
            raise MessageError(f"{name} is {claimed!r} in a value on {key}")


@dataclasses.dataclass(frozen=True)
class Host:
    """What the ends need of the bus they belong to."""

    clock: Clock
    counts: Counters
    wake: Callable[[], None]
    """Ends the bus's ``wait``."""
    max_messages: int
    """Bound of every inbox and STREAM subscription."""
    max_bytes: int
    """The same, in bytes."""


class ReplyPath(Protocol):
    """The way back to one asker; usable once."""

    def reply(self, payload: bytes) -> None:
        """Send an answer."""
        ...

    def refuse(self, refusal: Refused) -> None:
        """Send a refusal."""
        ...

    def drop(self) -> None:
        """Let the asker know that no answer will come."""
        ...


class Values(Generic[Out]):
    """A subscription."""

    def __init__(
        self, host: Host, topic: Topic[Out], pattern: str, on_close: Callable[["Values[Any]"], None]
    ) -> None:
        self.pattern = pattern
        self._host = host
        self._topic = topic
        self._on_close = on_close
        self._dropped = 0
        self._newest = Newest[tuple[str, bytes]]() if topic.qos is Qos.LATEST else None
        self._fifo = Fifo[tuple[str, bytes]](host.max_messages, host.max_bytes)

    @property
    def max_bytes(self) -> int:
        """Return the longest payload to offer."""
        return self._topic.max_bytes

    @property
    def dropped(self) -> int:
        """Return how many values were thrown away because too many waited."""
        return self._dropped

    def offer(self, key: str, boot: str, count: int, payload: bytes) -> None:
        """Keep a value that arrived, unless it did before.

        Args:
            key: of the value.
            boot: of its writer.
            count: how many values the writer had sent before it.
            payload: the encoded message.
        """
        if self._newest is None:
            dropped = self._fifo.push((key, payload), len(payload))
            self._dropped += dropped
            self._host.counts.add("dropped_values", dropped)
        elif not self._newest.offer(key, boot, count, (key, payload)):
            return
        self._host.wake()

    def take(self) -> Out | None:
        """Return the next value, or None."""
        queue = self._newest or self._fifo
        while (item := queue.pop()) is not None:
            key, payload = item
            try:
                message = _decoded(self._topic, payload)
                _check_claims(self._topic, key, message)
            except MessageError as error:
                self._host.counts.add("refused_messages")
                log.warning("value_refused", key=key, reason=clipped(str(error)))
                continue
            self._host.counts.taken(len(payload))
            return message
        return None

    def close(self) -> None:
        """Stop listening."""
        self._on_close(self)


class Requests(Generic[In, Out]):
    """An inbox."""

    def __init__(
        self,
        host: Host,
        service: Service[In, Out],
        key: str,
        on_close: Callable[["Requests[Any, Any]"], None],
    ) -> None:
        self.key = key
        self._host = host
        self._service = service
        self._on_close = on_close
        self._waiting = Fifo[tuple[ReplyPath, bytes]](host.max_messages, host.max_bytes)

    def accepts(self, size: int, back: ReplyPath) -> bool:
        """Refuse a request that is too long to be read; return whether it is not."""
        if size <= self._service.max_bytes:
            return True
        self._host.counts.add("refused_messages")
        back.refuse(Refused(too_long(size, self.key, self._service.max_bytes)))
        return False

    def offer(self, payload: bytes, back: ReplyPath) -> None:
        """Keep a request that arrived, or refuse it for want of room."""
        if self._waiting.offer((back, payload), len(payload)):
            self._host.wake()
            return
        self._host.counts.add("refused_requests")
        back.refuse(Refused(f"too many requests wait on {self.key}; ask again later", retry=True))

    def take(self) -> "Held[In, Out] | None":
        """Return the oldest waiting request, or None."""
        while (item := self._waiting.pop()) is not None:
            back, payload = item
            try:
                message = decode(self._service.request, payload, self._service.max_bytes)
            except MessageError as error:
                self._host.counts.add("refused_messages")
                reason = clipped(str(error))
                log.warning("request_refused", key=self.key, reason=reason)
                back.refuse(Refused(reason))
                continue
            self._host.counts.taken(len(payload))
            return Held(self._host, self._service, self.key, message, back)
        return None

    def close(self) -> None:
        """Stop answering; who waits here learns it, requests already taken can be answered."""
        self._on_close(self)
        while (item := self._waiting.pop()) is not None:
            item[0].drop()


class Held(Generic[In, Out]):
    """A request that the service has taken."""

    def __init__(
        self, host: Host, service: Service[In, Out], key: str, message: In, back: ReplyPath
    ) -> None:
        self._host = host
        self._service = service
        self._key = key
        self._message = message
        self._back: ReplyPath | None = back

    @property
    def message(self) -> In:
        """Return what was asked."""
        return self._message

    def reply(self, message: Out) -> None:
        """Answer; only the first answer counts. One over the service's limit becomes a refusal.

        Raises:
            ValueError: the answer is not encodable.
        """
        payload = encode(message)
        if len(payload) > self._service.max_reply_bytes:
            reason = too_long(len(payload), self._key, self._service.max_reply_bytes)
            log.error("reply_too_long", reason=reason)
            self.refuse(f"the answer cannot be sent: {reason}")
            return
        back, self._back = self._back, None
        if back is not None:
            self._host.counts.sent(len(payload))
            back.reply(payload)

    def refuse(self, reason: str, *, retry: bool = False) -> None:
        """Answer with an error, at most its beginning; only the first answer counts."""
        back, self._back = self._back, None
        if back is not None:
            back.refuse(Refused(clipped(reason), retry=retry))


class Answer(Generic[Out]):
    """A request under way, at the asker's."""

    def __init__(self, host: Host, service: Service[Any, Out], key: str, timeout: float) -> None:
        self._host = host
        self._service = service
        self._key = key
        self._timeout = timeout
        self._deadline = host.clock.now() + timeout
        self._arrived: Refused | NoAnswer | bytes | None = None
        self._result: Out | Refused | NoAnswer | None = None

    @property
    def max_bytes(self) -> int:
        """Return the longest answer to read."""
        return self._service.max_reply_bytes

    def on_arrival(self, outcome: Refused | NoAnswer | bytes) -> None:
        """Keep the first outcome."""
        if self._arrived is None:
            self._arrived = outcome
            self._host.wake()

    def on_end(self) -> None:
        """No answer can come any more."""
        self.on_arrival(NoAnswer(f"nobody answers {self._key}"))

    def take(self) -> Out | Refused | NoAnswer | None:
        """Return the outcome once it is there, and from then on."""
        if self._result is None:
            self._result = self._settle()
            if isinstance(self._result, NoAnswer):
                self._host.counts.add("asks_unanswered")
        return self._result

    def _settle(self) -> Out | Refused | NoAnswer | None:
        arrived = self._arrived
        late = self._host.clock.now() >= self._deadline
        if late and (arrived is None or isinstance(arrived, NoAnswer)):
            return NoAnswer(f"no answer from {self._key} within {self._timeout:g} s")
        if not isinstance(arrived, bytes):
            return arrived
        try:
            answer = decode(self._service.reply, arrived, self._service.max_reply_bytes)
        except MessageError as error:
            self._host.counts.add("refused_messages")
            return Refused(f"answer from {self._key} refused: {error}")
        self._host.counts.taken(len(arrived))
        return answer


def ask_of(
    host: Host, service: Service[Any, Out], key: str, message: Message, timeout: float
) -> tuple[Answer[Out], bytes | None]:
    """Return a request under way and its bytes; None, and refused, where they are too many."""
    answer = Answer(host, service, key, timeout)
    payload = encode(message)
    host.counts.add("asks")
    if len(payload) <= service.max_bytes:
        return answer, payload
    host.counts.add("refused_messages")
    answer.on_arrival(Refused(too_long(len(payload), key, service.max_bytes)))
    return answer, None


class Present:
    """The living processes of one role."""

    def __init__(self) -> None:
        self._names: dict[str, str] = {}
        self._lock = threading.Lock()

    def on_token(self, token: str, name: str, is_alive: bool) -> None:
        """Note that a process appeared or went; a token stands for one run of it."""
        with self._lock:
            if is_alive:
                self._names[token] = name
            else:
                self._names.pop(token, None)

    def names(self) -> frozenset[str]:
        """Return their names."""
        with self._lock:
            return frozenset(self._names.values())

    def clear(self) -> None:
        """Forget all, before everyone alive is told anew."""
        with self._lock:
            self._names.clear()


def too_long(size: int, key: str, limit: int) -> str:
    """Return why a payload is not sent or not read."""
    return f"a message of {size} B on {key} is over its limit of {limit} B"
