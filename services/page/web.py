"""The page's side of its server: newest frame and notes out, newest pose and wishes in.

To a browser go the newest frame, older ones being dropped while it is slow, and notes, a bounded
queue. From it come the newest pose and wishes, a bounded queue. One page plays at a time: a new
one takes over, and the old one is told.
"""

import functools
import threading
from collections import deque
from collections.abc import Iterable, Mapping

import structlog
from websockets.asyncio.server import ServerConnection

from services.page.protocol import MAX_BYTES, Ask, Pointer, parse_ask, parse_pointer
from shared.runtime.talk import TAKEN_OVER, Talk, Tally
from shared.runtime.web import Asset, WebServer

SOCKET_PATH = "/bout"
MAX_NOTES = 32
MAX_ASKS = 16

log = structlog.get_logger()


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
        self._lock = threading.Lock()
        self._session: _Session | None = None
        self._pointer: Pointer | None = None
        self._asks: deque[tuple[int, Ask]] = deque()
        self._tally = Tally(
            "pages", "pages_replaced", "pages_refused", "messages_refused", "frames_sent",
            "frames_dropped", "poses_received", "wishes_dropped",
        )  # fmt: skip
        self._server = WebServer(
            host, port, origins, section="page", assets=assets, sockets={SOCKET_PATH: self._play},
            max_bytes=MAX_BYTES, tally=self._tally,
        )  # fmt: skip
        self.port = self._server.port
        self.url = self._server.url

    @property
    def session(self) -> int:
        """Return the number of the page that plays, 0 without one."""
        session = self._session
        return session.number if session is not None else 0

    @property
    def counters(self) -> dict[str, int]:
        """Return counts since the start."""
        return self._tally.counts

    @property
    def last_refusal(self) -> str:
        """Return why a page or a message was refused last; empty before."""
        return self._tally.last_refusal

    def show(self, frame: bytes) -> None:
        """Send a frame to the page; one that has not gone out yet is dropped for it."""
        session = self._session
        if session is None:
            return
        with self._lock:
            is_late = session.frame is not None
            session.frame = frame
        self._tally.add("frames_dropped", is_late)
        self._server.call_soon(session.talk.wake)

    def tell(self, note: bytes) -> None:
        """Send a note to the page, in order and before frames; the oldest give way to new ones."""
        session = self._session
        if session is None:
            return
        with self._lock:
            session.notes.append(note)
        self._server.call_soon(session.talk.wake)

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
        self._server.close()

    # From here on: the web's thread.

    async def _play(self, connection: ServerConnection) -> None:
        """Serve one page until it goes, or another takes over."""
        with self._lock:
            before = self._session
            session = self._session = _Session(self._tally.add("pages"), Talk(connection))
            self._pointer = None
            self._asks.clear()
        if before is not None and before.talk.end(TAKEN_OVER, "another page plays now"):
            self._tally.add("pages_replaced")
        log.info("page_opened", page=session.number)
        try:
            await session.talk.run(
                functools.partial(self._take, session), functools.partial(self._next, session),
                functools.partial(self._tally.refuse, "messages_refused"), MAX_BYTES,
            )  # fmt: skip
        finally:
            if self._session is session:
                self._session = None
            log.info("page_closed", page=session.number)

    def _take(self, session: "_Session", message: str | bytes) -> None:
        if isinstance(message, bytes):
            pointer = parse_pointer(message, session.number, session.sequence)
            session.sequence = pointer.sequence
            with self._lock:
                self._pointer = pointer
            self._tally.add("poses_received")
            return
        ask = parse_ask(message)
        with self._lock:
            has_room = len(self._asks) < MAX_ASKS
            if has_room:
                self._asks.append((session.number, ask))
        self._tally.add("wishes_dropped", not has_room)

    def _next(self, session: "_Session") -> bytes | None:
        with self._lock:
            if session.notes:
                return session.notes.popleft()
            frame, session.frame = session.frame, None
        self._tally.add("frames_sent", frame is not None)
        return frame


class _Session:
    """One page's connection; ``frame`` and ``notes`` are shared under the web's lock."""

    def __init__(self, number: int, talk: Talk) -> None:
        self.number = number
        self.talk = talk
        self.frame: bytes | None = None
        self.notes: deque[bytes] = deque(maxlen=MAX_NOTES)
        self.sequence = -1
