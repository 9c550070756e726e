"""Answers GET over HTTP/1.1 on a thread of its own, one request a connection.

Bounded: so many connections at a time, so long a request, so long until it is answered and read.
"""

import asyncio
import contextlib
import http
import threading
from collections.abc import Callable, Coroutine
from typing import Any, NamedTuple, TypeVar

from shared.errors import ConfigError
from shared.sockets import close_server

MAX_CONNECTIONS = 16
MAX_REQUEST = 16 * 1024
"""Bytes of a request's head."""
DEADLINE = 10.0
"""From the connection to the last byte of the answer (s); Prometheus' own scrape timeout."""
CLOSE_SECONDS = 2.0
START_SECONDS = 10.0

T = TypeVar("T")


class Answer(NamedTuple):
    """What a path is answered with."""

    status: http.HTTPStatus
    kind: str
    """Its content type."""
    body: bytes


class Web:
    """The server; ``answer`` is called on its thread."""

    def __init__(self, host: str, port: int, answer: Callable[[str], Answer | None]) -> None:
        """Start to serve.

        Args:
            host: interface.
            port: 0 takes any that is free.
            answer: of a path, None for one that there is not.

        Raises:
            ConfigError: it cannot listen there.
        """
        self._answer = answer
        self._open = 0
        self.counters = {"scrapes": 0, "connections_refused": 0}
        """Written by the web's thread, read by the service's."""
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="web", daemon=True)
        self._thread.start()
        try:
            self._server = self._call(
                asyncio.start_server(self._serve, host, port, limit=MAX_REQUEST), START_SECONDS
            )
        except OSError as error:
            self._end_thread()
            raise ConfigError(
                f"cannot serve metrics on {host}:{port} ({error.strerror or error}); "
                "choose another with --set metrics.port=N"
            ) from error
        self.port: int = self._server.sockets[0].getsockname()[1]

    def close(self) -> None:
        """Stop serving; a second time does nothing."""
        if self._loop.is_closed():
            return
        with contextlib.suppress(TimeoutError):
            self._call(self._end(), CLOSE_SECONDS)
        self._end_thread()

    def _call(self, work: Coroutine[Any, Any, T], timeout: float) -> T:
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(timeout)

    def _end_thread(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(CLOSE_SECONDS)
        if not self._thread.is_alive():
            self._loop.close()

    # From here on: the web's thread.

    async def _end(self) -> None:
        await close_server(self._server)
        tasks = asyncio.all_tasks() - {asyncio.current_task()}
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if self._open >= MAX_CONNECTIONS:
            self.counters["connections_refused"] += 1
            writer.transport.abort()
            return
        self._open += 1
        writer.transport.set_write_buffer_limits(high=0)  # drain waits until all of it is out
        try:
            async with asyncio.timeout(DEADLINE):
                writer.write(self._response(await reader.readuntil(b"\r\n\r\n")))
                await writer.drain()
                writer.close()
                await writer.wait_closed()
        except (TimeoutError, OSError, asyncio.IncompleteReadError, asyncio.LimitOverrunError):
            self.counters["connections_refused"] += 1
        finally:
            self._open -= 1
            writer.transport.abort()

    def _response(self, head: bytes) -> bytes:
        words = head.split(b"\r\n", 1)[0].decode("latin-1").split(" ")
        if len(words) != 3 or not words[2].startswith("HTTP/1."):
            return _bytes(_plain(http.HTTPStatus.BAD_REQUEST))
        if words[0] != "GET":
            return _bytes(_plain(http.HTTPStatus.METHOD_NOT_ALLOWED))
        answer = self._answer(words[1].partition("?")[0])
        if answer is None:
            return _bytes(_plain(http.HTTPStatus.NOT_FOUND))
        self.counters["scrapes"] += 1
        return _bytes(answer)


def _plain(status: http.HTTPStatus) -> Answer:
    return Answer(status, "text/plain", f"{status.phrase.lower()}\n".encode())


def _bytes(answer: Answer) -> bytes:
    status = answer.status
    head = (
        f"HTTP/1.1 {status.value} {status.phrase}\r\nContent-Type: {answer.kind}\r\n"
        f"Content-Length: {len(answer.body)}\r\nConnection: close\r\n\r\n"
    )
    return head.encode("ascii") + answer.body
