"""What people see, in a real browser. Needs Chromium: ``apt install chromium``."""

import io
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from services.jobs.report.command import write_report
from services.jobs.reproduction.page import heat
from services.jobs.reproduction.parts import Cell, Score, Tournament
from shared.clock import SystemClock
from shared.telemetry import html
from tests.integration.telemetry.browser import Browser, find_chromium
from tests.unit.jobs.ledgers import finished_run

CHROMIUM = find_chromium()
pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(300),
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium: apt install chromium"),
]


@pytest.fixture
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    assert CHROMIUM is not None
    profile = tmp_path_factory.mktemp("profile")
    opened = Browser(CHROMIUM, profile, SystemClock(), (1400, 900))
    yield opened
    opened.close()


def pixels(image: bytes) -> NDArray[np.int16]:
    """Return int16[H, W, 3]."""
    return np.asarray(Image.open(io.BytesIO(image)).convert("RGB"), np.int16)


def test_the_report_is_complete_and_asks_for_nothing(tmp_path: Path, browser: Browser) -> None:
    write_report(finished_run(tmp_path))

    browser.open((tmp_path / "report.html").as_uri())
    assert browser.wait_until(
        lambda: browser.evaluate("document.readyState") == "complete", timeout=30.0
    )

    assert browser.evaluate("document.querySelectorAll('svg').length") == 2
    assert browser.evaluate("document.querySelectorAll('h2').length") >= 4
    assert browser.evaluate("document.documentElement.scrollWidth") <= 1400
    requests = [
        event["params"]["request"]["url"]
        for event in browser.events
        if event["method"] == "Network.requestWillBeSent"
    ]
    assert all(url.startswith(("file:", "data:")) for url in requests)
    errors = [event for event in browser.events if event["method"] == "Log.entryAdded"]
    assert errors == []


@pytest.mark.parametrize("columns", [3, 7, 12, 20])
def test_a_matrix_fits_the_page_however_many_play(
    tmp_path: Path, browser: Browser, columns: int
) -> None:
    names = ["protagonist warm start", "heuristic-retreating", *map(str, range(columns - 2))]
    score = Score(mean=-12_345.0, low=-13_456.0, high=-11_234.0, count=100)
    cells = [
        Cell(antagonist=one, protagonist=two, bouts=100, score=score, camping_share=0.4)
        for one in ("antagonist warm start", "person-adaptive", "antagonist round 6")
        for two in names
    ]
    tournament = Tournament(
        bouts=1, least_bouts=1, antagonists=tuple(dict.fromkeys(c.antagonist for c in cells)),
        protagonists=tuple(names), cells=tuple(cells), camping_share=0.0, ratings=(), scripted=(),
        held=(), baselines=(),
    )  # fmt: skip
    page = tmp_path / "page.html"
    page.write_text(html.page("t", heat(tournament, "words")), encoding="utf-8")
    browser.open(page.as_uri())
    assert browser.wait_until(
        lambda: browser.evaluate("document.readyState") == "complete", timeout=30.0
    )
    width, room = browser.evaluate(
        "(w => [w.scrollWidth, w.clientWidth])(document.querySelector('.wide'))"
    )
    assert 0 < width <= room
    cut = "[...document.querySelectorAll('td, th')].filter(c => c.scrollWidth > c.clientWidth + 1)"
    assert browser.evaluate(f"{cut}.map(c => c.textContent)") == []
    browser.screenshot(tmp_path / "page.png", full_page=True)
    assert (tmp_path / "page.png").stat().st_size > 0


def test_the_report_follows_a_dark_scheme(tmp_path: Path, browser: Browser) -> None:
    write_report(finished_run(tmp_path))
    page = (tmp_path / "report.html").as_uri()
    brightness: dict[str, float] = {}
    for scheme in ("light", "dark"):
        media = [{"name": "prefers-color-scheme", "value": scheme}]
        browser.ask("Emulation.setEmulatedMedia", features=media)
        browser.open(page)
        browser.listen(1.0)
        brightness[scheme] = float(pixels(browser.screenshot()).mean())

    assert brightness["light"] > 200
    assert brightness["dark"] < 60


def test_the_live_view_shows_both_robots(tmp_path: Path, browser: Browser) -> None:
    command = [sys.executable, "-m", "tests.integration.telemetry.showing", str(tmp_path / "run")]
    shower = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert shower.stdin is not None
    assert shower.stdout is not None
    try:
        url = shower.stdout.readline()
        while not url.startswith("http"):  # the log comes before it
            url = shower.stdout.readline()
        browser.open(url.strip())

        def both_are_there() -> bool:
            try:
                image = pixels(browser.screenshot(tmp_path / "live.png"))
            except RuntimeError:  # between two pages there is nothing to see
                return False
            scene = image[100:, :700]
            red, green, blue = scene[..., 0], scene[..., 1], scene[..., 2]
            antagonist = ((red > 150) & (red > green + 70) & (red > blue + 70)).sum()
            protagonist = ((blue > 120) & (blue > red + 60)).sum()
            return bool(antagonist > 300 and protagonist > 300)

        assert browser.wait_until(both_are_there, timeout=150.0)
    finally:
        shower.stdin.close()
        shower.wait(20)
        shower.stdout.close()
    assert (tmp_path / "run" / "recording.rrd").stat().st_size > 10_000
