"""A headless Chromium with the page in it."""

import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from playwright.sync_api import Page, sync_playwright

FLAGS = (
    "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage",
    "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1, EXCLUDE localhost",
)  # fmt: skip

POLL_SECONDS = 0.04
"""Between two looks at the page, which cost more than what they look at."""


def find_chromium() -> str | None:
    """Return the browser's path, None where there is none."""
    names = ("chromium", "chromium-browser", "google-chrome", "chrome")
    return next((path for name in names if (path := shutil.which(name))), None)


class Player:
    """A person at the page."""

    def __init__(self, page: Page, errors: list[str], listen: Callable[[], None]) -> None:
        self.page = page
        self.errors = errors
        self._listen = listen

    def read(self, expression: str) -> Any:
        return self.page.evaluate(f"riposte.{expression}")

    def point(self, x: float, y: float, z: float) -> None:
        """Move the mouse to where a point of the world is seen."""
        self.page.mouse.move(*self.read(f"seenAt([{x}, {y}, {z}])"))

    def until(self, condition: Callable[[], Any], seconds: float = 45.0) -> Any:
        deadline = time.monotonic() + seconds
        while not (value := condition()):
            if time.monotonic() > deadline:
                shown = self.page.evaluate("document.body.innerText")
                raise AssertionError(f"not within {seconds} s: {self.read('frame()')}\n{shown}")
            until = time.monotonic() + POLL_SECONDS
            while time.monotonic() < until:
                self._listen()
        return value

    def arm(self) -> None:
        """Click until the robot is armed: a refusal, such as for a late policy, is asked again."""

        def is_armed() -> bool:
            if self.read("frame()?.gate.mode") in ("ramping", "armed", "holding"):
                return True
            if self.read("action()") == "arm":
                self.press()
                self.page.wait_for_timeout(1000)
            return False

        self.until(is_armed)

    def press(self) -> None:
        """Click where the large button is: one greyed or taken away since a look ignores it."""
        box = self.page.locator("#primary").bounding_box()
        if box:
            self.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)


@contextmanager
def browser(listen: Callable[[], None]) -> Iterator[Callable[[str], Player]]:
    """Open pages: call what this yields with an address."""
    program = find_chromium()
    assert program is not None
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=program, args=list(FLAGS))

        def opened(url: str) -> Player:
            page = chromium.new_page(viewport={"width": 800, "height": 450})
            page.set_default_timeout(60_000)
            errors: list[str] = []
            page.on("pageerror", lambda error: errors.append(str(error)))
            page.on(
                "console",
                lambda said: errors.append(said.text) if said.type == "error" else None,
            )
            page.goto(url)
            page.wait_for_function("window.riposte !== undefined")
            return Player(page, errors, listen)

        yield opened
        chromium.close()
