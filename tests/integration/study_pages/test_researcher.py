"""The researcher's page in a real browser, with the real server. Needs Chromium."""

import msgspec
import pytest

from services.study.view import GateView, HeartView, Reply, ServiceView, TrackerView
from tests.integration.page.browsing import find_chromium
from tests.integration.study_pages.rig import Opener, Runner, Visit
from tests.integration.study_pages.views import researcher

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_chromium() is None, reason="no Chromium: apt install chromium"),
]


@pytest.fixture
def visit(opened: Opener) -> Visit:
    return opened(is_researcher=True)


def test_the_whole_session_and_what_happens_in_it_is_shown(visit: Visit, runner: Runner):
    text = visit.text()
    for words in (
        "Competitive games with a robot", "sub-04", "running", "22 of 54 steps done",
        "Section 2, game 3 of 5", "condition B", "13", "214", "2.84 s", "Rest (rest",
        "ARMED", "131", "136 % of walking", "sees the bat", "100.0 ticks a second",
        "the tracker was lost for 1.2 s", "Says the bat is light.",
    ):  # fmt: skip
        assert words in text, words
    plan = visit.page.locator("#plan i")
    assert plan.count() == len(runner.researcher.steps)
    assert visit.page.locator("#plan .done").count() == runner.researcher.at
    assert visit.page.locator("#spark polyline").count() == 2  # a gap where nothing was measured
    assert visit.page.locator("#history tr").count() == 8
    assert visit.errors == []


def test_what_is_wrong_is_loud(visit: Visit, runner: Runner):
    runner.change(
        warnings=("The robot has stopped.",),
        gate=GateView(mode="tripped", reason="tool at 3.2 m/s", in_the_way=("the tool moves",)),
        tracker=TrackerView(is_tracked=False, lost_seconds=4.0),
        heart=HeartView(beats_per_minute=150.0, has_contact=False),
        services=(ServiceView(name="recorder", is_alive=False),),
        is_participant_here=False,
    )
    visit.until("study.view().warnings.length")
    assert visit.text("#warnings") == "The robot has stopped."
    assert visit.page.title().startswith("⚠")
    for words in (
        "tool at 3.2 m/s", "the tool moves", "lost for 4 s", "no contact with the skin",
        "not there", "NO PARTICIPANT'S PAGE IS OPEN",
    ):  # fmt: skip
        assert words in visit.text(), words


def test_only_what_may_be_done_can_be_clicked(visit: Visit, runner: Runner):
    steers = ("begin", "next", "pause", "resume", "void", "repeat", "abort")
    gate = ("arm", "disarm", "reset")
    for mode, may, shown in (
        (
            "armed",
            {"pause", "disarm", "abort", "void", "arm"},
            {"pause", "disarm", "abort", "void"},
        ),
        ("disarmed", {"begin", "arm", "next", "reset"}, {"begin", "arm", "next"}),
        ("tripped", {"resume", "arm", "reset"}, {"resume", "reset"}),
        ("holding", set[str](), set[str]()),
    ):
        runner.change(may=tuple(may), gate=GateView(mode=mode))
        visit.until(f"study.view().gate.mode === '{mode}'")
        assert {action for action in (*steers, *gate) if visit.is_on(f"#{action}")} == shown


def test_a_game_that_is_over_is_voided_in_the_list_alone(visit: Visit, runner: Runner):
    bout = runner.researcher.bout
    assert bout is not None
    runner.change(bout=msgspec.structs.replace(bout, phase="finished"))
    visit.until("study.view().bout.phase === 'finished'")
    assert visit.page.is_hidden("#void")
    assert visit.page.is_hidden("#repeat")
    assert visit.page.locator("#history button:has-text('void')").count() == 7


def test_a_step_is_skipped_for_a_reason(visit: Visit, runner: Runner):
    runner.change(may=("next",), course="running")
    visit.page.click("#next")
    visit.page.fill("#reason", "the participant cannot walk")
    visit.page.click("#dialog-yes")
    ask = runner.wanted()
    assert (ask.action, ask.step, ask.reason) == ("next", "s2-g03", "the participant cannot walk")


def test_a_click_says_which_step_it_is_about_and_twice_is_once(visit: Visit, runner: Runner):
    visit.page.dblclick("#pause")
    ask = runner.wanted()
    assert (ask.action, ask.step) == ("pause", "s2-g03")
    assert "Asked: pause" in visit.text("#said")
    runner.answer(ask)
    visit.until("document.getElementById('said').textContent === 'Done: pause.'")
    visit.page.click("#pause")
    again = runner.wanted()
    assert again.id != ask.id
    runner.answer(again, "it is paused already")
    visit.until("document.getElementById('said').textContent.includes('paused already')")


def test_arming_takes_a_click_and_no_later_key(visit: Visit, runner: Runner):
    runner.change(may=("arm",), gate=GateView(mode="disarmed"))
    visit.until("study.view().gate.mode === 'disarmed'")
    visit.page.click("#arm")
    ask = runner.wanted()
    assert ask.action == "arm"
    runner.answer(ask, "the bat is not tracked")
    visit.until("study.waiting() === 0")
    for key in ("Enter", "Space"):
        visit.page.keyboard.press(key)
    visit.page.wait_for_timeout(200)
    runner.listen()
    assert runner.asked == []


def test_a_game_is_voided_for_a_reason_or_not_at_all(visit: Visit, runner: Runner):
    visit.page.click("#history tr:nth-child(4) button:has-text('repeat')")
    assert "Repeat game s1-g04, attempt 2?" in visit.text("#dialog")
    assert not visit.is_on("#dialog-yes")
    visit.page.keyboard.press("Escape")
    visit.page.click("#void")
    visit.page.fill("#reason", "  ")
    assert not visit.is_on("#dialog-yes")
    visit.page.click("#dialog-no")
    visit.page.click("#history tr:nth-child(4) button:has-text('void')")
    visit.page.fill("#reason", "stepped over the line")
    visit.page.click("#dialog-yes")
    ask = runner.wanted()
    assert (ask.action, ask.step, ask.attempt) == ("void", "s1-g04", 2)
    assert ask.reason == "stepped over the line"
    runner.answer(ask)
    visit.page.click("#abort")
    visit.page.fill("#reason", "the participant wants to stop")
    visit.page.click("#dialog-yes")
    ask = runner.wanted()
    assert (ask.action, ask.step, ask.reason) == (
        "abort", "s2-g03", "the participant wants to stop",
    )  # fmt: skip


def test_a_note_is_kept_until_it_has_arrived(visit: Visit, runner: Runner):
    runner.web.close()
    visit.until("study.state() === 'lost'")
    visit.page.fill("#note-text", "smiled <b>a lot</b>")
    visit.page.keyboard.press("Enter")
    visit.page.wait_for_timeout(100)
    runner.start(port=runner.web.port)
    ask = runner.wanted()
    assert (ask.action, ask.text, ask.step) == ("note", "smiled <b>a lot</b>", "s2-g03")
    runner.asks.answer(Reply(id=ask.id, is_done=True))
    visit.until("study.waiting() === 0")


def test_without_a_connection_nothing_is_steered_and_nothing_is_steered_later(
    visit: Visit, runner: Runner
):
    visit.page.click("#disarm")
    before = runner.wanted()
    runner.web.close()
    visit.until("document.getElementById('said').textContent.includes('was not answered')")
    assert "NO CONNECTION" in visit.text("#link")
    assert visit.page.title().startswith("⚠")
    visit.page.click("#pause")
    assert "was not sent" in visit.text("#said")
    runner.start(port=runner.web.port)
    visit.until("study.state() === 'open'")
    assert visit.page.is_hidden("#link")
    visit.page.wait_for_timeout(2500)  # a lasting ask would be said again by now
    runner.listen()
    assert runner.asked == []
    assert before.action == "disarm"


def test_several_researchers_see_the_same(visit: Visit, opened: Opener, runner: Runner):
    other = opened(is_researcher=True)
    runner.show(researcher=researcher(waiting_for="the participant", at="s1-g01"))
    for page in (visit, other):
        page.until("study.view().waiting_for === 'the participant'")
        assert "Waiting for the participant" in page.text("#now")


def test_the_end_of_the_session_is_shown(visit: Visit, runner: Runner):
    last = len(runner.researcher.steps)
    runner.show(
        researcher=msgspec.structs.replace(
            runner.researcher, at=last, course="ended", bout=None, seconds_left=None, may=()
        )
    )
    visit.until("study.view().course === 'ended'")
    assert "The session is over" in visit.text("#now")
    assert "54 of 54 steps done" in visit.text()
    assert visit.errors == []
