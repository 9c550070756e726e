"""Serves the study's two pages: whole views out, the newest wins; asks with ids in, each once.

Researchers' pages may be several and need the token that is in their address; of participants'
pages the newest one counts, and the one before it is told. No page decides anything: what it asks
for waits in ``Asks`` for the service, which says what came of it.
"""

import collections
import functools
import hmac
import secrets
from collections.abc import Iterable
from pathlib import Path
from typing import Literal
from urllib.parse import parse_qs

import msgspec
import structlog
from websockets.asyncio.server import ServerConnection

from services.study.asks import Asks
from services.study.view import (
    MAX_BYTES,
    ParticipantView,
    Reply,
    ResearcherView,
    parse_participant_ask,
    parse_researcher_ask,
)
from shared.errors import ConfigError, MessageError
from shared.runtime.files import atomic_write
from shared.runtime.talk import TAKEN_OVER, Talk, Tally
from shared.runtime.web import Asset, WebServer, load_files

STATIC = Path(__file__).parent / "static"
RESEARCHER, PARTICIPANT = "/researcher", "/participant"
SOCKET = "/socket"
"""After the path of a page: its WebSocket."""
MAX_PAGES = 8
"""Researchers' pages at a time."""
TOO_MANY = 4009
"""Close code of the WebSocket."""
VIEW_PERIOD = 0.1
"""From one view to the next at a page (s)."""
MAX_UNDER_WAY = 64
"""Asks of one page whose replies it is sent."""
TOKEN_FILE = "researcher.token"
_TOKEN_BYTES = 18

Role = Literal["researcher", "participant"]
_ENCODER = msgspec.json.Encoder()
log = structlog.get_logger()


def token_of(folder: Path) -> str:
    """Return the researcher's token of a folder, made at the first call and kept for its owner.

    Raises:
        ConfigError: the folder cannot be written, or the file holds something else.
    """
    path = folder / TOKEN_FILE
    try:
        if not path.exists():
            folder.mkdir(parents=True, exist_ok=True)
            atomic_write(path, secrets.token_urlsafe(_TOKEN_BYTES).encode(), mode=0o600)
        token = path.read_text("ascii").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"cannot keep the researcher's token in {path}: {error}") from error
    if len(token) < _TOKEN_BYTES:
        raise ConfigError(f"{path} holds no token: delete it, and a new one is made")
    return token


def drop_token(folder: Path) -> None:
    """Delete the researcher's token of a folder: the address that it was in opens nothing more."""
    (folder / TOKEN_FILE).unlink(missing_ok=True)


def load_assets(folder: Path = STATIC) -> dict[str, Asset]:
    """Return the files of both pages by path.

    Raises:
        ConfigError: the installation lacks them.
    """
    found = load_files(folder)
    for page in (RESEARCHER, PARTICIPANT):
        if f"{page}.html" not in found:
            raise ConfigError(f"{folder} has no {page[1:]}.html: install Riposte again")
        found[page] = found.pop(f"{page}.html")
    return found


class Web:
    """The server of both pages; its methods are for the service's thread."""

    def __init__(
        self, host: str, port: int, origins: Iterable[str], *, token: str, asks: Asks
    ) -> None:
        """Start to serve.

        Args:
            host: interface.
            port: 0 takes any that is free.
            origins: addresses the pages may be opened under beside their own.
            token: in the address of the researcher's page.
            asks: takes what the pages ask for.

        Raises:
            ConfigError: it cannot listen there, or the installation lacks the pages.
        """
        self._token = token
        self._asks = asks
        self._pages: dict[Role, list[_Page]] = {"researcher": [], "participant": []}
        self._researcher: ResearcherView | None = None
        self._participant: ParticipantView | None = None
        self._tally = Tally(
            "pages", "pages_replaced", "pages_refused", "messages_refused", "views_sent",
            "views_dropped",
        )  # fmt: skip
        asks.follow(self._tell)
        self._server = WebServer(
            host, port, origins, section="study", assets=load_assets(),
            sockets={
                RESEARCHER + SOCKET: functools.partial(self._serve, "researcher"),
                PARTICIPANT + SOCKET: functools.partial(self._serve, "participant"),
            },
            max_bytes=MAX_BYTES, tally=self._tally, guard=self._guard,
        )  # fmt: skip
        self.port = self._server.port
        self.researcher_url = f"{self._server.url}{RESEARCHER}?token={token}"
        """Whoever has it steers the study and can arm the robot."""
        self.participant_url = f"{self._server.url}{PARTICIPANT}"

    @property
    def is_participant_here(self) -> bool:
        """Return whether a participant's page is open."""
        return bool(self._pages["participant"])

    @property
    def counters(self) -> dict[str, int]:
        """Return counts since the start."""
        return {**self._tally.counts, "asks_dropped": self._asks.dropped}

    @property
    def last_refusal(self) -> str:
        """Return why a page or a message was refused last; empty before."""
        return self._tally.last_refusal

    def show(self, researcher: ResearcherView, participant: ParticipantView) -> None:
        """Show new views; pages that are still busy with older ones skip to these."""
        self._researcher, self._participant = researcher, participant
        self._server.call_soon(self._wake)

    def close(self) -> None:
        """Send the pages away and stop serving; a second time does nothing."""
        self._server.close()

    def _tell(self, reply: Reply) -> None:
        self._server.call_soon(functools.partial(self._reply, reply))

    # From here on: the web's thread.

    def _guard(self, path: str, query: str) -> str:
        """Say why a researcher's page is not served, or nothing."""
        if path not in (RESEARCHER, RESEARCHER + SOCKET):
            return ""
        given = parse_qs(query).get("token", [""])[0]
        if hmac.compare_digest(given.encode(), self._token.encode()):
            return ""
        return "the researcher's page needs its token: open the address that the terminal shows"

    def _wake(self) -> None:
        for page in (*self._pages["researcher"], *self._pages["participant"]):
            self._tally.add("views_dropped", page.has_news)
            page.has_news = True
            page.talk.wake()

    def _reply(self, reply: Reply) -> None:
        for pages in self._pages.values():
            for page in pages:
                if reply.id in page.asked:
                    page.replies.append(reply)
                    page.talk.wake()

    async def _serve(self, role: Role, connection: ServerConnection) -> None:
        """Serve one page until it goes, or another takes over."""
        pages = self._pages[role]
        if role == "participant":
            for before in pages:
                if before.talk.end(TAKEN_OVER, "another page has taken over"):
                    self._tally.add("pages_replaced")
        elif len(pages) >= MAX_PAGES:
            self._tally.refuse("pages_refused", f"{MAX_PAGES} researcher's pages are open")
            await connection.close(TOO_MANY, f"{MAX_PAGES} pages are open: close one of them")
            return
        page = _Page(role, Talk(connection))
        pages.append(page)
        number = self._tally.add("pages")
        log.info("page_opened", page=number, role=role)
        page.has_news = True
        page.talk.wake()
        try:
            await page.talk.run(
                functools.partial(self._take, page), functools.partial(self._next, page),
                functools.partial(self._tally.refuse, "messages_refused"), MAX_BYTES, VIEW_PERIOD,
            )  # fmt: skip
        finally:
            pages.remove(page)
            log.info("page_closed", page=number, role=role)

    def _take(self, page: "_Page", message: str | bytes) -> None:
        if isinstance(message, bytes):
            raise MessageError(f"{len(message)} bytes are no ask, expected text")
        parse = parse_researcher_ask if page.role == "researcher" else parse_participant_ask
        ask = parse(message)
        if ask.id not in page.asked:
            page.asked.append(ask.id)
        if (reply := self._asks.put(ask)) is not None:
            page.replies.append(reply)
            page.talk.wake()

    def _next(self, page: "_Page") -> bytes | None:
        if page.replies:
            return _ENCODER.encode({"type": "reply", "reply": page.replies.popleft()})
        view = self._researcher if page.role == "researcher" else self._participant
        if not page.has_news or view is None:
            return None
        page.has_news = False
        self._tally.add("views_sent")
        return _ENCODER.encode({"type": "view", "view": view})


class _Page:
    """One page's connection."""

    def __init__(self, role: Role, talk: Talk) -> None:
        self.role: Role = role
        self.talk = talk
        self.has_news = False
        """Whether there is a view that it has not been sent."""
        self.replies: collections.deque[Reply] = collections.deque(maxlen=MAX_UNDER_WAY)
        self.asked: collections.deque[str] = collections.deque(maxlen=MAX_UNDER_WAY)
        """Ids whose replies it is sent."""
