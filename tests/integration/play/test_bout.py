"""Live bouts between real processes over real Zenoh, from recorded bat states."""

import re
import signal
from pathlib import Path

import numpy as np
import pytest

from tests.integration.play.conftest import COUNTERS, MARGIN, STEPS, Stage
from tests.unit.policy.making import snapshot

pytestmark = pytest.mark.zenoh

PATIENT = ("referee.stale_after=10.0", "referee.void_after=30.0")
"""A busy machine may hold the publisher up; every tick it sends is judged all the same."""


def verdict(stage: Stage, bout: str) -> dict[str, float]:
    stage.until(lambda: stage.phase(bout) not in ("ready", "running"))
    state = stage.seen[-1]
    assert (state.phase, state.step, state.missed_ticks) == ("finished", STEPS + MARGIN, 0)
    return {name: getattr(state, name) for name in COUNTERS}


def test_a_recorded_bout_is_scored_live_as_the_actor_scored_it(
    stage: Stage, recorded: tuple[Path, dict[str, float]], tmp_path: Path
):
    wrong, right = (
        snapshot(agent="protagonist", **change) for change in ({"control_timestep": 0.02}, {})
    )
    for name, made in (("wrong", wrong), ("right", right)):
        (tmp_path / f"{name}.safetensors").write_bytes(made.payload)
    stage.start("referee", *PATIENT)
    offered = ", ".join(
        f'["{name}", "{tmp_path / name}.safetensors"]' for name in ("wrong", "right")
    )
    players = ('policy.protagonist="scripted:guard"', f"page.players=[{offered}]")
    stage.start("policy", *players, agent="protagonist")
    stage.publish()
    stage.until(lambda: stage.offsets)
    assert not np.any(stage.offsets[-1].offset)

    stage.begin("one")
    stage.until(lambda: np.any(stage.offsets[-1].offset))
    refused = stage.change_player(str(tmp_path / "right.safetensors"))
    assert "a bout is running" in refused.reason

    assert verdict(stage, "one") == recorded[1]
    heard = {state.tone_hz for state in stage.seen}
    assert heard == {0.0, 300.0, 440.0}
    played = [offset for offset in stage.offsets if np.any(offset.offset)]
    assert len(played) > STEPS / 2
    assert {(offset.agent, offset.snapshot) for offset in played} == {
        ("protagonist", "scripted:guard")
    }
    assert np.median([offset.took_ms for offset in played]) < 10.0

    refused = stage.change_player(str(tmp_path / "wrong.safetensors"))
    assert "its control_timestep is 0.02, this process needs 0.01" in refused.reason
    assert stage.change_player(str(tmp_path / "right.safetensors")).accepted
    stage.begin("two")
    stage.until(lambda: np.any(stage.offsets[-1].offset))
    stage.until(lambda: stage.offsets[-1].snapshot == right.reference)


def test_a_killed_policy_does_not_stop_the_referee(
    stage: Stage, recorded: tuple[Path, dict[str, float]]
):
    stage.start("referee", *PATIENT)
    stage.start("policy", agent="protagonist")
    stage.publish()
    stage.until(lambda: stage.offsets)
    stage.begin("one")
    stage.until(lambda: stage.seen[-1].step > 50)
    stage.kill("policy")
    step = stage.seen[-1].step
    assert verdict(stage, "one") == recorded[1]
    assert step < STEPS
    answered = stage.offsets[-1].tick
    assert answered < stage.seen[-1].tick - 50


def test_lost_tracking_pauses_a_bout_and_good_tracking_resumes_it(stage: Stage):
    stage.start(
        "referee", "game.bout_steps=100000", "referee.stale_after=0.5", "referee.void_after=60.0"
    )
    stage.publish()
    stage.begin("one")
    stage.until(lambda: stage.seen[-1].step > 20)

    stage.send_signal("publisher", signal.SIGSTOP)
    stage.until(lambda: stage.phase() == "paused")
    paused = stage.seen[-1]
    assert "not tracked" in paused.reason
    assert paused.tone_hz == 0.0
    stage.send_signal("publisher", signal.SIGCONT)
    stage.until(lambda: stage.phase() == "running")
    stage.until(lambda: stage.seen[-1].step > paused.step + 20)


def test_tracking_lost_for_a_second_voids_a_bout(stage: Stage):
    stage.start("referee", "game.bout_steps=100000")
    stage.publish()
    stage.begin("one")
    stage.send_signal("publisher", signal.SIGSTOP)
    stage.until(lambda: stage.phase() == "void")
    assert [state.phase for state in stage.seen][-2:] == ["paused", "void"]
    found = re.search(r"bats were not tracked for ([\d.]+) s", stage.seen[-1].reason)
    assert found is not None, stage.seen[-1].reason
    assert float(found[1]) >= 1.0  # told to a tenth


def test_a_killed_referee_stops_the_policy_and_comes_back_ready(stage: Stage):
    stage.start("referee", *PATIENT)
    stage.start("policy", 'policy.protagonist="scripted:guard"', agent="protagonist")
    stage.publish()
    stage.until(lambda: stage.offsets)
    stage.begin("one")
    stage.until(lambda: np.any(stage.offsets[-1].offset))
    stage.kill("referee")
    tick = stage.offsets[-1].tick
    stage.until(lambda: stage.offsets[-1].tick > tick + 80)
    assert not np.any(stage.offsets[-1].offset)

    stage.start("referee", *PATIENT)
    stage.until(lambda: stage.phase() == "ready")
    stage.begin("two")
    stage.until(lambda: np.any(stage.offsets[-1].offset))


def test_a_policy_that_cannot_play_says_so_in_one_line_and_ends(stage: Stage, tmp_path: Path):
    (tmp_path / "x.safetensors").write_bytes(snapshot(agent="antagonist").payload)
    player = f'policy.protagonist="{tmp_path / "x.safetensors"}"'
    process = stage.start("policy", player, agent="protagonist")
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 2
    assert "its agent is antagonist, this process plays the protagonist" in errors.splitlines()[-1]
