"""Where a node's own topics and services are connected to."""

import socket
from collections.abc import Callable, Coroutine
from typing import Any, Final

import structlog

from shared.ros.loop import SocketLoop

_AGAIN_SECONDS: Final = 0.1
_BACKLOG: Final = 64

log = structlog.get_logger()


class Listener:
    """Takes connections; used on the loop's thread."""

    def __init__(
        self, address: str, serve: Callable[[socket.socket], Coroutine[Any, Any, None]],
        *, most: int, loop: SocketLoop,
    ) -> None:  # fmt: skip
        """Listen on any free port.

        Args:
            address: of this machine.
            serve: one connection, which is closed when this ends, or is ended before it began.
            most: connections at a time; those above are closed at once.
            loop: whose thread this runs on.

        Raises:
            OSError: this machine has no such address.
        """
        self._serve = serve
        self._most = most
        self._loop = loop
        self._open = 0
        self.refused = 0
        self._socket = socket.create_server((address, 0), backlog=_BACKLOG)
        self._socket.setblocking(False)
        self.port = int(self._socket.getsockname()[1])
        self._listen()

    def close(self) -> None:
        """Take no more; those who are served are left alone."""
        self._loop.events.remove_reader(self._socket)
        self._socket.close()

    def _listen(self) -> None:
        if self._socket.fileno() != -1:  # not closed since it was out of descriptors
            # not the loop's own sock_accept: one that is cancelled loses whom it has just taken
            self._loop.events.add_reader(self._socket, self._take)

    def _take(self) -> None:
        try:
            sock, _ = self._socket.accept()
        except (BlockingIOError, InterruptedError, ConnectionAbortedError):
            return
        except OSError as error:  # out of descriptors
            log.warning("ros_accept_failed", error=str(error))
            self._loop.events.remove_reader(self._socket)
            self._loop.events.call_later(_AGAIN_SECONDS, self._listen)
            return
        if self._open >= self._most:
            self.refused += 1
            sock.close()
            return
        sock.setblocking(False)
        self._open += 1
        self._loop.begin(self._serve(sock)).add_done_callback(lambda _: self._let_go(sock))

    def _let_go(self, sock: socket.socket) -> None:
        self._open -= 1
        sock.close()
