"""What the people at the pages may ask for, and what comes of it."""

from pathlib import Path
from typing import Any

import pytest

from services.study.view import Answer
from shared.study.progress import replay
from tests.unit.study.runner_stand import Stand

pytestmark = pytest.mark.slow  # a session each


@pytest.fixture
def stand(tmp_path: Path) -> Stand:
    return Stand(tmp_path / "study")


def start_game(stand: Stand, step: str) -> None:
    stand.walk(step)
    stand.until(lambda: stand.session.moment.stage in ("idle", "playing"))
    if stand.session.moment.stage == "idle":
        stand.arm()
        stand.ask("begin")
    stand.until(lambda: stand.session.moment.stage == "playing")
    stand.tick(0.2)


@pytest.mark.parametrize(("action", "outcome"), [("void", "void"), ("repeat", "repeat")])
def test_a_game_that_is_on_is_taken_out_with_the_reason(stand: Stand, action: Any, outcome: str):
    start_game(stand, "s1-g01")
    assert "why" in stand.ask(action, reason=" ").lines[0]
    assert stand.ask(action, reason="a door slammed", seconds=1.0).is_done
    (ended,) = [one for one in stand.whats("game_ended") if one.bout == "s1-g01-a1"]
    assert (ended.outcome, ended.reason) == (outcome, "a door slammed")
    assert ended.score is not None
    assert stand.session.step.id == "s1-g01"
    assert stand.bouts[-1].phase == "void"
    stand.walk("s1-rest-01")
    assert stand.whats("game_ended")[-1].bout == "s1-g01-a2"


def test_a_game_that_is_over_is_repeated_as_the_next_attempt_or_only_taken_out(stand: Stand):
    stand.walk("s1-q-mood")
    assert stand.ask("void", step="s1-g01", attempt=1, reason="tracker slipped").is_done
    assert stand.session.step.id == "s1-q-mood"
    assert stand.ask("repeat", step="s1-g02", attempt=1, reason="phone").is_done
    assert stand.session.step.id == "s1-g02"
    assert "already" in stand.ask("repeat", step="s1-g02", attempt=1, reason="again").lines[0]
    stand.walk("s2-g01")
    outcomes = {
        step: [attempt.outcome for attempt in attempts]
        for step, attempts in replay(stand.events).games.items()
    }
    assert outcomes["s1-g01"] == ["void"]
    assert outcomes["s1-g02"] == ["repeat", "finished"]


def test_a_game_of_an_earlier_section_is_taken_out_but_not_played_again(stand: Stand):
    stand.walk("s2-rest-01")
    refused = stand.ask("repeat", step="s1-g01", attempt=1, reason="late")
    assert "section 2 has begun" in refused.lines[0]
    games = {(view.step, view.attempt): view.may for view in stand.pages.researcher.games}
    assert games["s1-g01", 1] == ("void",)
    assert games["s2-g01", 1] == ("void", "repeat")
    assert stand.ask("void", step="s1-g01", attempt=1, reason="late").is_done


def test_pause_stops_a_game_and_resume_lets_it_go_on(stand: Stand):
    start_game(stand, "s1-g01")
    assert stand.ask("pause", reason="water").is_done
    stand.tick(0.3)
    assert stand.bouts[-1].phase == "paused"
    assert stand.pages.researcher.course == "paused"
    stand.tick(3.0)
    assert stand.bouts[-1].phase == "paused"
    assert stand.ask("resume").is_done
    stand.until(lambda: "s1-g01" in stand.session.progress.done)
    assert stand.whats("game_ended")[-1].outcome == "finished"
    assert stand.kinds().count("paused") == stand.kinds().count("unpaused") == 1


def test_abort_ends_the_game_disarms_the_robot_and_can_be_gone_on_from(stand: Stand):
    start_game(stand, "s1-g01")
    assert "why" in stand.ask("abort").lines[0]
    assert stand.ask("abort", reason="feels sick").is_done
    stand.tick(0.3)
    assert stand.mode == "disarmed"
    assert stand.bouts[-1].phase == "void"
    assert stand.kinds()[-2:] == ["game_ended", "aborted"]
    assert stand.session.is_over
    assert stand.pages.participant.screen == "thanks"
    stand.kill_study()
    stand.start_study()
    stand.walk()
    assert replay(stand.events).state == "ended"


def test_only_a_person_arms_and_a_refusal_says_everything(stand: Stand):
    stand.walk("instruction")
    stand.is_tracked = False
    stand.tick(0.1)
    refused = stand.ask("arm")
    assert refused.lines == ("the other bat was not tracked within 0.1 s",)
    stand.tick(0.2)
    assert stand.pages.researcher.gate.in_the_way == refused.lines
    stand.is_tracked = True
    stand.tick(0.1)
    assert stand.ask("arm").is_done
    assert stand.ask("disarm").is_done
    assert stand.mode == "disarmed"


def test_an_ask_about_another_step_does_nothing(stand: Stand):
    stand.walk("instruction")
    assert not stand.say("ready", step="consent").is_done
    assert not stand.ask("next", step="consent").is_done
    assert not stand.ask("begin", step="explore").is_done
    assert stand.session.step.id == "instruction"


def test_answers_that_are_not_whole_are_refused_and_nothing_is_written(stand: Stand):
    stand.walk("s1-q-mood")
    before = stand.events
    assert stand.say("answers", ()).lines == ("fun has no answer",)
    assert not stand.say("answers", (Answer(item="fun", value=9),)).is_done
    assert not stand.say("ranking", ()).is_done
    assert stand.events == before


def test_a_participant_may_do_nothing_but_fill_in_what_is_asked(stand: Stand):
    stand.tick()
    assert stand.pages.participant.screen == "welcome"
    assert stand.pages.participant.may == ()
    stand.walk("consent")
    stand.tick(0.2)
    assert stand.pages.participant.may == ("consent",)
    assert stand.pages.participant.statements == ("I agree.",)
    assert "next" not in stand.pages.researcher.may
    start_game(stand, "s1-g01")
    assert (stand.pages.participant.screen, stand.pages.participant.may) == ("playing", ())
    assert stand.pages.participant.score is None
    stand.until(lambda: stand.pages.participant.screen == "score")
    assert stand.pages.participant.score == stand.whats("game_ended")[-1].score


def test_no_page_names_a_condition_or_a_player(stand: Stand):
    participant, researcher = "", ""
    for count in range(2000):
        if stand.session.is_over:
            break
        stand.tick()
        if count == 20:
            stand.policy_waits_for = "a referee for scripted:heuristic"
        stand.help_on()
        participant += repr(stand.pages.participant)
        researcher += repr(stand.pages.researcher)
    words = ("easy", "hard", "guard", "heuristic", "scripted", "sha256")
    assert not [word for word in words if word in participant]
    assert not [word for word in words if word in researcher]
    services = {each.name: each.state for each in stand.pages.researcher.services}
    assert services["policy-protagonist"] == "waits"
    assert "state='ready'" in researcher


def test_a_player_that_cannot_be_loaded_is_not_named_to_the_researcher(stand: Stand):
    stand.walk("s2-g01")
    stand.refused_player = "scripted:heuristic"
    stand.arm()
    stand.ask("begin")
    stand.tick(2.0)
    page = stand.pages.researcher
    assert page.waiting_for == (
        "the policy to be this section's player: there is no such player: 'this section's player'"
    )
    assert "heuristic" not in repr(page)
    assert "heuristic" not in repr(stand.study.health())


def test_a_step_may_be_left_early_by_the_researcher(stand: Stand):
    stand.walk("explore")
    stand.ask("begin")
    stand.until(lambda: stand.session.moment.stage == "playing")
    assert stand.ask("next", seconds=1.0).is_done
    assert stand.session.step.id == "warm-up-1"
    start_game(stand, "s1-g01")
    assert "next" not in stand.pages.researcher.may
    assert stand.ask("next").lines == ("next is not possible now",)
