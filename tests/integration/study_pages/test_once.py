"""What a person says at a page counts once and stays text, in a real browser. Needs Chromium."""

import msgspec
import pytest

from services.study.view import Item, Reply
from tests.integration.page.browsing import find_chromium
from tests.integration.study_pages.rig import Opener, Runner
from tests.integration.study_pages.views import TEXT, form, participant, points

pytestmark = pytest.mark.skipif(find_chromium() is None, reason="no Chromium: apt install chromium")


def test_a_double_click_answers_once(opened: Opener, runner: Runner):
    visit = opened().shows(TEXT)
    visit.page.dblclick("#button")
    visit.page.evaluate("for (let k = 0; k < 20; k++) document.getElementById('button').click()")
    ask = runner.said()
    assert (ask.action, ask.step) == ("ready", "t1")
    runner.answer(ask)
    visit.until("document.getElementById('status').textContent.startsWith('Thank you')")
    visit.page.evaluate("document.getElementById('button').click()")
    visit.shows(participant("waiting"))
    assert runner.asked == [ask]


def test_an_answer_under_way_outlives_a_reload_and_a_restart_and_counts_once(
    opened: Opener, runner: Runner
):
    visit = opened().shows(form(points("PU")))
    visit.page.click("[data-item=PU] label >> nth=1")
    visit.page.click("text=Send answers")
    ask = runner.said()
    visit.reload()
    visit.until("document.getElementById('status').textContent.startsWith('Sending')")
    assert not visit.is_on("[data-item=PU] input")
    assert runner.asked == [ask]
    runner.restart()  # killed before it was journalled: the page says it again
    runner.asked.clear()
    assert runner.said() == ask
    runner.asked.clear()
    runner.restart(Reply(id=ask.id, is_done=True))  # killed after that
    visit.until("study.waiting() === 0")
    visit.until("document.getElementById('status').textContent.startsWith('Thank you')")
    assert runner.asked == []


@pytest.mark.slow
def test_nothing_that_is_said_becomes_html(opened: Opener, runner: Runner):
    evil = '<img src="x" onerror="window.broken = 1"><script>window.broken = 1</script>'
    item = Item(id="e", text=evil, scale="choices", options=(evil, "b"), is_several=True, other="b")
    visit = opened()
    researcher = opened(is_researcher=True)
    for view in (
        participant("text", title=evil, text=evil),
        participant("consent", title=evil, text=evil, statements=(evil,)),
        form(item, msgspec.structs.replace(points("p"), text=evil, labels=(evil,) * 5)),
        participant("ranking", items=(
            Item(id="r", text=evil, scale="ranking", options=("1", evil), ends=(evil, evil)),
        )),
    ):  # fmt: skip
        assert evil in visit.shows(view).text()
    before = runner.researcher
    runner.change(
        study=evil, participant=evil, waiting_for=evil, warnings=(evil,),
        steps=tuple(msgspec.structs.replace(step, title=evil) for step in before.steps),
        notes=(msgspec.structs.replace(before.notes[0], text=evil),),
        games=(msgspec.structs.replace(before.games[0], reason=evil, condition=evil),),
        gate=msgspec.structs.replace(before.gate, reason=evil, in_the_way=(evil,)),
    )  # fmt: skip
    researcher.until("study.view().warnings.length === 1")
    assert evil in researcher.text("#kept")
    for page in (visit.page, researcher.page):
        assert page.evaluate("window.broken") is None
        assert page.locator("img, body script").count() == 0
    assert visit.errors == researcher.errors == []
