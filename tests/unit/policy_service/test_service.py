import os
from pathlib import Path

import numpy as np
import pytest

from shared.game.rules import RuleBook
from shared.messages.training import AGENTS, OBS_DIM, Agent
from shared.policy.action import bounded_offset
from shared.policy.mlp import GaussianPolicy
from shared.policy.players import Player, SnapshotPlayer, scripted_player
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel
from tests.unit.policy.making import snapshot
from tests.unit.policy_service.driving import ACTION, SIM, Stand, en_garde, store

MADE = {agent: snapshot(agent=agent, model="0" * 64) for agent in AGENTS}


def players(name: str, agent: Agent, env: FencingEnv) -> Player:
    if name == "snapshot":
        return SnapshotPlayer(GaussianPolicy(MADE[agent].weights), stochastic=False)
    return scripted_player(name, env.arena)


@pytest.mark.parametrize(
    ("name", "agent"),
    [
        ("snapshot", "protagonist"), ("snapshot", "antagonist"), ("scripted:guard", "protagonist"),
        ("scripted:person-adaptive", "antagonist"),
    ],
)  # fmt: skip
def test_it_plays_two_bouts_as_the_simulation_does(name: str, agent: Agent, tmp_path: Path):
    """Every answer is the offset that the environment would give its servo, bout after bout."""
    store(tmp_path, *MADE.values())
    stand = Stand(tmp_path, MADE[agent].reference if name == "snapshot" else name, agent)
    env = FencingEnv(FencingModel.build(SIM), RuleBook(bout_steps=60), ACTION, 1)
    side = AGENTS.index(agent)
    player = players(name, agent, env)
    generator = np.random.default_rng(0)
    noise = np.random.default_rng(9)
    obs = [np.empty((1, OBS_DIM), np.float32) for _ in AGENTS]
    moved = 0.0
    for _ in range(2):
        stand.referee_says("finished")
        stand.send()
        assert stand.answer() is not None
        env.reset(np.arange(1), np.random.default_rng(3))
        for step in range(60):
            stand.referee_says("running")
            stand.send(env.batch.sensors.reshape(2, -1)[:, :13].copy(), 0.01 * step)
            answer = stand.answer()
            env.observe(*obs)
            actions = [noise.normal(size=(1, 6)).astype(np.float32) for _ in AGENTS]
            actions[side] = player.act(obs[side], generator)
            expected = bounded_offset(actions[side].T.astype(np.float64), ACTION)[:, 0]
            assert answer is not None
            assert (answer.agent, answer.tick, answer.boot) == (agent, stand.tick, "b")
            np.testing.assert_array_equal(answer.offset, expected * player.offset_scale)
            moved += float(np.abs(answer.offset[:3]).sum())
            env.step(*actions)
            stand.clock.advance(0.01)
    assert moved > 1.0
    assert stand.counters["answered"] == 120


@pytest.mark.parametrize("phase", ["ready", "paused", "finished", "void"])
def test_outside_a_running_bout_it_asks_for_no_offset(phase, tmp_path: Path):
    stand = Stand(tmp_path, "scripted:guard")
    stand.send()
    answer = stand.answer()
    assert answer is not None
    assert answer.offset.tolist() == [0.0] * 6
    stand.referee_says("running")
    stand.send()
    answer = stand.answer()
    assert answer is not None
    assert np.abs(answer.offset).sum() > 0.0
    stand.referee_says(phase)
    stand.send()
    answer = stand.answer()
    assert answer is not None
    assert answer.offset.tolist() == [0.0] * 6


def test_a_referee_that_falls_silent_ends_the_play(tmp_path: Path):
    stand = Stand(tmp_path, "scripted:guard")
    stand.referee_says("running")
    moved = []
    for _ in range(60):
        stand.send()
        answer = stand.answer()
        assert answer is not None
        moved.append(bool(np.any(answer.offset)))
        stand.clock.advance(0.01)
    assert moved == [True] * 51 + [False] * 9


def test_states_from_before_a_pause_ended_do_not_reach_the_player(tmp_path: Path):
    """A game time that goes back would tell the player that a bout is new."""
    stand = Stand(tmp_path, "scripted:guard")
    moved = []
    for phase, game, seen in (
        ("running", 5.0, 5.0), ("paused", 5.01, 0.0), ("running", 5.01, 0.0),
        ("running", 5.01, 5.01), ("running", 5.03, 5.01),
    ):  # fmt: skip
        stand.referee_says(phase, game)  # type: ignore[arg-type]
        stand.send(seconds=seen)
        answer = stand.answer()
        assert answer is not None
        moved.append(bool(np.any(answer.offset)))
    assert moved == [True, False, False, True, True]


def test_only_the_newest_tick_is_answered_and_the_others_are_counted(tmp_path: Path):
    stand = Stand(tmp_path, "scripted:static")
    for _ in range(5):
        stand.send()
    answer = stand.answer()
    assert answer is not None
    assert answer.tick == 5
    assert stand.counters["ticks_skipped"] == 4
    stand.send(tick=3)
    stand.send(tick=5)
    assert stand.answer() is None
    assert stand.counters["states_late"] == 2


@pytest.mark.parametrize("is_valid", [(False, True), (True, False), (False, False)])
def test_states_that_are_not_tracked_get_no_answer(is_valid, tmp_path: Path):
    stand = Stand(tmp_path, "scripted:static")
    stand.send(is_valid=is_valid)
    assert stand.answer() is None
    assert stand.counters["states_invalid"] == 1
    stand.send()
    assert stand.answer() is not None


@pytest.mark.parametrize("age", [0.11, 5.0, -0.11])
def test_states_that_are_stale_or_from_the_future_get_no_answer(age, tmp_path: Path):
    stand = Stand(tmp_path, "scripted:static")
    stand.send(age=age)
    assert stand.answer() is None
    assert stand.counters["states_stale"] == 1
    assert f"{age:.3f} s old" in stand.policy.health().last_error
    stand.send(age=0.09)
    assert stand.answer() is not None


def test_states_that_are_no_numbers_are_refused_and_counted(tmp_path: Path):
    stand = Stand(tmp_path, "scripted:static")
    for value in (np.nan, np.inf):
        bats = en_garde()
        bats[0, 9] = value
        stand.send(bats)
        assert stand.answer() is None
    assert stand.policy._bus.counters["refused_messages"] == 2
    bats = en_garde()
    bats[1, 3:7] = 0.0
    stand.send(bats)
    assert stand.answer() is None
    bats[1, 3:7] = 0.5
    bats[1, 8] = 1e200
    stand.send(bats)
    assert stand.answer() is None
    assert stand.counters["states_refused"] == 2


def test_a_player_that_answers_no_number_is_not_passed_on(tmp_path: Path):
    stand = Stand(tmp_path, "scripted:static")

    class Broken:
        offset_scale = 1.0

        def act(self, obs, generator):
            return np.full((1, 6), np.nan, np.float32)

    stand.policy._named.player.act = Broken().act  # type: ignore[method-assign]
    stand.referee_says("running")
    stand.send()
    assert stand.answer() is None
    assert stand.counters["answers_refused"] == 1


def test_players_change_between_bouts_only(tmp_path: Path):
    store(tmp_path, MADE["protagonist"])
    stand = Stand(tmp_path, "scripted:static")
    for phase in ("running", "paused"):
        stand.referee_says(phase)
        reply = stand.ask("scripted:guard")
        assert not reply.accepted
        assert reply.player == "scripted:static"
        assert f"a bout is {phase}" in reply.reason
    stand.referee_says("finished")
    assert stand.ask("scripted:guard").accepted
    reply = stand.ask(MADE["protagonist"].reference)
    assert reply.accepted
    stand.send()
    answer = stand.answer()
    assert answer is not None
    assert answer.snapshot == reply.player == MADE["protagonist"].reference
    assert (stand.counters["players_changed"], stand.counters["players_refused"]) == (2, 2)


def test_a_player_that_does_not_fit_changes_nothing(tmp_path: Path):
    path = tmp_path / "wide.safetensors"
    stand = Stand(tmp_path, "scripted:static", listed=str(path))
    path.write_bytes(snapshot(agent="protagonist", offset_bound_m=0.3).payload)
    reply = stand.ask(str(path))
    assert not reply.accepted
    assert "its offset_bound_m is 0.3, this process needs 0.0375" in reply.reason
    assert reply.player == "scripted:static"
    assert stand.policy.health().last_error == reply.reason


@pytest.mark.parametrize("is_listed", [False, True])
def test_a_player_whose_bytes_have_changed_changes_nothing(tmp_path: Path, is_listed: bool):
    made, other = MADE["protagonist"], snapshot(5, agent="protagonist")
    store(tmp_path, made)
    path = tmp_path / "snapshots" / f"{made.digest}.safetensors"
    path.write_bytes(other.payload)  # sound in itself, and somebody else
    stand = Stand(tmp_path, "scripted:static", listed=str(path) if is_listed else "")
    for text in (made.reference, str(path)) if is_listed else (made.reference,):
        reply = stand.ask(text)
        assert not reply.accepted
        assert f"its hash is {other.digest[:12]}, not {made.digest[:12]}" in reply.reason
        assert reply.player == "scripted:static"


def test_what_is_asked_for_cannot_be_told_from_what_is_not_there(tmp_path: Path):
    """Whoever is on the bus learns nothing of the files of the robot's machine."""
    store(tmp_path / "elsewhere", MADE["protagonist"])
    secret = tmp_path / "secret.safetensors"
    secret.write_bytes(MADE["protagonist"].payload)
    os.mkfifo(tmp_path / "fifo")
    stand = Stand(tmp_path / "run", "scripted:static")
    answers: set[str] = set()
    for text in (
        str(secret), str(tmp_path / "absent"), str(tmp_path / "fifo"), str(tmp_path), "/etc/passwd",
        f"{tmp_path / 'elsewhere'}:protagonist", f"{tmp_path / 'absent'}:protagonist",
        f"sha256:{'0' * 64}", MADE["protagonist"].reference, "a\0b", "", "x" * 2000,
    ):  # fmt: skip
        reply = stand.ask(text)
        assert not reply.accepted
        assert reply.player == "scripted:static"
        answers.add(reply.reason.replace(repr(text[:80]), "?"))
    (answer,) = answers
    assert answer.startswith("there is no player ? to be had over the bus: ask for scripted:NAME")


@pytest.mark.parametrize("is_by_hash", [False, True])
def test_what_the_settings_name_may_be_asked_for(tmp_path: Path, is_by_hash: bool):
    made = MADE["protagonist"]
    store(tmp_path / "elsewhere", made)
    path = tmp_path / "elsewhere" / "snapshots" / f"{made.digest}.safetensors"
    stand = Stand(tmp_path / "run", "scripted:static", listed=str(path))
    reply = stand.ask(made.reference if is_by_hash else str(path))
    assert reply.accepted, reply.reason
    assert reply.player == made.reference


def test_a_bout_left_behind_by_a_dead_referee_does_not_block_a_change(tmp_path: Path):
    stand = Stand(tmp_path, "scripted:static")
    stand.referee_says("paused")
    stand.policy.tick()
    stand.bus.roles.clear()
    assert stand.ask("scripted:guard").accepted


def test_its_health_tells_lateness_and_whom_it_waits_for(tmp_path: Path):
    stand = Stand(tmp_path, "scripted:static")
    assert "took_ms_p50" not in stand.policy.health().rates
    for late in range(100):
        stand.send(age=0.001 * (late == 99))
        stand.answer()
        stand.clock.advance(0.01)
    rates = stand.policy.health().rates
    assert rates["took_ms_p50"] == rates["took_ms_p99"] == 0.0  # this clock stands still
    assert rates["age_ms_p50"] == pytest.approx(0.0, abs=1e-3)
    assert 0.0 < rates["age_ms_p99"] <= 1.0
    assert rates["answers_per_s"] == pytest.approx(100.0, rel=0.05)
    assert stand.policy.health().waiting_for == ""
    stand.clock.advance(2.0)
    health = stand.policy.health()
    assert (health.waiting_for, health.waiting_seconds) == (
        "robot_io: bat states",
        pytest.approx(2.01),
    )
