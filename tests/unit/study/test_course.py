"""What comes next, as a function of nothing but its arguments."""

import math
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace

from services.study.course import (
    PAUSED,
    PLAYER,
    Begin,
    End,
    Finish,
    Load,
    Moment,
    Start,
    Steer,
    Terms,
    Turn,
    Wait,
    next_action,
    unnamed,
)
from services.study.hearing import Heard
from shared.messages.play import GateState, HeartRate, RefereeState
from shared.study.steps import Step

GAME = Step(
    id="s1-g02", kind="game", section=1, game=2, player="style-1", seconds=20.0, title="Game",
    is_recorded=True,
)  # fmt: skip
REST = Step(id="s1-rest-01", kind="rest", section=1, seconds=30.0, title="Rest", rest_below=120.0)
EXPLORE = Step(id="explore", kind="explore", seconds=300.0, title="Find the target")
READY = Moment(stage="ready", loaded="style-1", reference="sha256:ab")
PLAYING = Moment(stage="playing", since=10.0, bout="s1-g02-a1", is_seen=True)


def gate(mode: Any = "armed") -> GateState:
    return GateState(
        tick=1, mode=mode, reason="why", commanded=np.zeros(7), is_clipped=False, lateness_ms=0.0,
        late_ticks=0,
    )  # fmt: skip


def said(phase: Any = "ready", bout: str = "", reason: str = "") -> RefereeState:
    return RefereeState(
        bout=bout, phase=phase, reason=reason, antagonist="a", protagonist="p", tick=1, step=1,
        seconds=0.01, score=1.0, points=1.0, in_target=np.zeros(2, bool), contact=False,
        attack_steps=1, penalty_steps=0, camping_steps=0, missed_ticks=0, tone_hz=0.0,
    )  # fmt: skip


HEARD = Heard(
    gate=gate(), referee=said(), is_tracked=True, lost_seconds=0.0, has_policy=True,
    has_recorder=True,
)  # fmt: skip


def act(step: Step, moment: Moment, heard: Heard = HEARD, now: float = 11.0, **fields: Any):
    terms = fields.pop("terms", Terms())
    return next_action(step, moment, heard, now, terms, is_auto=fields.pop("is_auto", False))


def test_forms_and_rests_begin_by_themselves_and_games_when_a_person_or_the_rest_says_so():
    for kind in ("consent", "instruction", "questionnaire", "ranking", "debrief"):
        assert act(replace(GAME, kind=kind), Moment()) == Begin("form")
    assert act(REST, Moment()) == Begin("timer", 30.0)
    assert act(GAME, Moment()) == Wait("the researcher to begin 'Game'")
    assert act(GAME, Moment(), is_auto=True) == Begin("ready")
    assert act(GAME, Moment(is_asked=True)) == Begin("ready")
    baseline = replace(REST, kind="baseline", rest_below=0.0)
    assert isinstance(act(baseline, Moment()), Wait)
    assert act(baseline, Moment(is_asked=True)) == Begin("timer", 30.0)


def test_a_game_is_loaded_counted_down_and_started():
    assert act(GAME, replace(READY, loaded="style-2")) == Load("style-1")
    assert act(GAME, replace(READY, loaded="style-2", is_waiting=True)) == Wait("the policy")
    assert act(GAME, READY) == Turn("countdown", 3.0)
    counting = replace(READY, stage="countdown", until=12.0)
    assert act(GAME, counting, now=11.9) == Wait()
    assert act(GAME, counting, now=12.0) == Start()


@pytest.mark.parametrize(
    ("changed", "why"),
    [
        ({"gate": None}, "robot_io"),
        ({"referee": None}, "the referee"),
        ({"has_policy": False}, "the policy"),
        ({"has_recorder": False}, "the recorder"),
        ({"is_tracked": False}, "the participant's bat to be tracked"),
        ({"gate": gate("disarmed")}, "a person to arm the robot (disarmed: why)"),
        ({"gate": gate("tripped")}, "a person to reset and arm the robot (tripped: why)"),
        ({"gate": gate("holding")}, "the robot to go on (holding: why)"),
        ({"gate": gate("ramping")}, "the robot to be up to speed"),
    ],
)
def test_a_game_waits_for_what_it_needs_and_a_countdown_stops(changed: dict[str, Any], why: str):
    heard = replace(HEARD, **changed)
    assert act(GAME, READY, heard) == Wait(why)
    assert act(GAME, replace(READY, stage="countdown", until=12.0), heard) == Turn("ready")


def test_who_explores_needs_no_armed_robot_and_no_recorder():
    moment = Moment(stage="ready", loaded="scripted:static")
    heard = replace(HEARD, gate=gate("disarmed"), has_recorder=False)
    assert act(EXPLORE, moment, heard) == Start()
    running = replace(heard, referee=said("running", PLAYING.bout))
    assert act(EXPLORE, PLAYING, running) == Wait("")


def test_what_a_player_cannot_be_loaded_for_is_said_without_its_name():
    refused = replace(READY, loaded="", trouble="the file is gone", retry_at=12.0)
    assert act(GAME, refused) == Wait("the policy to be this section's player: the file is gone")
    names = ("style-1", "/data/league/style-1.safetensors", "scripted:guard", "")
    digest = "0123456789ab" * 5 + "0123"
    text = (
        "cannot read /data/league/style-1.safetensors; no player 'style-1'; it has style-10; "
        f"guard and scripted:guard; guarded; snapshot sha256:{digest} is not {digest[:12]}"
    )
    one = PLAYER
    assert unnamed(text, names) == (
        f"cannot read {one}; no player '{one}'; it has style-10; "
        f"{one} and {one}; guarded; snapshot {one} is not {one}"
    )


def test_a_bout_is_followed_to_its_end():
    on = replace(HEARD, referee=said("running", PLAYING.bout))
    assert act(GAME, PLAYING, on) == Wait("")
    over = said("finished", PLAYING.bout)
    assert act(GAME, PLAYING, replace(HEARD, referee=over)) == End("finished", "", over)
    void = said("void", PLAYING.bout, "bats were not tracked")
    ended = act(GAME, PLAYING, replace(HEARD, referee=void))
    assert ended == End("void", "bats were not tracked", void)


def test_a_bout_of_which_nobody_speaks_is_void():
    silent = replace(HEARD, referee=None)
    assert act(GAME, PLAYING, silent) == End("void", "the referee died")
    assert act(GAME, PLAYING, HEARD) == End("void", "the referee was restarted")
    unheard = replace(PLAYING, is_seen=False)
    assert act(GAME, unheard, HEARD, now=14.9) == Wait("the referee")
    assert act(GAME, unheard, HEARD, now=15.1).outcome == "void"


@pytest.mark.parametrize("mode", ["disarmed", "tripped"])
def test_a_bout_whose_gate_shut_is_abandoned_once_at_a_time(mode: str):
    heard = replace(HEARD, gate=gate(mode), referee=said("running", PLAYING.bout))
    assert act(GAME, PLAYING, heard) == Steer("abandon", PLAYING.bout, f"the robot is {mode}: why")
    assert act(GAME, replace(PLAYING, is_waiting=True), heard) == Wait()
    assert act(GAME, replace(PLAYING, retry_at=12.0), heard) == Wait()
    alone = replace(HEARD, has_policy=False, referee=said("running", PLAYING.bout))
    assert act(GAME, PLAYING, alone) == Steer("abandon", PLAYING.bout, "the policy died")
    silent = replace(heard, gate=None)
    assert act(GAME, PLAYING, silent) == Steer("abandon", PLAYING.bout, "robot_io is silent")


def test_a_bout_that_is_none_of_the_step_is_abandoned_at_any_stage():
    stray = replace(HEARD, referee=said("running", "page-1"))
    for moment in (Moment(), READY, replace(READY, stage="form"), Moment(is_paused=True)):
        assert isinstance(act(GAME, moment, stray), Steer)
    assert act(GAME, replace(READY, is_waiting=True), stray) == Wait("another bout to end")


def test_a_pause_stops_what_comes_next_and_the_bout_that_is_on():
    paused = replace(PLAYING, is_paused=True)
    running = replace(HEARD, referee=said("running", PLAYING.bout))
    assert act(GAME, paused, running) == Steer("pause", PLAYING.bout, PAUSED)
    held = replace(HEARD, referee=said("paused", PLAYING.bout, PAUSED))
    assert act(GAME, paused, held) == Wait("the researcher to go on")
    assert isinstance(act(GAME, PLAYING, held), Steer)
    lost = replace(HEARD, referee=said("paused", PLAYING.bout, "bats are not tracked"))
    assert act(GAME, PLAYING, lost) == Wait("bats are not tracked")
    assert act(REST, Moment(is_paused=True)) == Wait("the researcher to go on")


def test_a_rest_waits_for_the_heart_where_there_is_one():
    resting = Moment(stage="timer", until=10.0)

    def with_rate(rate: float, contact: bool = True) -> Heard:
        beat = HeartRate(at_ns=1, beats_per_minute=rate, contact=contact, source="s")
        return replace(HEARD, heart=beat)

    assert act(REST, resting, with_rate(121.0)) == Wait("a heart rate below 120 /min (now 121)")
    assert act(REST, resting, with_rate(119.0)) == Finish()
    assert act(REST, resting, with_rate(150.0, contact=False)) == Finish()
    assert act(REST, resting) == Finish()
    assert act(replace(REST, rest_below=0.0), resting, with_rate(190.0)) == Finish()
    assert act(REST, replace(resting, until=math.inf), with_rate(80.0)) == Wait()
