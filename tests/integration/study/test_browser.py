"""A whole session by two pages in a real browser: the command, every process, the real bus.

Halfway the command is killed, with all its processes; the pages stay open and go on.
"""

import time
from pathlib import Path

import pytest
from playwright.sync_api import Page

from services.jobs.study.hosting import read_place
from shared.study.progress import replay
from shared.study.recorded import GAMES
from shared.study.rows import GameRow
from shared.study.tsv import read_table
from tests.integration.page.browsing import find_chromium
from tests.integration.study.running import SHORT, Run, events_of, make, running
from tests.integration.study_pages.rig import chromium

pytestmark = [
    pytest.mark.zenoh,
    pytest.mark.slow,
    pytest.mark.timeout(600),
    pytest.mark.skipif(find_chromium() is None, reason="no Chromium: apt install chromium"),
]


def lead(page: Page) -> None:
    """Click what the researcher has to do now, if anything."""
    view = page.evaluate("window.study?.state() === 'open' && study.view()")
    if not view:
        return
    shut = {"disarmed": "#arm", "tripped": "#reset"}
    button = shut.get(view["gate"]["mode"]) if view["course"] == "running" else None
    button = button or ("#begin" if "begin" in view["may"] else None)
    if button and page.is_visible(button) and page.is_enabled(button):
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
    for item in view["items"]:
        place = f"[data-item={item['id']}]"
        if item["scale"] == "ranking":
            for row in range(len(item["options"])):
                page.click(f"{place} .rank >> nth={row} >> label >> nth={row}")
        else:
            page.click(f"{place} label >> nth=3")
    page.click("text=Send answers" if view["items"] else "#button")
    page.wait_for_timeout(200)


def go_on(run: Run, pages: tuple[Page, Page], is_there, seconds: float = 200.0) -> None:
    deadline = time.monotonic() + seconds
    while not is_there():
        lead(pages[0])
        take_part(pages[1])
        pages[0].wait_for_timeout(100)
        assert run.process.poll() is None, run.said
        said = [page.inner_text("body")[:600] for page in pages]
        assert time.monotonic() < deadline, (said, run.said[-1000:])


def test_a_session_is_led_and_taken_part_in_by_pages_that_outlive_a_killed_runner(tmp_path: Path):
    study = make(tmp_path / "study", SHORT)
    folder = study.session_folder("sub-01")
    with chromium() as browser:
        pages = (browser.new_page(), browser.new_page())
        for page in pages:
            page.set_default_timeout(20_000)
        with running(study, "sub-01") as run:
            while (place := read_place(folder)) is None:
                time.sleep(0.05)
                assert run.process.poll() is None, run.said
            pages[0].goto(place.researcher)
            pages[1].goto(place.participant)
            go_on(run, pages, lambda: "s1-q-mood" in replay(events_of(study)).done)
            run.kill()
        with running(
            study, "sub-01", "--port", place.researcher.split(":")[2].split("/")[0]
        ) as run:
            go_on(run, pages, lambda: replay(events_of(study)).state == "ended")
            pages[1].wait_for_function("study.view().screen === 'thanks'", timeout=4000)
            code, said = run.finish()
    assert code == 0, said
    rows = [row for row in read_table(folder / GAMES, GameRow) if row.outcome == "finished"]
    assert len(rows) == 5
    progress = replay(events_of(study))
    assert progress.answers["s1-q-mood"].answers["fun"].value == 4
    assert progress.rankings["s2-r-comparison"].ranks == {"difficulty": {1: 1, 2: 2}}
