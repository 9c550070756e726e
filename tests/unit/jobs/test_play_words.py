"""What a match and a robot look like to a person."""

import io
import json
import os
from pathlib import Path

import msgspec
import pytest
from rich.console import Console

from services.jobs.play import page as play_page
from services.jobs.play.match import BoutResult
from services.jobs.play.plan import Plan, parse, plan_of
from services.jobs.play.processes import processes
from services.jobs.play.screen import Screen, line
from services.jobs.play.summary import PlayedMatch, summary_of, summary_text, write_summary
from services.jobs.robot import command as robot
from shared.errors import ConfigError, RiposteError
from shared.messages.live import ServiceStatus
from shared.messages.play import GateReply
from shared.messages.topics import ARM, STATUS
from tests.unit.jobs.play_stage import Stage

RATES = {
    "real_time_factor": 0.998, "lateness_p50_ms": 0.13, "lateness_p99_ms": 0.35,
    "lateness_max_ms": 7.3, "command_p50_ms": 1.8, "command_p99_ms": 4.0, "command_max_ms": 5.0,
    "else": 1.0,
}  # fmt: skip
STATUS_NOW = ServiceStatus(
    role="robot-io", name="robot-io-0", boot="b", pid=1, host="h", state="armed", waiting_for="",
    waiting_seconds=0.0, rates=RATES,
    counters={"ticks": 900, "ticks_late": 3, "ticks_lost": 1, "commands_repeated": 12, "other": 5},
    cpu_seconds=1.0, rss_bytes=1, last_error="", version="0",
)  # fmt: skip
BOUT = BoutResult(
    bout="bout-1", outcome="finished", antagonist="scripted:stab", protagonist="sha256:aa",
    score=153.0, seconds=20.0, attack_steps=163, penalty_steps=1, camping_steps=0, missed_ticks=4,
)  # fmt: skip
VOID = BoutResult(
    bout="bout-2", outcome="void", antagonist="scripted:stab", protagonist="sha256:aa", score=9.0,
    seconds=1.2, attack_steps=9, penalty_steps=0, camping_steps=0, missed_ticks=0,
    reason="the robot is tripped: the run stop was pressed",
)  # fmt: skip


@pytest.fixture
def plan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Plan:
    monkeypatch.chdir(tmp_path)
    return plan_of(parse(("--antagonist", "heuristic", "--bouts", "3", "--out", "m")))


def test_a_summary_keeps_every_bout_and_counts_the_whole_ones(plan: Plan, tmp_path: Path):
    played = summary_of(plan, [BOUT, VOID], STATUS_NOW, ["referee-0 died"], "stopped by Ctrl-C")
    assert played.scores == [153.0]
    assert played.loop["command_p99_ms"] == 4.0
    assert played.loop["ticks_late"] == 3
    assert "other" not in played.loop
    write_summary(tmp_path, played)
    read = json.loads((tmp_path / "summary.json").read_bytes())
    assert read["bouts"][1]["reason"] == VOID.reason
    text = summary_text(tmp_path, played)
    assert "scripted:stab v style-1: 1 bout, +153 points for the antagonist on average" in text
    assert "void: the robot is tripped: the run stop was pressed" in text
    assert "ended early: stopped by Ctrl-C" in text
    assert (
        "real time 1.00x · late 0.13 / 0.35 / 7.3 ms · command after 1.80 / 4.00 / 5.0 ms" in text
    )
    assert "900 ticks, 3 late, 1 lost, 12 without an answer" in text
    assert "died: referee-0 died" in text
    assert "riposte watch" not in text
    (tmp_path / "recording.rrd").touch()
    assert summary_text(tmp_path, played).endswith(f"recording  riposte watch {tmp_path}")


def test_a_match_that_never_began_has_a_summary_too(plan: Plan, tmp_path: Path):
    played = summary_of(plan, [], None, [], "the router did not listen")
    assert isinstance(played, PlayedMatch)
    text = summary_text(tmp_path, played)
    assert "no bout came to its end" in text
    assert "ticks" not in text


def test_plain_lines_say_each_thing_once(plan: Plan):
    stage = Stage()
    out = io.StringIO()
    console = Console(file=out, width=200)
    with Screen(plan, stage.match, stage.play, stage.clock, console) as screen:
        stage.robot.publish(STATUS, STATUS_NOW, role="robot-io", name="robot-io-0")
        for _ in range(200):
            stage.tick()
            for text in stage.events:
                screen.say(text)
            stage.events.clear()
            screen.tick()
        assert screen.status == STATUS_NOW
    said = out.getvalue()
    assert said.count("robot armed") >= 1
    assert said.count("bout-1 running\n") == 1
    assert "bouts 0 of 2, bout-1, running, 1.0 s, score +0, robot armed" in said
    assert said.count("running, 1.0 s") == 1  # nothing new, nothing said


def test_a_terminal_shows_phase_score_gate_and_lateness(plan: Plan):
    stage = Stage().in_bout()
    stage.say("running", 42.0)
    out = io.StringIO()
    console = Console(file=out, width=120, force_terminal=True, color_system=None)
    with Screen(plan, stage.match, stage.play, stage.clock, console) as screen:
        stage.robot.publish(STATUS, STATUS_NOW, role="robot-io", name="robot-io-0")
        screen.places["page"] = "http://127.0.0.1:8765"
        stage.tick(0.3)
        screen.say("policy-protagonist died (killed by SIGKILL)")
        screen.tick()
    shown = out.getvalue()
    for words in (
        "scripted:stab v style-1", "running", "score +42", "robot armed", "real time 1.00x",
        "policy-protagonist died", "http://127.0.0.1:8765", "Ctrl-C ends",
    ):  # fmt: skip
        assert words in shown, words


@pytest.mark.parametrize("is_terminal", [True, False])
def test_what_is_heard_is_shown_as_it_is_and_never_obeyed(plan: Plan, is_terminal: bool):
    nasty = "[/x] [bus] \x1b]0;owned"
    stage = Stage().in_bout()
    stage.reason = f"gate {nasty}"
    stage.say("running", 42.0)
    stage.tick(0.3)
    assert stage.state is not None
    stage.match.referee = msgspec.structs.replace(stage.state, bout=f"bout {nasty}")
    stage.match.waits_for = f"w {nasty}"
    out = io.StringIO()
    console = Console(file=out, width=200, force_terminal=is_terminal, color_system=None)
    with Screen(plan, stage.match, stage.play, stage.clock, console) as screen:
        screen.notes = (f"note {nasty}",)
        screen.say(f"said {nasty}")
        screen.tick()
    text = out.getvalue()
    for first in ("bout", "w", "note", "said"):
        assert f"{first} [/x] [bus] ]0;owned" in text, first
    assert ("gate [/x]" in text) == is_terminal
    assert "\x1b]" not in text


def test_what_a_match_waits_for_is_in_its_line():
    stage = Stage()
    stage.obstacles = ("the run stop is pressed",)
    stage.tick(1.0)
    assert line(stage.match).endswith("waits for the robot to be armed: the run stop is pressed")


def test_the_processes_of_a_match_start_with_what_the_others_need(
    plan: Plan, monkeypatch: pytest.MonkeyPatch
):
    names = [spec.name for spec in processes(plan, "tcp/127.0.0.1:1")]
    assert names == [
        "router-0", "recorder-0", "robot-io-0", "policy-antagonist", "policy-protagonist",
        "referee-0",
    ]  # fmt: skip
    mouse = plan_of(parse(("--set", "play.record=false")))
    made = processes(mouse, "tcp/127.0.0.1:1")
    assert [spec.name for spec in made] == [
        "router-0", "robot-io-0", "policy-protagonist", "referee-0", "page-0",
    ]  # fmt: skip
    assert "services.page" in made[-1].argv


def test_the_page_is_where_its_process_says_while_it_lives(tmp_path: Path):
    assert play_page.read_page_url(tmp_path) is None
    place = tmp_path / "page.json"
    place.write_text(json.dumps({"url": "http://127.0.0.1:9", "pid": os.getpid()}))
    assert play_page.read_page_url(tmp_path) == "http://127.0.0.1:9"
    place.write_text(json.dumps({"url": "http://127.0.0.1:9", "pid": 2**22 + 1}))
    assert play_page.read_page_url(tmp_path) is None
    place.write_text("{")
    assert play_page.read_page_url(tmp_path) is None


def test_without_a_screen_no_browser_is_opened(monkeypatch: pytest.MonkeyPatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    assert not play_page.has_browser()
    monkeypatch.setenv("BROWSER", "true")
    monkeypatch.setattr(play_page.webbrowser, "get", object)
    assert play_page.has_browser()


# -- riposte robot ----------------------------------------------------------------------------


def test_a_check_is_a_list_with_ticks():
    reply = GateReply(
        accepted=False, mode="disarmed", reasons=("the run stop is pressed",),
        passed=("the motors are on", "the gate is disarmed"),
    )  # fmt: skip
    assert robot.lines("check", reply) == [
        "✓ the motors are on",
        "✓ the gate is disarmed",
        "✗ the run stop is pressed",
        "robot disarmed: 1 of 3 not in order",
    ]


def test_a_refusal_lists_what_stands_in_the_way():
    reply = GateReply(accepted=False, mode="tripped", reasons=("a", "b"))
    assert robot.lines("arm", reply) == ["robot tripped, arm refused:", "✗ a", "✗ b"]
    assert robot.lines("arm", GateReply(accepted=True, mode="ramping")) == ["robot ramping"]


def test_nobody_who_answers_is_told_with_what_to_do():
    stage = Stage()
    stage.arms.close()
    with pytest.raises(RiposteError, match=r"no robot_io answers .*start one with riposte play"):
        robot.ask(stage.play, stage.clock, "arm")
    inbox = stage.robot.answer(ARM)  # there, and says nothing

    class Passing:
        def now(self) -> float:
            stage.clock.advance(0.5)
            return stage.clock.now()

    with pytest.raises(RiposteError, match="no robot_io answers"):
        robot.ask(stage.play, Passing(), "arm")  # type: ignore[arg-type]
    inbox.close()


def test_a_match_that_goes_on_is_found_before_the_site(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError, match="nothing goes on in runs/latest"):
        robot.main(["check"])
    folder = tmp_path / "runs" / "latest-play"
    folder.mkdir(parents=True)
    (folder / "endpoint.json").write_text('{"connect": "tcp/127.0.0.1:5", "run": "play-1"}')
    found = robot._parse(["check"])
    args = robot.place(found)
    assert (args.connect, args.run_id) == (("tcp/127.0.0.1:5",), "play-1")
    found = robot._parse(["check", "--connect", "tcp/127.0.0.1:6", "--run-id", "x"])
    assert (robot.place(found).connect, robot.place(found).run_id) == (("tcp/127.0.0.1:6",), "x")
