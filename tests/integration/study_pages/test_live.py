"""`riposte study run` with every process on a real bus, led and answered in a real browser.

Needs Chromium.
"""

import time
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from services.jobs.study.hosting import read_place
from shared.bus.ports import free_port
from shared.study.events import Answered, GameEnded
from shared.study.progress import replay
from tests.integration.page.browsing import find_chromium
from tests.integration.study.running import Run, events_of, make, running
from tests.integration.study_pages.people import LEAD, TAKE_PART

pytestmark = [
    pytest.mark.zenoh,
    pytest.mark.slow,
    pytest.mark.timeout(600),
    pytest.mark.skipif(find_chromium() is None, reason="no Chromium: apt install chromium"),
]


def test_pages_that_stay_open_lead_a_session_over_the_death_of_all_its_processes(
    browser: Browser, tmp_path: Path
):
    study = make(tmp_path / "study")
    folder = study.session_folder("sub-01")
    port = free_port()
    context = browser.new_context(viewport={"width": 1280, "height": 800})
    person, researcher = context.new_page(), context.new_page()
    screens: set[str] = set()

    def walk(run: Run, until: str, seconds: float = 240.0) -> None:
        deadline = time.monotonic() + seconds
        while True:
            screens.add(person.evaluate(TAKE_PART))
            researcher.evaluate(LEAD)
            progress = replay(events_of(study))
            if until in progress.done or progress.state == "ended":
                return
            assert run.process.poll() is None, run.said
            assert time.monotonic() < deadline, (progress, researcher.inner_text("body"))
            person.wait_for_timeout(50)

    with running(study, "sub-01", "--port", str(port)) as run:
        deadline = time.monotonic() + 120.0
        while (place := read_place(folder)) is None:
            assert time.monotonic() < deadline, run.said
            time.sleep(0.05)
        person.goto(place.participant)
        researcher.goto(place.researcher)
        walk(run, "s1-g01")
        run.kill()
    person.wait_for_function("() => study.state() === 'lost'")
    assert "NO CONNECTION" in researcher.inner_text("#link")
    with running(study, "sub-01", "--port", str(port)) as run:
        walk(run, "")
        person.wait_for_function("() => study.view().screen === 'thanks'")
        code, said = run.finish()
    assert code == 0, said
    events = events_of(study)
    finished = [e.step for e in events if isinstance(e.what, GameEnded)
                and e.what.outcome == "finished"]  # fmt: skip
    assert finished == ["warm-up-1", "s1-g01", "s1-g02", "s2-g01", "s2-g02"]
    answers = [e.what.answers["fun"].value for e in events if isinstance(e.what, Answered)]
    assert answers == [4, 4]
    assert screens >= {"consent", "text", "countdown", "playing", "score", "rest", "questionnaire"}
    context.close()
