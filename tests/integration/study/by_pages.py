"""The two people at the pages of a study, who click and type in a real browser."""

import contextlib
import time
from typing import Any

from playwright.sync_api import Page, TimeoutError

from tests.integration.study.running import Run

PATIENCE_MS = 10_000.0
"""For one click; then it is looked again what is to be done."""


def lead(page: Page) -> None:
    """Click what the researcher has to do now, if anything."""
    view = page.evaluate("window.study?.state() === 'open' && study.view()")
    if not view:
        return
    shut = {"disarmed": "#arm", "tripped": "#reset"}
    button = shut.get(view["gate"]["mode"]) if view["course"] == "running" else None
    button = button or ("#begin" if "begin" in view["may"] else None)
    if button:
        press(page, button)


def press(page: Page, button: str) -> None:
    """Click a button that can be clicked, and let the page hear what came of it."""
    if page.is_visible(button) and page.is_enabled(button):
        page.click(button)
        page.wait_for_timeout(300)


def take_part(page: Page) -> None:
    """Fill in and click what the participant has to, if anything."""
    view = page.evaluate("window.study?.state() === 'open' && study.view()")
    if not view or not view["may"]:
        return
    if view["screen"] == "consent":
        page.evaluate("document.querySelector('.paper')?.scrollTo(0, 1e6)")
        page.wait_for_timeout(200)
        for tick in page.locator(".tick input").all():
            tick.check()
    for number, item in enumerate(view["items"]):
        if page.is_visible(place := f"[data-item={item['id']}]"):  # else: kept from before
            fill_in(page, place, item)
            if view["is_paged"] and number + 1 < len(view["items"]):
                press(page, "form button.main")
    press(page, "form button.main" if view["items"] else "#button")


def fill_in(page: Page, place: str, item: dict[str, Any]) -> None:
    """Answer one question."""
    if item["scale"] == "ranking":
        for row in range(len(item["options"])):
            page.click(f"{place} .rank >> nth={row} >> label >> nth={row}")
    elif item["scale"] == "open":
        page.fill(f"{place} textarea", "words")
    else:
        page.click(f"{place} label >> nth={3 if item['scale'] == 'points' else 0}")


def go_on(run: Run, pages: tuple[Page, Page], is_there, seconds: float = 200.0) -> None:
    """Do what is due at both pages until a condition holds."""
    deadline = time.monotonic() + seconds
    for page in pages:
        page.set_default_timeout(PATIENCE_MS)
    while not is_there():
        with contextlib.suppress(TimeoutError):  # a page went on to another screen meanwhile
            lead(pages[0])
            take_part(pages[1])
        pages[0].wait_for_timeout(100)
        assert run.process.poll() is None, run.said
        said = [page.inner_text("body")[:600] for page in pages]
        assert time.monotonic() < deadline, (said, run.said[-1000:])
