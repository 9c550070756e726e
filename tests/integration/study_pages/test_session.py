"""A whole session through both pages: real browser, server, study service, referee and journal.

The bus is the one in memory and time runs fast; who fences is scripted. The runner is killed and
the pages are reloaded on the way. Needs Chromium.
"""

from pathlib import Path

import pytest
from playwright.sync_api import Browser

from services.study.config import StudyConfig
from services.study.course import Terms
from services.study.opening import plan_of
from services.study.service import Study, asks_of
from services.study.web import Web
from shared.study.events import Answered, Consented, GameEnded, Ranked
from shared.study.journal import Journal, read_journal
from shared.study.progress import replay
from tests.integration.page.browsing import find_chromium
from tests.integration.study_pages.people import LEAD, TAKE_PART
from tests.integration.study_pages.rig import TOKEN
from tests.unit.study.runner_stand import Stand

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_chromium() is None, reason="no Chromium: apt install chromium"),
]


class Lab(Stand):
    """Everybody of a session, with the real pages."""

    web: Web | None = None

    def start_study(self) -> None:
        self.journal = Journal(self.session_folder, self.clock)
        self.asks = asks_of(self.journal)
        port = self.web.port if self.web is not None else 0
        self.web = Web("127.0.0.1", port, (), token=TOKEN, asks=self.asks)
        self.study_bus = self.hub.join("study-0")
        cfg = StudyConfig(folder=str(self.folder), participant="sub-01")
        self.study = Study(
            plan_of(self.study_folder, cfg, b"settings"), self.session_folder,
            Terms(countdown=0.5, score_seconds=0.5), self.journal, self.asks, self.web,
            lambda: None, self.study_bus, self.clock,
        )  # fmt: skip
        self.session = self.study.session

    def kill_study(self) -> None:
        super().kill_study()
        assert self.web is not None
        self.web.close()


@pytest.mark.timeout(300)
def test_a_session_is_walked_through_both_pages_over_kills_and_reloads(
    browser: Browser, tmp_path: Path
):
    lab = Lab(tmp_path / "study")
    web = lab.web
    assert web is not None
    person, researcher = browser.new_page(), browser.new_page()
    errors: list[str] = []
    for page, url in ((person, web.participant_url), (researcher, web.researcher_url)):
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(url)
    kill_in = {"consent", "s1-g01", "s1-q-mood", "s2-r-comparison", "debrief"}
    reload_in = {"instruction", "s1-q-mood", "s2-g02"}
    screens: set[str] = set()
    for _ in range(4000):
        lab.tick()
        step = lab.session.step
        name = step.id if step is not None else ""
        if lab.session.is_over:
            break
        is_on = lab.session.moment.stage in ("playing", "form")
        if name in kill_in and is_on:
            kill_in.remove(name)
            person.evaluate(TAKE_PART)  # it may be answered, or the answer is lost with the runner
            lab.kill_study()
            lab.start_study()
        elif name in reload_in and is_on:
            reload_in.remove(name)
            person.evaluate(TAKE_PART)
            person.reload()
            researcher.reload()
        screens.add(person.evaluate(TAKE_PART))
        researcher.evaluate(LEAD)
    assert not kill_in | reload_in
    lab.tick(1.0)
    events = read_journal(lab.session_folder)
    progress = replay(events)
    assert progress.state == "ended"
    assert progress.done == {step.id for step in lab.study_folder.steps_of("sub-01")}
    assert [type(event.what) for event in events].count(Consented) == 1
    (answered,) = [event.what for event in events if isinstance(event.what, Answered)]
    assert answered.answers["fun"].value == 4
    (ranked,) = [event.what for event in events if isinstance(event.what, Ranked)]
    assert ranked.ranks == {"difficulty": {1: 1, 2: 2}}
    ended = [(e.step, e.what.outcome) for e in events if isinstance(e.what, GameEnded)]
    assert ended == [
        ("warm-up-1", "finished"), ("s1-g01", "void"), ("s1-g01", "finished"),
        ("s1-g02", "finished"), ("s2-g01", "finished"), ("s2-g02", "finished"),
    ]  # fmt: skip
    asks = [event.ask for event in events if event.ask]
    assert len(asks) == len(set(asks))
    assert screens >= {"welcome", "consent", "text", "playing", "questionnaire", "ranking"}
    assert errors == []
    for page in (person, researcher):
        page.close()
    lab.study.close()
    web.close()
