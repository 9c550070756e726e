"""The session over its journal, with the real referee."""

import errno
import os
from pathlib import Path

import pytest

from services.jobs.study.rehearsal_desk import Desk
from services.study.answering import Answering
from services.study.view import Answer
from shared.errors import RiposteError, StudyError
from shared.messages.play import PlayRequest
from shared.messages.topics import BOUT
from shared.study.events import Answer as Given
from shared.study.events import Answered
from shared.study.people.population import Population, draw
from shared.study.progress import replay
from shared.study.rows import GameRow, HeartRateRow, RankingRow
from shared.study.tsv import read_table
from tests.unit.study.runner_stand import SHORT, Stand


@pytest.fixture(scope="module")
def walked(tmp_path_factory: pytest.TempPathFactory) -> Stand:
    """A session that went well, from one end to the other."""
    stand = Stand(tmp_path_factory.mktemp("walked") / "study", has_tables=True)
    stand.walk()
    stand.study.close()
    return stand


def test_a_session_is_walked_from_the_welcome_to_the_debrief(walked: Stand):
    stand = walked
    progress = replay(stand.events)
    assert progress.state == "ended"
    assert progress.done == {step.id for step in stand.study_folder.steps_of("sub-01")}
    games = read_table(stand.session_folder / "games.tsv", GameRow)
    assert [(row.section, row.game, row.outcome, row.is_recorded) for row in games] == [
        (0, 1, "finished", False),
        (1, 1, "finished", True), (1, 2, "finished", True),
        (2, 1, "finished", True), (2, 2, "finished", True),
    ]  # fmt: skip
    assert [row.policy for row in games] == [
        "scripted:guard", "scripted:guard", "scripted:guard",
        "scripted:heuristic", "scripted:heuristic",
    ]  # fmt: skip
    warm_up, *counted = games
    assert all(row.seconds == pytest.approx(1.0) and row.steps == 100 for row in counted)
    assert [row.score for row in counted] == [
        state.score for state in stand.bouts if state.phase == "finished" and state.is_recorded
    ]
    kept = ("score", "attack_steps", "penalty_steps", "camping_steps", "steps", "seconds")
    assert [getattr(warm_up, name) for name in kept] == [None] * 6
    (ranks,) = [stand.whats("ranking")[0].ranks]
    assert ranks == {"difficulty": {1: 1, 2: 2}}
    rows = read_table(stand.session_folder / "rankings.tsv", RankingRow)
    assert [(row.section, row.rank) for row in rows] == [(1, 1), (2, 2)]


def test_the_policy_changes_between_sections_only_and_nobody_plays_while_one_explores(
    walked: Stand,
):
    stand = walked
    guard, heuristic = ["scripted:guard"], ["scripted:heuristic"]
    assert stand.loaded == ["scripted:static", *3 * guard, *2 * heuristic]  # before each game
    told = {state.bout: state for state in stand.bouts if state.bout}
    explore = next(state for name, state in told.items() if name.startswith("explore"))
    assert (explore.speed, explore.is_recorded) == (0.0, False)
    assert (told["warm-up-1-a1"].speed, told["warm-up-1-a1"].is_recorded) == (0.5, False)
    assert (told["s1-g01-a1"].speed, told["s1-g01-a1"].is_recorded) == (1.0, True)
    assert told["s1-g01-a1"].antagonist == "person"


def test_the_robot_is_disarmed_once_the_session_is_over(walked: Stand):
    assert walked.mode == "disarmed"
    assert walked.gate_asks == ["check", "arm", "disarm"]


def test_the_referee_and_the_journal_tell_the_same_games(walked: Stand):
    stand = walked
    judged = {state.bout: state for state in stand.bouts if state.phase == "finished"}
    ended = stand.whats("game_ended")
    assert [event.bout for event in ended] == [name for name in judged if "-a" in name]
    for event in ended[1:]:  # of the warm-up game nothing is kept
        assert (event.score, event.steps) == (judged[event.bout].score, judged[event.bout].step)


def test_a_session_does_not_begin_before_gate_and_tracker_are_ready(tmp_path: Path):
    stand = Stand(tmp_path / "study")
    stand.is_tracked = False
    refused = stand.ask("begin")
    assert not refused.is_done
    assert refused.lines == ("waiting for the participant's bat to be tracked",)
    stand.is_robot_silent = True
    stand.tick(1.5)
    assert "waiting for robot_io" in stand.ask("begin").lines
    assert stand.events == ()
    stand.is_robot_silent, stand.is_tracked = False, True
    stand.tick(0.5)
    assert stand.ask("begin").is_done
    assert stand.gate_asks == ["check"]
    stand.tick()
    assert stand.kinds() == ["session_began", "step_began"]


@pytest.mark.slow
def test_a_game_waits_for_the_robot_to_be_armed_by_a_person(tmp_path: Path):
    stand = Stand(tmp_path / "study")
    stand.walk("s1-g01")
    stand.ask("disarm")
    stand.ask("begin")
    stand.tick(5.0)
    assert stand.session.moment.stage == "ready"
    assert stand.session.waits_for == "a person to arm the robot (disarmed)"
    assert "arm" not in stand.gate_asks[stand.gate_asks.index("disarm") :]
    stand.arm()
    stand.until(lambda: stand.session.moment.stage == "playing")


@pytest.mark.slow
def test_a_baseline_is_the_mean_of_its_window(tmp_path: Path):
    stand = Stand(tmp_path / "study")
    stand.walk("baseline-walking")
    stand.rate = 100.0
    stand.tick(3.0)
    stand.ask("begin")
    stand.rate = 110.0
    stand.walk("instruction")
    (measured,) = stand.whats("measured")
    assert measured.beats == 3
    assert measured.beats_per_minute == pytest.approx(110.0)
    assert measured.seconds == pytest.approx(3.0, abs=0.1)


def test_a_baseline_in_which_nothing_was_measured_is_begun_again_or_skipped(tmp_path: Path):
    stand = Stand(tmp_path / "study")
    stand.walk("baseline-walking")
    stand.rate = None
    stand.ask("begin")
    stand.tick(4.0)
    assert stand.session.moment.stage == "idle"
    assert "begin again, or skip it with a reason" in stand.session.waits_for
    assert stand.whats("measured") == []
    assert stand.kinds("baseline-walking") == ["step_began"]
    stand.rate = 90.0
    stand.ask("begin")
    stand.tick(4.0)
    (measured,) = stand.whats("measured")
    assert measured.beats_per_minute == pytest.approx(90.0)
    assert stand.session.step.id == "instruction"
    assert not stand.pages.researcher.warnings

    other = Stand(tmp_path / "other")
    other.walk("baseline-walking")
    other.rate = None
    other.ask("begin")
    other.tick(4.0)
    assert other.ask("next", reason="the strap is broken").is_done
    assert other.whats("measured") == []
    (done,) = [event for event in other.events if event.step == "baseline-walking"][-1:]
    assert (done.kind, done.what.reason) == ("step_done", "the strap is broken")
    other.tick(0.3)
    assert "the baseline is missing" in other.pages.researcher.warnings[0]


def test_without_a_sensor_a_baseline_ends_with_its_time(tmp_path: Path):
    stand = Stand(tmp_path / "study", has_heart_rate=False)
    stand.rate = None
    stand.walk("instruction")
    (measured,) = stand.whats("measured")
    assert (measured.beats, measured.beats_per_minute) == (0, None)
    stand.tick(0.3)
    assert "the baseline is missing" in stand.pages.researcher.warnings[0]


def test_the_people_of_a_rehearsal_skip_a_baseline_that_cannot_be_measured(tmp_path: Path):
    stand = Stand(tmp_path / "study")
    stand.walk("baseline-walking")
    stand.rate = None
    traits = draw(Population(), 1, 1)
    desk = Desk(stand.session, Answering(stand.session), stand.asks, traits, 1, stand.clock)

    def looks() -> bool:
        desk.tick()
        return stand.session.step.id == "instruction"

    stand.until(looks, 10.0)
    assert stand.whats("measured") == []


@pytest.mark.slow
def test_a_game_in_which_the_bat_is_lost_is_void_and_played_again_when_a_person_says_so(
    tmp_path: Path,
):
    stand = Stand(tmp_path / "study")
    stand.walk("s1-g02")
    stand.until(lambda: stand.session.moment.stage == "playing")
    stand.tick(0.2)
    stand.is_tracked = False
    stand.tick(1.5)
    ended = stand.whats("game_ended")[-1]
    assert (ended.bout, ended.outcome) == ("s1-g02-a1", "void")
    assert "not tracked" in ended.reason
    stand.is_tracked = True
    stand.tick(5.0)
    assert stand.session.moment.stage == "idle"
    stand.walk("s1-q-mood")
    assert [one.bout for one in stand.whats("game_ended")][-2:] == ["s1-g02-a1", "s1-g02-a2"]


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["tripped", "disarmed"])
def test_a_game_whose_gate_shuts_is_abandoned(tmp_path: Path, mode: str):
    stand = Stand(tmp_path / "study")
    stand.walk("s1-g01")
    stand.arm()
    stand.ask("begin")
    stand.until(lambda: stand.session.moment.stage == "playing")
    stand.mode = mode
    stand.tick(0.5)
    assert stand.bouts[-1].phase == "void"
    assert stand.whats("game_ended")[-1].reason == f"the robot is {mode}: "
    assert stand.session.moment.stage == "idle"


@pytest.mark.slow
def test_a_referee_that_is_restarted_loses_the_game_and_nothing_else(tmp_path: Path):
    stand = Stand(tmp_path / "study")
    stand.walk("s1-g01")
    stand.arm()
    stand.ask("begin")
    stand.until(lambda: stand.session.moment.stage == "playing")
    stand.start_referee()
    stand.tick(0.5)
    assert stand.whats("game_ended")[-1].reason == "the referee was restarted"
    stand.walk()
    assert replay(stand.events).state == "ended"


@pytest.mark.slow
def test_a_rest_ends_with_its_time_or_waits_for_the_heart(tmp_path: Path):
    stand = Stand(tmp_path / "study")
    stand.walk("s1-rest-01")
    stand.rate = 150.0
    stand.tick(4.0)
    assert stand.session.step.id == "s1-rest-01"
    assert "a heart rate below 120" in stand.session.waits_for
    stand.rate = 110.0
    stand.tick(1.5)
    assert stand.session.step.id == "s1-g02"
    stand.walk("s2-rest-01")
    assert stand.ask("next").is_done
    (done,) = [one for one in stand.events if one.kind == "step_done" and one.step == "s2-rest-01"]
    assert done.what.reason == "ended by the researcher"
    assert stand.session.step.id == "s2-g02"


def test_heart_rates_are_written_down_where_the_session_stood(walked: Stand):
    stand = walked
    rows = read_table(stand.session_folder / "hr.tsv", HeartRateRow)
    assert {row.step for row in rows} >= {"baseline-walking", "s1-rest-01", "explore"}
    assert "warm-up-1" not in {row.step for row in rows}
    playing = [row for row in rows if row.game]
    assert all(row.attempt == 1 and row.policy.startswith("scripted:") for row in playing)
    assert {row.condition for row in rows if row.section == 1} == {
        stand.study_folder.label_of("easy")
    }
    assert len({row.t_ns for row in rows}) == len(rows)


@pytest.mark.slow
def test_a_player_that_cannot_be_loaded_is_said_and_asked_for_again(tmp_path: Path):
    stand = Stand(tmp_path / "study")
    stand.walk("s2-g01")
    stand.refused_player = "scripted:heuristic"
    stand.arm()
    stand.ask("begin")
    stand.tick(3.0)
    assert "there is no such player" in stand.session.waits_for
    assert any("no such player" in text for text in stand.pages.researcher.warnings)
    stand.refused_player = ""
    stand.walk()
    assert replay(stand.events).state == "ended"


@pytest.mark.slow
def test_a_bout_that_is_none_of_the_study_is_ended(tmp_path: Path):
    stand = Stand(tmp_path / "study")
    stand.walk("instruction")
    asked = PlayRequest(action="start", bout="page-1", antagonist="person", protagonist="x")
    stand.robot.ask(BOUT, asked, 1.0)
    stand.tick(0.5)
    assert (stand.bouts[-1].bout, stand.bouts[-1].phase) == ("page-1", "void")


# -- killed ------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_game_that_ran_when_the_runner_was_killed_is_void_and_played_again(tmp_path: Path):
    stand = Stand(tmp_path / "study")
    stand.walk("s1-g02")
    stand.until(lambda: stand.session.moment.stage == "playing")
    stand.tick(0.3)
    stand.kill_study()
    stand.start_study()
    stand.tick(0.5)
    assert stand.bouts[-1].phase == "void"
    assert stand.bouts[-1].bout == "s1-g02-a1"
    ended = stand.whats("game_ended")[-1]
    assert (ended.bout, ended.outcome) == ("s1-g02-a1", "void")
    assert "killed" in ended.reason
    assert stand.session.step.id == "s1-g02"
    assert stand.session.moment.stage == "idle"
    stand.walk()
    assert [one.bout for one in stand.whats("game_ended") if "s1-g02" in one.bout] == [
        "s1-g02-a1", "s1-g02-a2",
    ]  # fmt: skip


def test_a_runner_killed_after_every_event_walks_the_same_session(tmp_path: Path, walked: Stand):
    """Games and baselines need a life of their own: they would begin anew for ever."""
    stand = Stand(tmp_path / "study")
    lives, written = 0, 0
    for _ in range(2000):
        if stand.session.is_over:
            break
        stand.tick()
        stand.help_on()
        session, step = stand.session, stand.session.step
        is_timed = step is not None and step.kind == "baseline" and session.moment.stage == "timer"
        if len(session.events) == written or session.progress.running is not None or is_timed:
            continue
        stand.kill_study()
        stand.start_study()
        written = len(stand.session.events)
        lives += 1
    assert stand.session.progress.state == "ended"
    assert lives >= 20

    def facts(one: Stand) -> list[tuple[str, str]]:
        told = ("session_resumed", "step_began")
        return [(event.kind, event.step) for event in one.events if event.kind not in told]

    assert facts(stand) == facts(walked)
    numbers = [event.number for event in stand.events]
    assert numbers == list(range(1, len(numbers) + 1))


@pytest.mark.slow
def test_answers_that_were_written_when_it_was_killed_are_not_asked_for_again(tmp_path: Path):
    stand = Stand(tmp_path / "study")
    stand.walk("s1-q-mood")
    step = stand.session.step
    stand.session.write(
        Answered(instrument="mood", answers={"fun": Given(value=2)}), step.id, "p-late"
    )
    stand.kill_study()
    stand.start_study()
    assert stand.session.step.id == "s2-g01"
    assert stand.say("answers", (Answer(item="fun", value=5),), id="p-late", step=step.id).is_done
    assert stand.whats("answers")[0].answers["fun"].value == 2


def test_an_ask_that_is_repeated_after_a_kill_is_not_done_again(tmp_path: Path):
    stand = Stand(tmp_path / "study")
    stand.walk("instruction")
    assert stand.ask("note", text="the phone rang", id="note-1").is_done
    stand.kill_study()
    stand.start_study()
    assert stand.ask("note", text="the phone rang", id="note-1").is_done
    assert len(stand.whats("note")) == 1


@pytest.mark.slow
def test_a_rest_goes_on_while_nobody_runs_the_session(tmp_path: Path):
    stand = Stand(tmp_path / "study")
    stand.walk("s2-rest-01")
    stand.kill_study()
    stand.clock.advance(10.0)
    stand.start_study()
    stand.tick(0.3)
    assert stand.session.step.id == "s2-g02"


@pytest.mark.slow
def test_a_baseline_that_was_interrupted_is_measured_anew(tmp_path: Path):
    stand = Stand(tmp_path / "study")
    stand.walk("baseline-walking")
    stand.ask("begin")
    stand.tick(1.0)
    stand.kill_study()
    stand.start_study()
    stand.tick(5.0)
    assert stand.session.moment.stage == "idle"
    stand.walk("instruction")
    assert len(stand.whats("measured")) == 1
    assert stand.whats("measured")[0].seconds == pytest.approx(3.0, abs=0.1)
    assert stand.kinds("baseline-walking").count("step_began") == 2


@pytest.mark.slow
def test_a_session_whose_protocol_was_changed_is_not_gone_on_with(tmp_path: Path):
    stand = Stand(tmp_path / "study")
    stand.walk("instruction")
    stand.kill_study()
    changed = SHORT.replace("Hit the target.", "Hit it.").encode()
    (stand.folder / "protocol.toml").write_bytes(changed)
    with pytest.raises(StudyError, match="changed after the orders were drawn"):
        Stand(stand.folder)


def test_a_full_disk_ends_the_runner_and_the_event_has_not_happened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    stand = Stand(tmp_path / "study")
    stand.walk("instruction")
    before = stand.events

    def full(*_: object) -> int:
        raise OSError(errno.ENOSPC, "no space left on device")

    monkeypatch.setattr(os, "pwrite", full)
    with pytest.raises(RiposteError, match="no space left"):
        stand.say("ready")
    monkeypatch.undo()
    assert stand.events == before
    stand.kill_study()
    stand.start_study()
    assert stand.session.step.id == "instruction"
    assert stand.say("ready").is_done
