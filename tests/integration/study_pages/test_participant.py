"""The participant's page in a real browser, with the real server. Needs Chromium."""

import msgspec
import pytest

from services.study.forms import lacks_of
from services.study.view import Item
from tests.integration.page.browsing import find_chromium
from tests.integration.study_pages.rig import Opener, Runner
from tests.integration.study_pages.views import (
    OPEN,
    SESSION,
    TEXT,
    form,
    participant,
    points,
    screens,
)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_chromium() is None, reason="no Chromium: apt install chromium"),
]

SHOWN = {
    "welcome": ("Competitive games with a robot",),
    "consent": ("Consent", "You may rest, or stop for good", "I agree", "name is not asked for"),
    "instruction": ("The game", "Stay behind the safety line", "Continue"),
    "baseline": ("Sit down", "2:15"),
    "countdown": ("Get ready", "3", "High tone", "Low tone", "Game 3 of 5"),
    "warm-up": ("does not count",),
    "playing": ("13", "Score", "214", "High tone"),
    "exploring": ("Find the target", "The robot does not defend", "4:02", "High tone"),
    "playing-hidden": ("8", "Time left"),
    "score": ("Your score", "383"),
    "rest": ("Rest", "22", "I am ready"),
    "adjectives": ("Intimidating", "Others (please describe)", "Send answers"),
    "opinion": ("Strongly Disagree", "Neutral", "entertaining", "Send answers"),
    "opinion-paged": ("Question 1 of 7", "Next"),
    "ranking": ("least enjoyable", "most difficult", "Section 4", "may share a place"),
    "open": ("anything you would like to change", "optional"),
    "about-you": ("How old are you", "I would rather not say"),
    "waiting": ("One moment, please",),
    "paused": ("Paused", "lower your bat"),
    "debrief": ("Thank you", "That was the last question", "Done"),
    "thanks": ("Thank you!", "The study is over"),
    "german": ("Stimme voll zu", "freiwillig", "Antworten senden", "Abschnitt 2 von 4"),
}


def test_every_screen_says_what_it_has_to(opened: Opener):
    views = screens()
    assert set(SHOWN) == set(views)
    visit = opened()
    for name, view in views.items():
        text = visit.shows(view).text()
        for words in SHOWN[name]:
            assert words in text, (name, words)
        score = visit.page.is_visible(".score")
        assert score == (name == "playing"), name
        for step in view.items:
            assert step.text in text or view.is_paged, name
    assert visit.page.get_attribute("html", "lang") == "de"
    assert visit.errors == []


def test_what_counts_down_is_followed_without_building_the_screen_anew(opened: Opener):
    visit = opened()
    visit.shows(participant("rest", seconds=30.0, seconds_left=30.0))
    visit.page.evaluate("window.before = document.querySelector('.ring')")
    visit.shows(participant("rest", seconds=30.0, seconds_left=3.1))
    assert visit.text(".digits") == "4"
    assert visit.page.evaluate("before === document.querySelector('.ring')")
    assert visit.page.is_hidden("#button")


def test_consent_has_to_be_read_to_its_end_and_every_statement_ticked(
    opened: Opener, runner: Runner
):
    visit = opened().shows(screens()["consent"])
    ticks = visit.page.locator(".tick input")
    assert ticks.count() == 3
    assert not ticks.first.is_enabled()
    assert not visit.is_on("#button")
    assert visit.page.locator("input:not([type=checkbox]), textarea").count() == 0  # no name
    visit.page.evaluate("document.querySelector('.paper').scrollTo(0, 1e6)")
    visit.until("!document.querySelector('.tick input').disabled")
    for k in range(3):
        assert not visit.is_on("#button")
        ticks.nth(k).check()
    visit.page.click("#button")
    ask = runner.said()
    assert (ask.action, ask.step, ask.answers) == ("consent", "consent", ())


def test_what_was_filled_in_outlives_a_reload(opened: Opener, runner: Runner):
    view = form(points("PU"), Item(id="adj", text="Which?", scale="choices", is_several=True,
                                   options=("Joyful", "Boring"), other="Boring"), OPEN)  # fmt: skip
    visit = opened().shows(view)
    visit.page.click("[data-item=PU] label >> nth=3")
    visit.page.click("text=Boring")
    visit.page.fill("[data-item=adj] textarea", "too long")
    visit.page.fill("[data-item=why] textarea", "a <b>robot</b> & ünïcode")
    visit.reload()
    visit.page.click("text=Send answers")
    ask = runner.said()
    assert [(each.item, each.value, each.choices, each.text) for each in ask.answers] == [
        ("PU", 4, (), ""),
        ("adj", None, ("Boring",), "too long"),
        ("why", None, (), "a <b>robot</b> & ünïcode"),
    ]
    assert lacks_of(view.items, ask.answers) == []


def test_what_another_person_typed_is_not_shown_and_not_sent(opened: Opener, runner: Runner):
    visit = opened().shows(form(points("PU"), OPEN))
    visit.page.fill("textarea", "mine")
    runner.web.close()
    visit.until("study.state() === 'lost'")
    visit.page.click("[data-item=PU] label >> nth=0")
    visit.page.click("text=Send answers")
    visit.until("document.getElementById('status').textContent.includes('kept')")
    runner.start(port=runner.web.port)
    other = msgspec.structs.replace(form(points("PU"), OPEN), session="another")
    assert other.session != SESSION
    visit.shows(other)
    assert visit.page.input_value("textarea") == ""
    assert visit.page.locator(":checked").count() == 0
    visit.until("study.waiting() === 0")
    assert runner.asked == []


def test_half_an_emoji_does_not_hold_up_an_answer(opened: Opener, runner: Runner):
    visit = opened().shows(form(points("PU", is_required=False), OPEN))
    visit.page.evaluate(
        """() => {
          const area = document.querySelector("textarea");
          area.value = "fun \\u{1F600}" + "\\u{1F600}".slice(0, 1);
          area.dispatchEvent(new Event("input"));
        }"""
    )
    visit.page.click("text=Send answers")
    assert runner.said().answers[1].text == "fun \N{GRINNING FACE}"


def test_a_questionnaire_is_filled_in_with_the_keyboard_alone(opened: Opener, runner: Runner):
    visit = opened().shows(form(points("A"), points("B"), OPEN))
    keys = visit.page.keyboard
    for key in ("Tab", "5", "Tab", "3", "ArrowLeft", "Tab"):
        keys.press(key)
    keys.type("because 4")
    for key in ("Tab", "Enter"):
        keys.press(key)
    values = [(each.value, each.text) for each in runner.said().answers]
    assert values == [(5, ""), (2, ""), (None, "because 4")]


def test_a_questionnaire_is_filled_in_with_the_finger(opened: Opener, runner: Runner):
    visit = opened(has_touch=True).shows(screens()["opinion-paged"])
    for k in range(7):
        assert f"Question {k + 1} of 7" in visit.text()
        visit.page.tap(f".question:not([hidden]) label >> nth={k % 5}")
        visit.page.tap(".form .main")
    assert [each.value for each in runner.said().answers] == [1, 2, 3, 4, 5, 1, 2]


def test_a_free_answer_can_be_taken_back(opened: Opener, runner: Runner):
    visit = opened().shows(form(points("A", is_required=False), points("B")))
    for _ in range(2):
        visit.page.click("[data-item=A] label >> nth=2")
        visit.page.click("[data-item=B] label >> nth=2")
    visit.page.click("text=Send answers")
    assert [each.value for each in runner.said().answers] == [None, 3]


def test_a_missing_answer_is_marked_and_nothing_is_sent(opened: Opener, runner: Runner):
    visit = opened().shows(screens()["opinion"])
    visit.page.click("text=Send answers")
    assert visit.page.locator(".missing").count() == 7
    assert "Please answer the marked questions. (7 left)" in visit.text()
    visit.page.click("[data-item=ATT] label >> nth=2")
    assert visit.page.locator(".missing").count() == 6
    runner.listen()
    assert runner.asked == []


def test_sections_are_ranked_with_ties_and_the_order_is_said_back(opened: Opener, runner: Runner):
    view = screens()["ranking"]
    visit = opened().shows(view)
    for item, places in (("enjoyment", (4, 2, 4, 1)), ("difficulty", (1, 1, 1, 1))):
        for row, place in enumerate(places):
            visit.page.click(f"[data-item={item}] .rank >> nth={row} >> label >> nth={place - 1}")
    told = visit.text("[data-item=enjoyment] .order")
    assert told.endswith("Section 4 → Section 2 → Section 1 and Section 3 (equal)")
    visit.page.click("text=Send answers")
    ask = runner.said()
    assert ask.action == "ranking"
    assert [each.ranks for each in ask.answers] == [(3, 2, 3, 1), (1, 1, 1, 1)]
    assert lacks_of(view.items, ask.answers) == []


def test_a_refusal_is_shown_and_can_be_answered_again(opened: Opener, runner: Runner):
    visit = opened().shows(TEXT)
    visit.page.click("#button")
    first = runner.said()
    runner.answer(first, "the <i>robot</i> is not ready")
    visit.until("document.getElementById('refusal').textContent.includes('<i>robot</i>')")
    runner.asked.clear()
    visit.page.click("#button")
    assert runner.said().id != first.id


def test_the_newest_page_counts_and_the_one_before_can_take_it_back(opened: Opener):
    first, second = opened(), opened()
    first.until("study.state() === 'taken'")
    assert "open on another page" in first.text("#taken")
    first.page.click("#take")
    second.until("study.state() === 'taken'")
    first.until("study.state() === 'open'")
    assert first.page.is_hidden("#taken")


def test_a_lost_connection_is_said_and_comes_back_by_itself(opened: Opener, runner: Runner):
    visit = opened().shows(TEXT)
    runner.web.close()
    visit.until("!document.getElementById('link').hidden")
    assert "No connection" in visit.text("#link")
    runner.start(port=runner.web.port)
    visit.until("document.getElementById('link').hidden")
    visit.page.click("#button")
    assert runner.said().step == "t1"


def test_a_runner_that_stands_still_is_said(opened: Opener):
    visit = opened().shows(TEXT)
    visit.until_alone("study.state() === 'silent'")
    assert "does not respond" in visit.text("#link")
    visit.until("study.state() === 'open'")


def test_every_language_has_all_words(opened: Opener):
    visit = opened()
    words = visit.page.evaluate("import('/words.js').then((module) => module.LANGUAGES)")
    assert set(words) >= {"en", "de"}
    for said in words.values():
        assert set(said) == set(words["en"])
        assert len(said["points"]) == 5
        for key, text in said.items():
            if isinstance(text, str):
                places = [part.split("}")[0] for part in text.split("{")[1:]]
                wanted = [part.split("}")[0] for part in words["en"][key].split("{")[1:]]
                assert sorted(places) == sorted(wanted), key
