"""The real server with a script in the runner's place, and a headless Chromium before it."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import msgspec
from playwright.sync_api import Browser, Page, sync_playwright

from services.study.asks import Asks
from services.study.view import (
    Ask,
    ParticipantAsk,
    ParticipantView,
    Reply,
    ResearcherAsk,
    ResearcherView,
)
from services.study.web import Web
from tests.integration.page.browsing import FLAGS, find_chromium
from tests.integration.study_pages.views import participant, researcher

TOKEN = "0123456789abcdefghijklmn"
X = TypeVar("X")


class Runner:
    """Shows what a test says, and keeps the asks for it."""

    def __init__(self) -> None:
        self.researcher: ResearcherView = researcher()
        self.participant: ParticipantView = participant("waiting")
        self.asked: list[Ask] = []
        self.start()

    def start(self, *replies: Reply, port: int = 0) -> None:
        """Serve, as a new process would that knows these replies from its journal."""
        self.asks = Asks(replies)
        self.web = Web("127.0.0.1", port, (), token=TOKEN, asks=self.asks)
        self.show()

    def restart(self, *replies: Reply) -> None:
        self.web.close()
        self.start(*replies, port=self.web.port)

    def show(
        self, participant: ParticipantView | None = None, researcher: ResearcherView | None = None
    ) -> None:
        self.participant = participant or self.participant
        self.researcher = researcher or self.researcher
        self.web.show(self.researcher, self.participant)

    def change(self, **fields: Any) -> None:
        self.show(researcher=msgspec.structs.replace(self.researcher, **fields))

    def listen(self) -> None:
        self.show()
        while (ask := self.asks.take()) is not None:
            self.asked.append(ask)

    def until(self, condition: Callable[[], X], seconds: float = 20.0) -> X:
        deadline = time.monotonic() + seconds
        while not (value := condition()):
            assert time.monotonic() < deadline, f"not within {seconds} s: {self.asked}"
            time.sleep(0.01)
            self.listen()
        return value

    def said(self) -> ParticipantAsk:
        """Return the only ask of the participant's page, once it is there."""
        self.until(lambda: self.asked)
        (ask,) = self.asked
        assert isinstance(ask, ParticipantAsk)
        return ask

    def wanted(self) -> ResearcherAsk:
        """Return the only ask of the researcher's page, once it is there; it is done with then."""
        self.until(lambda: self.asked)
        (ask,) = self.asked
        assert isinstance(ask, ResearcherAsk)
        self.asked.clear()
        return ask

    def answer(self, ask: Ask, *lines: str) -> None:
        self.asks.answer(Reply(id=ask.id, is_done=not lines, lines=lines))


class Visit:
    """One page in the browser."""

    def __init__(self, runner: Runner, page: Page) -> None:
        self.runner = runner
        self.page = page
        self.errors: list[str] = []
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on(
            "console", lambda said: self.errors.append(said.text) if said.type == "error" else None
        )

    def until(self, expression: str, seconds: float = 20.0) -> Any:
        """Wait until something is true in the page; return what it is."""
        try:
            return self.runner.until(lambda: self.page.evaluate(expression), seconds)
        except AssertionError as error:
            raise AssertionError(
                f"{expression} did not come true:\n{self.text()}\n{self.errors}"
            ) from error

    def until_alone(self, expression: str, seconds: float = 20.0) -> None:
        """Wait until something is true in the page while the runner says nothing."""
        for _ in range(round(seconds / 0.1)):
            if self.page.evaluate(expression):
                return
            self.page.wait_for_timeout(100)
        raise AssertionError(f"{expression} did not come true:\n{self.text()}")

    def shows(self, view: ParticipantView) -> "Visit":
        """Show a view and wait until the page has it."""
        self.runner.show(participant=view)
        wanted = msgspec.json.encode(view).decode()
        self.until(f"JSON.stringify(study.view()) === JSON.stringify({wanted})")
        return self

    def reload(self) -> None:
        self.page.reload()
        self.until("window.study?.view()")

    def text(self, selector: str = "body") -> str:
        return self.page.inner_text(selector)

    def is_on(self, selector: str) -> bool:
        return self.page.is_visible(selector) and self.page.is_enabled(selector)


Opener = Callable[..., Visit]


@contextmanager
def chromium() -> Iterator[Browser]:
    program = find_chromium()
    assert program is not None
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=list(FLAGS))
        yield browser
        browser.close()


@contextmanager
def opening(browser: Browser, runner: Runner) -> Iterator[Opener]:
    """Yield what opens pages as further tabs of one window: ``researcher=True``, ``touch=True``."""
    contexts: list[Any] = []

    def opened(*, is_researcher: bool = False, has_touch: bool = False) -> Visit:
        size = (1280, 800) if is_researcher else (1024, 768)
        context = browser.new_context(
            viewport={"width": size[0], "height": size[1]}, has_touch=has_touch
        )
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(20_000)
        visit = Visit(runner, page)
        page.goto(runner.web.researcher_url if is_researcher else runner.web.participant_url)
        visit.until("window.study?.view()")
        return visit

    yield opened
    for context in contexts:
        context.close()
