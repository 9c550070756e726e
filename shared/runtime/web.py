"""Serves files and WebSockets to browsers, on a thread of its own; nothing here waits for one.

Whoever comes under a foreign name or from a foreign page is refused before anything else. What is
said over a WebSocket is the caller's; ``talk.Talk`` carries it.
"""

import asyncio
import contextlib
import dataclasses
import http
import logging
import os
import socket
import threading
from collections.abc import Awaitable, Callable, Coroutine, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import urlsplit

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from shared.errors import ConfigError
from shared.runtime.talk import Tally
from shared.sockets import close_server

START_SECONDS = 10.0
CLOSE_SECONDS = 2.0
_KINDS = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".LICENSE": "text/plain; charset=utf-8",
}

T = TypeVar("T")


@dataclasses.dataclass(frozen=True)
class Asset:
    """A file of the page."""

    body: bytes
    kind: str
    """Its content type."""


def load_files(folder: Path) -> dict[str, Asset]:
    """Return the files of a folder that a browser may have, by path, as ``/main.js``."""
    found: dict[str, Asset] = {}
    for path in sorted(folder.rglob("*")):
        if path.is_file() and path.suffix in _KINDS:
            name = "/" + path.relative_to(folder).as_posix()
            found[name] = Asset(path.read_bytes(), _KINDS[path.suffix])
    return found


Handler = Callable[[ServerConnection], Awaitable[None]]
Guard = Callable[[str, str], str]


class WebServer:
    """Files and WebSockets on one port; its methods are for the thread of its owner."""

    def __init__(
        self, host: str, port: int, origins: Iterable[str], *, section: str,
        assets: Mapping[str, Asset], sockets: Mapping[str, Handler], max_bytes: int, tally: Tally,
        guard: Guard = lambda path, query: "",
    ) -> None:  # fmt: skip
        """Start to serve.

        Args:
            host: interface.
            port: 0 takes any that is free.
            origins: addresses the page may be opened under beside its own.
            section: of the site file that host, port and origins are in.
            assets: files by path, as ``/index.html``.
            sockets: who talks over the WebSocket at a path, on the web's thread.
            max_bytes: longest message of a page.
            tally: counts ``pages_refused``.
            guard: given path and query of what is asked for, says why it is not served, or
                nothing.

        Raises:
            ConfigError: it cannot listen there.
        """
        self._assets = dict(assets)
        self._sockets = dict(sockets)
        self._section = section
        self._max_bytes = max_bytes
        self._tally = tally
        self._guard = guard
        self._connections: set[ServerConnection] = set()
        listener = _listener(host, port, section)
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

    def call_soon(self, do: Callable[[], object]) -> None:
        """Have something done on the web's thread; from any thread; nothing once it is closed."""
        with contextlib.suppress(RuntimeError):  # the loop is closed
            self._loop.call_soon_threadsafe(do)

    def close(self) -> None:
        """Send the pages away and stop serving; a second time does nothing."""
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
        quiet = logging.getLogger("riposte.web")
        quiet.propagate = False
        quiet.addHandler(logging.NullHandler())
        return await serve(
            self._handle, sock=listener, process_request=self._receive, max_size=self._max_bytes,
            max_queue=8, write_limit=16384, compression=None, open_timeout=30.0,
            ping_interval=5.0, ping_timeout=10.0, close_timeout=20.0, server_header=None,
            logger=quiet,
        )  # fmt: skip

    async def _end(self) -> None:
        await close_server(self._server)
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
        """Answer a request for a file; let one for a socket through."""
        host = request.headers.get("Host", "")
        origin = request.headers.get("Origin")
        if host not in self._hosts:  # another name for this machine: DNS rebinding
            return self._refuse_foreign(connection, f"host {host[:80]!r}")
        if origin is not None and origin not in self._origins:
            return self._refuse_foreign(connection, f"origin {origin[:80]!r}")
        path, _, query = request.path.partition("?")
        if reason := self._guard(path, query):
            return self._refuse(connection, reason)
        if path in self._sockets:
            return None
        if (asset := self._assets.get(path)) is None:
            return connection.respond(http.HTTPStatus.NOT_FOUND, "there is no such file\n")
        return Response(200, "OK", _headers(asset, host), asset.body)

    def _refuse_foreign(self, connection: ServerConnection, what: str) -> Response:
        where = f"see {self._section}.origins in the site file"
        return self._refuse(connection, f"{what} is none of this page's; {where}")

    def _refuse(self, connection: ServerConnection, reason: str) -> Response:
        self._tally.refuse("pages_refused", f"refused: {reason}")
        return connection.respond(http.HTTPStatus.FORBIDDEN, f"refused: {reason}\n")

    async def _handle(self, connection: ServerConnection) -> None:
        request = connection.request
        if request is None:
            return
        self._connections.add(connection)
        try:
            await self._sockets[request.path.partition("?")[0]](connection)
        finally:
            self._connections.discard(connection)


def _listener(host: str, port: int, section: str) -> socket.socket:
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
            f"{section}.host and {section}.port to what is free"
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
        ("Referrer-Policy", "no-referrer"),
        ("Connection", "close"),
    ])  # fmt: skip
