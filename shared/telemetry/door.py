"""A short address for a long one: answers every request with where to go, without a thread."""

import contextlib
import dataclasses
import socket
from pathlib import Path

import msgspec

from shared.bus.ports import LOOPBACK, free_port
from shared.clock import Clock

MOST = 16
"""Visitors at once; more are not let in until one has left."""
PATIENCE = 5.0
"""Seconds a visitor has to say what it wants."""
REQUEST_BYTES = 16384
VIEWER_FILE = "viewer.json"


class LiveView(msgspec.Struct, frozen=True, kw_only=True):
    """Where a run can be watched: ``viewer.json`` in its folder, as long as it can."""

    url: str
    """Short address."""
    page: str
    """The viewer's own, with everything it must open."""
    pid: int
    """Of the process that serves the page."""


def read_live_view(folder: Path) -> LiveView | None:
    """Return where a run can be watched, None where nobody shows it."""
    try:
        return msgspec.json.decode((folder / VIEWER_FILE).read_bytes(), type=LiveView)
    except (OSError, ValueError, RecursionError):
        return None


@dataclasses.dataclass
class _Visitor:
    connection: socket.socket
    until: float


class FrontDoor:
    """Sends whoever opens ``url`` to another address; does nothing but on ``tick``."""

    def __init__(self, target: str, port: int, clock: Clock) -> None:
        """Open a port of the loopback, ``port`` where it is free.

        Raises:
            OSError: it was taken just now.
        """
        self._clock = clock
        self._answer = (
            "HTTP/1.1 302 Found\r\n"
            f"Location: {target}\r\n"
            "Content-Length: 0\r\nCache-Control: no-store\r\nConnection: close\r\n\r\n"
        ).encode("ascii")
        self._visitors: list[_Visitor] = []
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._socket.bind((LOOPBACK, free_port(port)))
            self._socket.listen(MOST)
        except OSError:
            self._socket.close()
            raise
        self._socket.setblocking(False)

    @property
    def url(self) -> str:
        """Return the short address."""
        return f"http://{LOOPBACK}:{self._socket.getsockname()[1]}"

    def tick(self) -> None:
        """Let visitors in and answer those who have asked."""
        now = self._clock.now()
        while len(self._visitors) < MOST:
            try:
                connection, _ = self._socket.accept()
            except OSError:
                break
            connection.setblocking(False)
            self._visitors.append(_Visitor(connection, now + PATIENCE))
        self._visitors = [visitor for visitor in self._visitors if self._stays(visitor, now)]

    def close(self) -> None:
        """Close the port."""
        for visitor in self._visitors:
            visitor.connection.close()
        self._visitors.clear()
        self._socket.close()

    def _stays(self, visitor: _Visitor, now: float) -> bool:
        try:
            asked = visitor.connection.recv(REQUEST_BYTES)
        except BlockingIOError:
            if now < visitor.until:
                return True
            asked = b""
        except OSError:
            asked = b""
        with contextlib.suppress(OSError):
            if asked:
                visitor.connection.send(self._answer)
                visitor.connection.shutdown(socket.SHUT_WR)
        visitor.connection.close()
        return False
