"""Serves the page and one WebSocket, on a thread of its own; nothing here waits for a browser.

To a browser go the newest frame, older ones being dropped while it is slow, and notes, a bounded
queue. From it come the newest pose and wishes, a bounded queue. One page plays at a time: a new
one takes over, and the old one is told.
"""

import asyncio
import contextlib
import dataclasses
import http
import logging
import os
import socket
import threading
from collections import deque
from collections.abc import Coroutine, Iterable, Mapping
from typing import Any, TypeVar
from urllib.parse import urlsplit

import structlog
from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from services.page.protocol import MAX_BYTES, Ask, Pointer, parse_ask, parse_pointer
from shared.errors import ConfigError, MessageError

SOCKET_PATH = "/bout"
MAX_NOTES = 32
MAX_ASKS = 16
MAX_REFUSED = 64
"""Messages that a page may send in vain before it is sent away."""
START_SECONDS = 10.0
CLOSE_SECONDS = 2.0
TAKEN_OVER, MISBEHAVED = 4001, 4008
"""Close codes of the WebSocket."""
TOO_BIG = 1009

T = TypeVar("T")
log = structlog.get_logger()


@dataclasses.dataclass(frozen=True)
class Asset:
    """A file of the page."""

    body: bytes
    kind: str
    """Its content type."""


class Web:
    """The page's server; its methods are for the service's thread."""

    def __init__(
        self, host: str, port: int, origins: Iterable[str], assets: Mapping[str, Asset]
    ) -> None:
        """Start to serve.

        Args:
            host: interface.
            port: 0 takes any that is free.
            origins: addresses the page may be opened under beside its own.
            assets: files by path, as ``/index.html``.

        Raises:
            ConfigError: it cannot listen there.
        """
        self._assets = dict(assets)
        self._lock = threading.Lock()
        self._session: _Session | None = None
        self._connections: set[ServerConnection] = set()
        self._pointer: Pointer | None = None
        self._asks: deque[tuple[int, Ask]] = deque()
        self._counters = {
            "pages": 0, "pages_replaced": 0, "pages_refused": 0, "messages_refused": 0,
            "frames_sent": 0, "frames_dropped": 0, "poses_received": 0, "wishes_dropped": 0,
        }  # fmt: skip
        self.last_refusal = ""
        """Why a page or a message was refused last; empty before."""
        listener = _listener(host, port)
        self.port: int = listener.getsockname()[1]
        shown = f"[{host}]" if ":" in host else host
        self.url = f"http://{shown}:{self.port}"
        names = {shown, "127.0.0.1", "localhost"}
        self._origins = {f"http://{name}:{self.port}" for name in names} | set(origins)
        self._hosts = {urlsplit(origin).netloc for origin in self._origins}
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="web", daemon=True)
        self._thread.start()
        self._server = self._call(self._listen(listener), START_SECONDS)

    @property
    def session(self) -> int:
        """Return the number of the page that plays, 0 without one."""
        session = self._session
        return session.number if session is not None else 0

    @property
    def counters(self) -> dict[str, int]:
        """Return counts since the start."""
        with self._lock:
            return dict(self._counters)

    def show(self, frame: bytes) -> None:
        """Send a frame to the page; one that has not gone out yet is dropped for it."""
        session = self._session
        if session is None:
            return
        with self._lock:
            self._counters["frames_dropped"] += session.frame is not None
            session.frame = frame
        self._loop.call_soon_threadsafe(session.news.set)

    def tell(self, note: bytes) -> None:
        """Send a note to the page, in order and before frames; the oldest give way to new ones."""
        session = self._session
        if session is None:
            return
        with self._lock:
            session.notes.append(note)
        self._loop.call_soon_threadsafe(session.news.set)

    def take_pointer(self) -> Pointer | None:
        """Return the newest pose that was not taken yet."""
        with self._lock:
            pointer, self._pointer = self._pointer, None
        return pointer

    def take_ask(self) -> Ask | None:
        """Return the oldest wish of the page that plays, None when there is none."""
        with self._lock:
            while self._asks:
                number, ask = self._asks.popleft()
                if number == self.session:
                    return ask
        return None

    def close(self) -> None:
        """Send the page away and stop serving; a second time does nothing."""
        if self._loop.is_closed():
            return
        for work in (self._end(), self._cancel()):
            with contextlib.suppress(TimeoutError):
                self._call(work, CLOSE_SECONDS)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(CLOSE_SECONDS)
        if not self._thread.is_alive():
            self._loop.close()

    def _call(self, work: Coroutine[Any, Any, T], timeout: float) -> T:
        """Run something on the web's thread and return what it does."""
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(timeout)

    # From here on: the web's thread.

    async def _listen(self, listener: socket.socket) -> Server:
        quiet = logging.getLogger("riposte.page")
        quiet.propagate = False
        quiet.addHandler(logging.NullHandler())
        return await serve(
            self._play, sock=listener, process_request=self._receive, max_size=MAX_BYTES,
            max_queue=8, write_limit=16384, compression=None, open_timeout=30.0,
            ping_interval=5.0, ping_timeout=10.0, close_timeout=20.0, server_header=None,
            logger=quiet,
        )  # fmt: skip

    async def _end(self) -> None:
        self._server.close()
        await self._server.wait_closed()

    async def _cancel(self) -> None:
        """End what waits for a browser that does not answer."""
        for connection in self._connections:
            connection.transport.abort()
        tasks = asyncio.all_tasks() - {asyncio.current_task()}
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _receive(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a request for a file; let one for the socket through."""
        host = request.headers.get("Host", "")
        origin = request.headers.get("Origin")
        if host not in self._hosts:  # another name for this machine: DNS rebinding
            return self._refuse(connection, f"host {host[:80]!r} is none of this page's")
        if origin is not None and origin not in self._origins:
            return self._refuse(connection, f"origin {origin[:80]!r} is none of this page's")
        path = request.path.partition("?")[0]
        if path == SOCKET_PATH:
            return None
        asset = self._assets.get("/index.html" if path == "/" else path)
        if asset is None:
            return connection.respond(http.HTTPStatus.NOT_FOUND, "there is no such file\n")
        return Response(200, "OK", _headers(asset, host), asset.body)

    def _refuse(self, connection: ServerConnection, reason: str) -> Response:
        reason = f"refused: {reason}; see page.origins in the site file"
        self._note_refusal("pages_refused", reason)
        return connection.respond(http.HTTPStatus.FORBIDDEN, f"{reason}\n")

    def _note_refusal(self, counter: str, reason: str) -> None:
        with self._lock:
            self._counters[counter] += 1
            is_new = reason != self.last_refusal
            self.last_refusal = reason
        if is_new:
            log.warning("page_refused", counter=counter, reason=reason)

    async def _play(self, connection: ServerConnection) -> None:
        """Serve one page until it goes, or another takes over."""
        with self._lock:
            self._counters["pages"] += 1
            before = self._session
            session = self._session = _Session(self._counters["pages"], connection)
            self._pointer = None
            self._asks.clear()
        if before is not None and not before.ending.done():
            self._count("pages_replaced")
            before.ending.set_result((TAKEN_OVER, "another page plays now"))
        log.info("page_opened", page=session.number)
        self._connections.add(connection)
        sender = asyncio.create_task(self._send(session))
        closer = asyncio.create_task(self._end_when_told(session))
        try:
            async for message in connection:
                self._take(session, message)
        except ConnectionClosed as error:
            sent = error.sent
            if sent is not None and sent.code == TOO_BIG:
                self._note_refusal(
                    "messages_refused", f"a message is longer than {MAX_BYTES} bytes"
                )
        finally:
            for task in (sender, closer):
                task.cancel()
            self._connections.discard(connection)
            if self._session is session:
                self._session = None
            log.info("page_closed", page=session.number)

    async def _end_when_told(self, session: "_Session") -> None:
        code, reason = await session.ending
        await session.socket.close(code, reason)

    def _take(self, session: "_Session", message: str | bytes) -> None:
        try:
            if isinstance(message, bytes):
                pointer = parse_pointer(message, session.number, session.sequence)
                session.sequence = pointer.sequence
                with self._lock:
                    self._counters["poses_received"] += 1
                    self._pointer = pointer
            else:
                ask = parse_ask(message)
                with self._lock:
                    if len(self._asks) < MAX_ASKS:
                        self._asks.append((session.number, ask))
                    else:
                        self._counters["wishes_dropped"] += 1
        except MessageError as error:
            self._note_refusal("messages_refused", str(error))
            session.refused += 1
            if session.refused == MAX_REFUSED and not session.ending.done():
                session.ending.set_result((MISBEHAVED, "too many messages that cannot be read"))

    async def _send(self, session: "_Session") -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                await session.news.wait()
                session.news.clear()
                while (text := self._next(session)) is not None:
                    await session.socket.send(text, text=True)  # waits while the browser is slow

    def _next(self, session: "_Session") -> bytes | None:
        with self._lock:
            if session.notes:
                return session.notes.popleft()
            frame, session.frame = session.frame, None
            self._counters["frames_sent"] += frame is not None
            return frame

    def _count(self, counter: str) -> None:
        with self._lock:
            self._counters[counter] += 1


class _Session:
    """One page's connection; ``frame`` and ``notes`` are shared under the web's lock."""

    def __init__(self, number: int, connection: ServerConnection) -> None:
        self.number = number
        self.socket = connection
        self.news = asyncio.Event()
        self.ending: asyncio.Future[tuple[int, str]] = asyncio.get_running_loop().create_future()
        """Set to close it: code and reason."""
        self.frame: bytes | None = None
        self.notes: deque[bytes] = deque(maxlen=MAX_NOTES)
        self.sequence = -1
        self.refused = 0


def _listener(host: str, port: int) -> socket.socket:
    """Return a listening socket.

    Raises:
        ConfigError: it cannot listen there.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family, backlog=32)
    except OSError as error:
        number = error.errno or 0
        reason = os.strerror(number) if number > 0 else error.strerror
        raise ConfigError(
            f"cannot serve the page on {host}:{port} ({reason}): stop what listens there, or set "
            "page.host and page.port to what is free"
        ) from error


def _headers(asset: Asset, host: str) -> Headers:
    policy = (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
        f"worker-src 'self'; connect-src 'self' ws://{host}; frame-ancestors 'none'; "
        "base-uri 'none'; form-action 'none'"
    )
    return Headers([
        ("Content-Type", asset.kind),
        ("Content-Length", str(len(asset.body))),
        ("Cache-Control", "no-cache"),
        ("Content-Security-Policy", policy),
        ("X-Content-Type-Options", "nosniff"),
        ("Connection", "close"),
    ])  # fmt: skip
