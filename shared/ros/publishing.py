"""A topic's writer: every subscriber has its own short outbox, and none can hold up the caller."""

import asyncio
import contextlib
import socket
import threading
from collections import deque
from typing import Any, Final

from shared.ros import types
from shared.ros.loop import tuned
from shared.ros.wire import framed, header

MOST_SUBSCRIBERS: Final = 32
_SEND_BUFFER: Final = 16 << 10
"""Bytes that the kernel may keep for a subscriber that does not read: old values are no use."""


class Outbox:
    """What one subscriber has not been given yet; the newest few messages."""

    def __init__(
        self, sock: socket.socket, name: str, queue: int, loop: asyncio.AbstractEventLoop
    ) -> None:
        """Take over a connected socket.

        Args:
            sock: after the handshake, not blocking.
            name: of the subscriber.
            queue: messages kept; older ones are dropped.
            loop: whose thread sends what did not fit at once.
        """
        self.name = name
        self._sock = sock
        self._loop = loop
        self._lock = threading.Lock()
        self._waiting: deque[bytes] = deque(maxlen=queue)
        self._rest: memoryview | None = None
        """Of the message that has been sent in part."""
        self.dropped = 0
        self.is_dead = False

    def offer(self, frame: bytes) -> bool:
        """Send a message now, or keep it; returns whether it went out whole; never blocks."""
        with self._lock:
            if self.is_dead:
                return False
            if self._rest is None and not self._waiting:
                sent = self._send(memoryview(frame))
                if sent == len(frame):
                    return True
                if sent > 0:
                    self._rest = memoryview(frame)[sent:]
                elif not self.is_dead:
                    self._waiting.append(frame)
                wake = True
            else:
                self.dropped += len(self._waiting) == self._waiting.maxlen
                self._waiting.append(frame)
                wake = False
        if wake:
            with contextlib.suppress(RuntimeError):  # the loop has been closed
                self._loop.call_soon_threadsafe(self._watch)
        return False

    def flush(self) -> None:
        """Send what is kept, as far as it goes; on the loop's thread."""
        with self._lock:
            while not self.is_dead:
                if self._rest is None:
                    if not self._waiting:
                        break
                    self._rest = memoryview(self._waiting.popleft())
                sent = self._send(self._rest)
                if sent == len(self._rest):
                    self._rest = None
                    continue
                self._rest = self._rest[sent:]
                return
        self._loop.remove_writer(self._sock)

    def close(self) -> None:
        """Let go of the subscriber; on the loop's thread."""
        with self._lock:
            self.is_dead = True
            self._waiting.clear()
            self._rest = None
        self._loop.remove_writer(self._sock)
        self._loop.remove_reader(self._sock)
        self._sock.close()

    def watch_end(self, ended: asyncio.Event) -> None:
        """Set an event when the subscriber goes; on the loop's thread. It has nothing to say."""

        def read() -> None:
            try:
                data = self._sock.recv(4096)
            except (BlockingIOError, InterruptedError):
                return
            except OSError:
                data = b""
            if not data:
                self._loop.remove_reader(self._sock)
                ended.set()

        self._loop.add_reader(self._sock, read)

    def _watch(self) -> None:
        if not self.is_dead:
            self._loop.add_writer(self._sock, self.flush)

    def _send(self, data: memoryview) -> int:
        try:
            return self._sock.send(data, socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)
        except (BlockingIOError, InterruptedError):
            return 0
        except OSError:
            self.is_dead = True
            # wakes the reader, which ends the connection
            with contextlib.suppress(OSError):
                self._sock.shutdown(socket.SHUT_RDWR)
            return 0


class Publication:
    """A topic that this node writes; one instance a topic, for any thread."""

    def __init__(
        self, topic: str, type_name: str, *, latch: bool, queue: int, node: str,
        loop: asyncio.AbstractEventLoop,
    ) -> None:  # fmt: skip
        """Take the settings; ``Node.publish_topic`` makes these."""
        self.topic = topic
        self.type_name = type_name
        self.md5 = types.md5_of(type_name)
        self._message_type = types.new(type_name).__msgtype__
        self._is_latched = latch
        self._queue = queue
        self._node = node
        self._loop = loop
        self._latched: bytes | None = None
        self._lock = threading.Lock()
        self._outboxes: tuple[Outbox, ...] = ()
        self._dropped = 0
        self.published = 0

    def publish(self, message: Any) -> int:
        """Give a message to all subscribers; never blocks.

        Returns:
            How many it left for at once; for the others the newest ``queue`` are kept.

        Raises:
            ValueError: the message is of another type, or a field of it is not valid.
        """
        if getattr(message, "__msgtype__", None) != self._message_type:
            raise ValueError(f"{self.topic} carries {self.type_name}, not {type(message).__name__}")
        frame = framed(types.write(message))
        with self._lock:
            if self._is_latched:
                self._latched = frame
            outboxes = self._outboxes
            self.published += 1
        return sum([outbox.offer(frame) for outbox in outboxes])

    @property
    def subscribers(self) -> tuple[str, ...]:
        """Return the names of the nodes that listen."""
        return tuple(outbox.name for outbox in self._outboxes)

    @property
    def dropped(self) -> int:
        """Return messages that some subscriber was too slow for."""
        return self._dropped + sum(outbox.dropped for outbox in self._outboxes)

    def refusal(self, asked: dict[str, str]) -> str:
        """Return why a subscriber's header cannot be served; empty if it can."""
        if asked.get("md5sum") not in ("*", self.md5):
            return (
                f"{self.topic} is {self.type_name} with md5sum {self.md5} here, "
                f"not {asked.get('type', '?')} with {asked.get('md5sum')}"
            )
        if len(self._outboxes) >= MOST_SUBSCRIBERS:
            return f"{self.topic} has {MOST_SUBSCRIBERS} subscribers already"
        return ""

    async def serve(self, sock: socket.socket, asked: dict[str, str]) -> None:
        """Serve one subscriber until it goes; on the loop's thread, closes the socket."""
        tuned(sock)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)
        outbox = Outbox(sock, asked.get("callerid", "?")[:200], self._queue, self._loop)
        try:
            reply = header(
                {
                    "callerid": self._node,
                    "topic": self.topic,
                    "type": self.type_name,
                    "md5sum": self.md5,
                    "latching": "1" if self._is_latched else "0",
                    "message_definition": types.definition_of(self.type_name),
                }
            )
            await self._loop.sock_sendall(sock, reply)
            ended = asyncio.Event()
            outbox.watch_end(ended)
            with self._lock:
                self._outboxes = (*self._outboxes, outbox)
                latched = self._latched
                # in the lock, so that a newer message cannot come before it
                if latched is not None:
                    outbox.offer(latched)
            await ended.wait()
        finally:
            with self._lock:
                self._outboxes = tuple(kept for kept in self._outboxes if kept is not outbox)
                self._dropped += outbox.dropped
            outbox.close()
