"""What goes to and fro over one WebSocket, and what of it was refused."""

import asyncio
import contextlib
import threading
from collections.abc import Callable

import structlog
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from shared.errors import MessageError

MAX_REFUSED = 64
"""Messages that a page may send in vain before it is sent away."""
TAKEN_OVER, MISBEHAVED = 4001, 4008
"""Close codes of the WebSocket."""
TOO_BIG = 1009

log = structlog.get_logger()


class Tally:
    """Counts, and the last refusal, which is logged when it is a new one; for any thread."""

    def __init__(self, *names: str) -> None:
        """Start all at 0."""
        self._lock = threading.Lock()
        self._counts = dict.fromkeys(names, 0)
        self.last_refusal = ""
        """Why a page or a message was refused last; empty before."""

    @property
    def counts(self) -> dict[str, int]:
        """Return counts since the start."""
        with self._lock:
            return dict(self._counts)

    def add(self, name: str, count: int = 1) -> int:
        """Count; return how many there are now."""
        with self._lock:
            self._counts[name] += count
            return self._counts[name]

    def refuse(self, name: str, reason: str) -> None:
        """Count a refusal and say it, once in a row."""
        with self._lock:
            self._counts[name] += 1
            is_new = reason != self.last_refusal
            self.last_refusal = reason
        if is_new:
            log.warning("page_refused", counter=name, reason=reason)


class Talk:
    """What goes to and fro over one WebSocket; on the web's thread."""

    def __init__(self, connection: ServerConnection) -> None:
        """Begin; ``run`` carries it."""
        self._socket = connection
        self._news = asyncio.Event()
        self._ending: asyncio.Future[tuple[int, str]] = asyncio.get_running_loop().create_future()

    def wake(self) -> None:
        """Say that there is something to send."""
        self._news.set()

    def end(self, code: int, reason: str) -> bool:
        """Have the connection closed; return whether it was not on its way already."""
        if self._ending.done():
            return False
        self._ending.set_result((code, reason))
        return True

    async def run(
        self, take: Callable[[str | bytes], None], following: Callable[[], bytes | None],
        refused: Callable[[str], None], max_bytes: int, pause: float = 0.0,
    ) -> None:  # fmt: skip
        """Carry what is said until the page goes or is sent away.

        Args:
            take: takes a message, or raises MessageError; a page that often says what cannot be
                read is sent away.
            following: returns what is to be sent next, None for nothing.
            refused: is told why a message was not taken.
            max_bytes: longest message, for the words when there was a longer one.
            pause: from one batch of messages to the next (s).
        """
        sender = asyncio.create_task(self._send(following, pause))
        closer = asyncio.create_task(self._close_when_told())
        count = 0
        try:
            async for message in self._socket:
                try:
                    take(message)
                except MessageError as error:
                    refused(str(error))
                    count += 1
                    if count == MAX_REFUSED:
                        self.end(MISBEHAVED, "too many messages that cannot be read")
        except ConnectionClosed as error:
            if error.sent is not None and error.sent.code == TOO_BIG:
                refused(f"a message is longer than {max_bytes} bytes")
        finally:
            sender.cancel()
            closer.cancel()

    async def _send(self, following: Callable[[], bytes | None], pause: float) -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                await self._news.wait()
                self._news.clear()
                while (text := following()) is not None:
                    await self._socket.send(text, text=True)  # waits while the browser is slow
                await asyncio.sleep(pause)

    async def _close_when_told(self) -> None:
        code, reason = await self._ending
        await self._socket.close(code, reason)
