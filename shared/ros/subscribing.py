"""A topic's reader: a short queue of raw messages, decoded by whoever polls it."""

import asyncio
import contextlib
import threading
from collections import deque
from typing import Any, Final, NamedTuple

import structlog

from shared.clock import Clock
from shared.errors import MessageError
from shared.ros import types
from shared.ros.errors import RosError
from shared.ros.loop import SocketLoop, connected
from shared.ros.wire import LARGEST_HEADER, LENGTH, fields_of, header, length_of
from shared.ros.xmlrpc import ask

MOST_PUBLISHERS: Final = 32
_CONNECT_SECONDS: Final = 3.0
_FIRST_PAUSE: Final = 0.1
_LONGEST_PAUSE: Final = 2.0

log = structlog.get_logger()


class Received(NamedTuple):
    """A message and when it arrived."""

    message: Any
    at: float
    """By the node's monotonic clock (s)."""
    wall_ns: int
    """The same instant, nanoseconds since 1970."""


class _Raw(NamedTuple):
    data: bytes
    at: float
    wall_ns: int


class Subscription:
    """A topic that this node reads; polled by one thread."""

    def __init__(
        self, topic: str, type_name: str, *, queue: int, node: str, clock: Clock,
        loop: SocketLoop, largest: int,
    ) -> None:  # fmt: skip
        """Take the settings; ``Node.subscribe`` makes these."""
        self.topic = topic
        self.type_name = type_name
        self.md5 = types.md5_of(type_name)
        self._node = node
        self._clock = clock
        self._loop = loop
        self._largest = largest
        self._queue: deque[_Raw] = deque(maxlen=queue)
        self._arrived = threading.Event()
        self._links: dict[str, asyncio.Task[None]] = {}
        self._live: set[str] = set()
        self._named: set[str] = set()
        """Publishers that the master speaks of."""
        self.received = 0
        """Messages that arrived."""
        self.dropped = 0
        """Of those, how many a newer one pushed out before they were taken."""
        self.malformed = 0
        """Messages and connections that were not what they claimed to be."""
        self.problem = ""
        """Why a publisher cannot be read; empty once one can."""

    def take(self) -> Received | None:
        """Return the oldest message in the queue, or None; never blocks."""
        while self._queue:
            raw = self._queue.popleft()
            try:
                message = types.read(self.type_name, raw.data)
            except MessageError as error:
                self._refuse(str(error))
                continue
            return Received(message, raw.at, raw.wall_ns)
        return None

    def wait(self, seconds: float) -> bool:
        """Wait for a message; returns whether there is one."""
        self._arrived.clear()
        return bool(self._queue) or self._arrived.wait(seconds) or bool(self._queue)

    @property
    def publishers(self) -> tuple[str, ...]:
        """Return the addresses of the nodes whose messages come in."""
        return tuple(self._live)

    def follow(self, uris: list[str]) -> None:
        """Read from these publishers; on the loop's thread.

        A connection that works stays, whether the master names its publisher or not: after a
        restart the master knows nothing of publishers that still send.
        """
        self._named = set(uris[:MOST_PUBLISHERS])
        for uri in self._links.keys() - self._named - self._live:
            self._links.pop(uri).cancel()
        for uri in self._named - self._links.keys():
            self._links[uri] = self._loop.begin(self._stay_with(uri))

    def leave(self) -> None:
        """Read from nobody; on the loop's thread."""
        self._named = set()
        for link in self._links.values():
            link.cancel()
        self._links.clear()

    async def _stay_with(self, uri: str) -> None:
        """Read from a publisher, again and again while the master says that it is there."""
        pause = _FIRST_PAUSE
        while uri in self._named:
            reader = _Reader(self)
            try:
                await self._read_from(uri, reader)
            except (OSError, RosError, MessageError) as error:
                self.problem = f"{self.topic} from {uri}: {error or 'no answer'}"
                log.debug("ros_publisher_lost", topic=self.topic, uri=uri, error=str(error))
            finally:
                self._live.discard(uri)
            pause = _FIRST_PAUSE if reader.messages else min(2.0 * pause, _LONGEST_PAUSE)
            await asyncio.sleep(pause)
        self._links.pop(uri, None)

    async def _read_from(self, uri: str, reader: "_Reader") -> None:
        async with asyncio.timeout(_CONNECT_SECONDS):
            protocol = await ask(uri, "requestTopic", self._node, self.topic, [["TCPROS"]])
            match protocol:
                case ["TCPROS", str(host), int(port)]:
                    sock = await connected(host, port)
                case _:
                    raise RosError(f"offers no TCPROS but {str(protocol)[:80]}")
            await asyncio.get_running_loop().create_connection(lambda: reader, sock=sock)
            reader.send(
                header(
                    {
                        "callerid": self._node,
                        "topic": self.topic,
                        "type": self.type_name,
                        "md5sum": self.md5,
                        "tcp_nodelay": "1",
                        "message_definition": types.definition_of(self.type_name),
                    }
                )
            )
            try:
                await reader.greeted
            except BaseException:
                reader.end()
                raise
        self.problem = ""
        self._live.add(uri)
        try:
            await reader.ended
        finally:
            reader.end()

    def greet(self, fields: dict[str, str]) -> None:
        """Check what a publisher says of itself.

        Raises:
            MessageError: it refuses, or its messages are of another type.
        """
        if "error" in fields:
            raise MessageError(f"refused: {fields['error'][:200]}")
        if fields.get("md5sum") not in ("*", self.md5):
            self.malformed += 1
            raise MessageError(
                f"publishes {fields.get('type', '?')[:80]} with md5sum {fields.get('md5sum')}, "
                f"expected {self.type_name} with {self.md5}: is its ROS package another version?"
            )

    def keep(self, data: bytes) -> None:
        """Put a message into the queue; on the loop's thread."""
        self.received += 1
        self.dropped += len(self._queue) == self._queue.maxlen
        self._queue.append(_Raw(data, self._clock.now(), self._clock.wall_ns()))
        self._arrived.set()

    @property
    def largest(self) -> int:
        """Return the most bytes that a message may have."""
        return self._largest

    def _refuse(self, why: str) -> None:
        self.malformed += 1
        self.problem = f"{self.topic}: {why}"


class _Reader(asyncio.Protocol):
    """One connection to a publisher: its header, then messages."""

    def __init__(self, subscription: Subscription) -> None:
        loop = asyncio.get_running_loop()
        self._subscription = subscription
        self._buffer = bytearray()
        self._transport: asyncio.Transport | None = None
        self.greeted: asyncio.Future[None] = loop.create_future()
        self.ended: asyncio.Future[None] = loop.create_future()
        self.messages = 0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport

    def send(self, data: bytes) -> None:
        """Write the subscriber's header."""
        assert self._transport is not None
        self._transport.write(data)

    def data_received(self, data: bytes) -> None:
        buffer = self._buffer
        buffer += data
        start = 0
        try:
            while len(buffer) - start >= LENGTH:
                limit = self._subscription.largest if self.greeted.done() else LARGEST_HEADER
                length = length_of(buffer[start : start + LENGTH], limit)
                end = start + LENGTH + length
                if end > len(buffer):
                    break
                self._take(bytes(buffer[start + LENGTH : end]))
                start = end
        except MessageError as error:
            if self.greeted.done():
                self._subscription.malformed += 1
            self._fail(error)
        del buffer[:start]

    def connection_lost(self, exc: Exception | None) -> None:
        self._fail(exc or ConnectionResetError("the publisher closed the connection"))

    def end(self) -> None:
        """Close the connection; a second call does nothing."""
        if self._transport is not None:
            self._transport.abort()
        for future in (self.greeted, self.ended):
            if not future.done():
                future.cancel()
            elif not future.cancelled():
                with contextlib.suppress(Exception):
                    future.exception()  # seen, so that asyncio does not complain of it

    def _take(self, data: bytes) -> None:
        if self.greeted.done():
            self.messages += 1
            self._subscription.keep(data)
            return
        self._subscription.greet(fields_of(data))
        self.greeted.set_result(None)

    def _fail(self, error: Exception) -> None:
        for future in (self.greeted, self.ended):
            if not future.done():
                future.set_exception(error)
        if self._transport is not None:
            self._transport.abort()
