"""XML-RPC as ROS speaks it: short calls with a deadline, and a server for a node's own API."""

import asyncio
import xmlrpc.client
from collections.abc import Callable
from typing import Any, Final, cast
from urllib.parse import urlsplit
from xml.parsers.expat import ExpatError

import structlog

from shared.errors import MessageError
from shared.ros.errors import RosError
from shared.sockets import close_server

LARGEST: Final = 4 << 20
"""Bytes of a request or a reply; the state of a PR2's whole system takes 0.2 MB."""
_LARGEST_HEAD: Final = 16 << 10
_MOST_AT_ONCE: Final = 32
_SERVER_SECONDS: Final = 5.0
"""A request that takes longer to arrive is dropped."""
_BAD: Final = (
    MessageError,
    OSError,
    EOFError,
    asyncio.IncompleteReadError,
    asyncio.LimitOverrunError,
)

Method = Callable[..., list[Any]]

log = structlog.get_logger()


def place_of(uri: str) -> tuple[str, int]:
    """Return host and port of ``http://host:port`` or ``rosrpc://host:port``.

    Raises:
        RosError: it is no such address.
    """
    try:
        parts = urlsplit(uri)
        host, port = parts.hostname, parts.port
    except ValueError:
        host = port = None
    if not host or not port:
        raise RosError(f"{uri!r} is no address of a ROS node; expected http://host:port")
    return host, port


async def ask(uri: str, method: str, *arguments: Any) -> Any:
    """Call a method of a master or node; returns the third of (code, status, value).

    Raises:
        RosError: nobody answers there, or the answer is an error.
    """
    host, port = place_of(uri)
    try:
        answer = await _post(host, port, xmlrpc.client.dumps(arguments, method).encode())
        code, status, value = answer
        return value if code == 1 else _refused(uri, method, status)
    except xmlrpc.client.Fault as error:
        return _refused(uri, method, error.faultString)
    except (*_BAD, TypeError, ValueError) as error:
        raise RosError(
            f"{uri} does not answer {method}: {error or type(error).__name__}"
        ) from error


def _refused(uri: str, method: str, status: object) -> Any:
    raise RosError(f"{uri} refuses {method}: {str(status)[:200]}")


async def _post(host: str, port: int, body: bytes) -> Any:
    reader, writer = await asyncio.open_connection(host, port, limit=_LARGEST_HEAD)
    try:
        writer.write(
            f"POST /RPC2 HTTP/1.1\r\nHost: {host}:{port}\r\nContent-Type: text/xml\r\n"
            f"Content-Length: {len(body)}\r\nConnection: close\r\n\r\n".encode()
            + body
        )
        first, fields = await _head(reader)
        if b" 200" not in first[:16]:
            raise MessageError(f"HTTP says {first[:80]!r}")
        return _decoded(await _body(reader, fields))[0][0]
    finally:
        writer.close()


async def _head(reader: asyncio.StreamReader) -> tuple[bytes, dict[bytes, bytes]]:
    lines = (await reader.readuntil(b"\r\n\r\n")).split(b"\r\n")
    pairs = (line.partition(b":") for line in lines[1:] if line)
    return lines[0], {name.strip().lower(): value.strip() for name, _, value in pairs}


async def _body(reader: asyncio.StreamReader, fields: dict[bytes, bytes]) -> bytes:
    text = fields.get(b"content-length", b"")
    if not text.isdigit() or int(text) > LARGEST:
        raise MessageError(f"length of the body is {text[:20]!r}, expected up to {LARGEST} bytes")
    return await reader.readexactly(int(text))


def _decoded(body: bytes) -> tuple[tuple[Any, ...], str | None]:
    if b"<!" in body:
        raise MessageError("the XML declares entities or a document type")
    try:
        return xmlrpc.client.loads(body)
    except xmlrpc.client.Fault:
        raise
    except (ExpatError, xmlrpc.client.Error, ValueError, TypeError, KeyError, IndexError) as error:
        raise MessageError(f"no XML-RPC: {error}") from error
    except Exception as error:  # the parser's stack is a caller's to upset: AttributeError and such
        raise MessageError(f"no XML-RPC: {error!r}") from error


class XmlRpcServer:
    """A node's own API: a few methods that answer at once."""

    def __init__(self, methods: dict[str, Method]) -> None:
        """Take the methods.

        Args:
            methods: by name; each returns (code, status, value).
        """
        self._methods = methods
        self._server: asyncio.Server | None = None
        self._busy = 0
        self._is_closed = False
        self._serving: dict[asyncio.StreamWriter, asyncio.Task[None]] = {}
        self.refused = 0
        """Requests that were none."""

    async def open(self, address: str) -> int:
        """Listen at an address; returns the port.

        Raises:
            OSError: this machine has no such address.
        """
        self._server = await asyncio.start_server(
            self._take, address, 0, limit=_LARGEST_HEAD, backlog=64
        )
        return cast("int", self._server.sockets[0].getsockname()[1])

    async def close(self) -> None:
        """Stop listening, and let go of those who are just asking."""
        self._is_closed = True
        if self._server is not None:
            await close_server(self._server)
        for writer in self._serving:
            writer.transport.abort()

    def _take(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Begin to serve a connection.

        Not left to asyncio: one whose task ends before its first step would stay open.
        """
        if self._is_closed:
            writer.transport.abort()
            return
        task = asyncio.get_running_loop().create_task(self._serve(reader, writer))
        self._serving[writer] = task
        task.add_done_callback(lambda _: self._let_go(writer))

    def _let_go(self, writer: asyncio.StreamWriter) -> None:
        self._serving.pop(writer, None)
        if not writer.is_closing():  # its task was cancelled before its first step
            writer.transport.abort()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._busy += 1
        try:
            if self._busy > _MOST_AT_ONCE:
                raise MessageError("too many requests at once")
            async with asyncio.timeout(_SERVER_SECONDS):
                _, fields = await _head(reader)
                answer = self._answer(await _body(reader, fields))
                writer.write(
                    b"HTTP/1.1 200 OK\r\nContent-Type: text/xml\r\nConnection: close\r\n"
                    b"Content-Length: %d\r\n\r\n" % len(answer) + answer
                )
                await writer.drain()
        except (*_BAD, TimeoutError) as error:
            self.refused += 1
            log.debug("ros_request_refused", error=str(error))
        finally:
            self._busy -= 1
            writer.close()

    def _answer(self, body: bytes) -> bytes:
        try:
            arguments, name = _decoded(body)
        except xmlrpc.client.Fault as error:
            raise MessageError("a fault is no request") from error
        method = self._methods.get(name or "")
        if method is None:
            reply: list[Any] = [-1, f"no method {name!r}"[:100], 0]
        else:
            try:
                reply = method(*arguments)
            except (TypeError, ValueError, MessageError, RosError) as error:
                reply = [-1, f"bad arguments: {error}"[:200], 0]
        text = xmlrpc.client.dumps((reply,), methodresponse=True, allow_none=True)
        return text.encode()
