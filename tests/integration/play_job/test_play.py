"""A match between two policies, by the command that a person types."""

import json
import signal
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

from services import cli
from shared.runtime.logging import configure_logging
from tests.integration.play_job.playing import QUICK, onlooking, playing
from tests.integration.training.training import log_of, processes_of

pytestmark = pytest.mark.zenoh

PLAYERS = ("--antagonist", "scripted:stab", "--protagonist", "style-2")


@pytest.fixture(autouse=True)
def _own_log() -> Iterator[None]:
    yield
    configure_logging(None)


def test_two_bouts_are_fenced_scored_and_summed_up(tmp_path: Path):
    folder = tmp_path / "match"
    with playing(
        folder, *PLAYERS, "--bouts", "2", overrides=(*QUICK, "game.bout_steps=80")
    ) as match:
        code, said = match.finish()
    assert code == 0, said
    bouts = match.summary["bouts"]
    assert [bout["bout"] for bout in bouts if bout["outcome"] == "finished"] == [
        bouts[-2]["bout"], bouts[-1]["bout"],
    ]  # fmt: skip
    for bout in bouts[-2:]:
        assert bout["seconds"] == pytest.approx(0.8)
        assert bout["antagonist"] == "scripted:stab"
        assert bout["protagonist"].startswith("sha256:")
        assert f"{bout['bout']} finished, score {bout['score']:+g} after 0.8 s" in said
    assert "scripted:stab v style-2: 2 bouts" in said
    assert match.summary["loop"]["ticks"] > 100
    assert match.summary["deaths"] == []
    assert processes_of(folder) == []
    assert not (folder / "endpoint.json").exists()
    asked = [event for event in log_of(folder, "robot-io-0") if event["event"] == "gate_asked"]
    assert [event["action"] for event in asked if not event["reasons"]] == ["arm", "disarm"]


def test_ctrl_c_ends_in_order_and_a_person_reaches_the_robot_before(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    folder = tmp_path / "match"
    with playing(folder, *PLAYERS, "--bouts", "9") as match:
        with onlooking(match) as onlooker:
            onlooker.until(onlooker.is_fencing)

            assert cli.main(["robot", "check", "--run", str(folder)]) == 1
            out = capsys.readouterr().out
            assert "✓ the run stop is released" in out
            assert "✗ the gate is armed already" in out
            assert cli.main(["robot", "disarm", "--run", str(folder)]) == 0
            assert capsys.readouterr().out == "robot disarmed\n"
            onlooker.until(lambda: onlooker.phase == "void")
            assert cli.main(["robot", "reset", "--run", str(folder)]) == 1
            assert "there is nothing to reset" in capsys.readouterr().out
            assert "the robot is disarmed: disarmed by" in onlooker.referee[-1].reason
            match.until(lambda: cli.main(["robot", "arm", "--run", str(folder)]) == 0)
            onlooker.until(onlooker.is_fencing)
        match.process.send_signal(signal.SIGINT)
        code, said = match.finish()
    assert code == 130, said
    assert "ended early: stopped by Ctrl-C" in said
    reasons = [bout["reason"] for bout in match.summary["bouts"]]
    assert "the robot is disarmed: disarmed by" in reasons[0]
    assert reasons[-1] == "the match was stopped"
    assert processes_of(folder) == []
    events = [event for event in log_of(folder, "play") if "process" in event]
    started = [event["process"] for event in events if event["event"] == "process_started"]
    stopped = [event["process"] for event in events if event["event"] == "process_stopped"]
    assert started == [
        "router-0", "robot-io-0", "policy-antagonist", "policy-protagonist", "referee-0",
    ]  # fmt: skip
    assert stopped == started[::-1]
    assert {event["exit_code"] for event in events if event["event"] == "process_stopped"} == {0}


def test_without_arguments_there_is_a_page_which_the_browser_is_sent_to(tmp_path: Path):
    folder = tmp_path / "match"
    browser = tmp_path / "browser"
    browser.write_text(f'#!/bin/sh\necho "$1" > {tmp_path}/opened\n')
    browser.chmod(0o755)
    with playing(folder, environment={"BROWSER": str(browser)}) as match:
        opened = tmp_path / "opened"
        url = match.until(lambda: opened.exists() and opened.read_text().strip())
        assert f"page: {url}" in match.said
        with urllib.request.urlopen(f"{url}/", timeout=20) as answer:
            assert b"<html" in answer.read().lower()
        with urllib.request.urlopen(f"{url}/scene.json", timeout=20) as answer:
            assert "links" in json.load(answer)
        match.until(lambda: "robot disarmed: nobody has armed it" in match.said)
        match.process.send_signal(signal.SIGINT)
        code, said = match.finish()
    assert code == 0, said
    assert "mouse v style-1: no bout came to its end" in said
    assert processes_of(folder) == []
    assert not (folder / "page.json").exists()
    assert [event for event in log_of(folder, "robot-io-0") if event["event"] == "gate_asked"
            and event["action"] == "arm"] == []  # fmt: skip


def test_what_a_process_refuses_ends_the_match_in_its_words(tmp_path: Path):
    site = tmp_path / "s.toml"
    site.write_text(f'[robot_io]\ntracker = "replay"\nreplay = "{tmp_path}/none.npy"\n')
    folder = tmp_path / "match"
    with playing(folder, str(site), "--no-browser", overrides=("play.record=false",)) as match:
        code, said = match.finish()
    assert code == 2, said
    refusals = [line for line in said.splitlines() if line.startswith("riposte: play: ")]
    assert len(refusals) == 1
    assert f"cannot read the recorded bat {tmp_path}/none.npy" in refusals[0]
    assert said.splitlines()[-1] == refusals[0]
    assert "Traceback" not in said
    assert processes_of(folder) == []
    assert "robot-io-0" in match.summary["ended"]


def test_nobody_there_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert cli.main(["robot", "check", "--run", str(tmp_path)]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert f"nothing goes on in {tmp_path}" in err


@pytest.mark.slow
def test_a_match_of_whole_bouts_with_a_recorder(tmp_path: Path):
    folder = tmp_path / "match"
    words = ("--antagonist", "heuristic", "--bouts", "2", "--json")
    overrides = ("recorder.live=false", "play.rest=1.0")
    with playing(folder, *words, overrides=overrides) as match:
        code, said = match.finish(110.0)
    assert code == 0, said
    assert said.strip().splitlines()[-1].startswith("{")
    for bout in match.summary["bouts"]:
        assert bout["seconds"] == pytest.approx(20.0)
    assert (folder / "recording.rrd").stat().st_size > 0
