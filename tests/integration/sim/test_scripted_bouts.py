"""The scripted players in real bouts: who scores, who holds whom, who camps."""

import functools
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from safetensors.numpy import load, save

from services.actor.collector import Collector
from services.actor.evaluation import Evaluation
from shared.game.reward import RewardConfig
from shared.game.rules import RuleBook
from shared.policy.action import ActionConfig
from shared.policy.mlp import GaussianPolicy
from shared.policy.players import SCRIPTED_PLAYERS, Player, scripted_player
from shared.policy.scripted.blades import turned, unit
from shared.policy.scripted.sight import OWN, Sight
from shared.policy.scripted.tracking import track
from shared.sim.config import SimConfig
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel
from tests.unit.policy.making import weights

WORLDS = 5
BOUT_STEPS = 600
PEOPLE = ("person-novice", "person-steady", "person-adaptive")
ANTAGONISTS = ("stab", "slash", *PEOPLE)


@functools.cache
def model(arm: Any = "right") -> FencingModel:
    return FencingModel.build(SimConfig(arms=(arm, arm)))


def worlds(num_envs: int = WORLDS, rules: RuleBook | None = None, arm: Any = "right") -> FencingEnv:
    rules = rules or RuleBook(bout_steps=BOUT_STEPS)
    return FencingEnv(model(arm), rules, ActionConfig(), num_envs)


@functools.cache
def scores(antagonist: str, protagonist: str, camping: Any = "every_step") -> dict[str, float]:
    """Means over a few bouts of 6 s."""
    env = worlds(rules=RuleBook(bout_steps=BOUT_STEPS, camping=camping))
    players = (named(antagonist), named(protagonist))
    results = Evaluation(env, players, WORLDS, seed=3).advance(BOUT_STEPS)
    assert results is not None
    return {
        "score": float(results.score.mean()),
        "camping": float(results.camping_steps.mean()),
        "penalties": float(results.penalty_steps.mean()),
    }


def named(name: str) -> Player:
    return scripted_player(f"scripted:{name}")


@pytest.mark.parametrize("antagonist", ANTAGONISTS)
def test_every_antagonist_scores_against_one_who_holds_still(antagonist: str):
    assert scores(antagonist, "static")["score"] > 0.4 * BOUT_STEPS


@pytest.mark.parametrize("antagonist", ANTAGONISTS)
def test_the_guard_lowers_every_antagonists_score_without_camping(antagonist: str):
    held = scores(antagonist, "guard")
    assert held["score"] < 0.5 * scores(antagonist, "static")["score"]
    assert held["penalties"] > 0
    assert held["camping"] == 0


@pytest.mark.parametrize("name", ["heuristic", "heuristic-printed"])
@pytest.mark.parametrize("antagonist", ["stab", "slash"])
def test_the_papers_heuristic_lowers_the_score_where_camping_is_paid_as_in_its_prose(
    antagonist: str, name: str
):
    free = scores(antagonist, "static", "once")["score"]
    assert scores(antagonist, name, "once")["score"] < 0.7 * free


def test_the_papers_heuristic_camps_and_the_retreating_one_hardly_does():
    """It goes to the point of the opponent's bat nearest to the target: into the target."""
    assert scores("stab", "heuristic")["camping"] > 0.3 * BOUT_STEPS
    assert scores("stab", "heuristic-retreating")["camping"] < 0.02 * BOUT_STEPS
    assert scores("stab", "heuristic-retreating")["score"] < scores("stab", "static")["score"]


@pytest.mark.parametrize("arm", ["right", "left"])
@pytest.mark.parametrize("side", [0, 1])
def test_a_pose_in_the_arena_frame_is_the_pose_that_the_servo_is_commanded(side: int, arm: Any):
    """Arena and torso frame have the same axes, and a turn of the bat is that turn of the tool."""
    env = worlds(4, arm=arm)
    generator = np.random.default_rng(8)
    env.reset(np.arange(4), generator)
    obs = (np.empty((4, 27), np.float32), np.empty((4, 27), np.float32))
    env.observe(*obs)
    sight = Sight.of(obs[side])
    grips = sight.grips[:, OWN] + generator.uniform(-0.02, 0.02, (3, 4))
    blades = turned(sight.blades[:, OWN], 0.03 * unit(generator.normal(size=(3, 4))))
    actions = [np.zeros((4, 6), np.float32), np.zeros((4, 6), np.float32)]
    actions[side] = track(sight, grips, blades, env.arena, damping=0.0)
    env.step(*actions)

    commands = env.batch.ctrl[:, 7 * side : 7 * side + 7]
    yaw = env.model.base_yaw[side]
    heading = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    angle = env.model.parameters.bat.mount_angle
    for world, command in enumerate(commands):
        in_world = env.model.base_position[side] + heading @ command[:3]
        in_arena = heading.T @ (in_world - env.model.target_centre)
        np.testing.assert_allclose(in_arena, grips[:, world], atol=1e-6)
        w, x, y, z = command[3:] / np.linalg.norm(command[3:])
        tool = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        blade = tool @ np.array([np.cos(angle), 0.0, np.sin(angle)])
        np.testing.assert_allclose(blade, blades[:, world], atol=1e-6)


def test_a_tracked_pose_is_reached():
    env = worlds(4)
    env.reset(np.arange(4), np.random.default_rng(1))
    obs = (np.empty((4, 27), np.float32), np.empty((4, 27), np.float32))
    still = np.zeros((4, 6), np.float32)
    blades = np.tile(unit(np.array([[0.75], [0.5], [0.43]])), 4)
    for _ in range(150):
        env.observe(*obs)
        env.step(track(Sight.of(obs[0]), -0.62 * blades, blades, env.arena), still)
    env.observe(*obs)
    sight = Sight.of(obs[0])
    np.testing.assert_allclose(sight.grips[:, OWN], -0.62 * blades, atol=0.01)
    np.testing.assert_allclose(sight.blades[:, OWN], blades, atol=0.01)


def test_a_wider_bound_moves_the_command_that_much_farther_and_the_other_sides_not_at_all():
    commands: list[NDArray[np.float64]] = []
    for scales in ((1.0, 1.0), (4.0, 1.0)):
        env = worlds(1)
        env.reset(np.arange(1), np.random.default_rng(0))
        env.offset_scales = scales
        tools = env.batch.sensors.reshape(2, 20)[:, 13:16].copy()
        pull = np.array([[0.0, 3.0, 4.0, 0.0, 0.0, 0.0]], np.float32)  # shortened to the bound
        env.step(pull, pull)
        commands.append(env.batch.ctrl.reshape(2, 7)[:, :3] - tools)
    bound = ActionConfig().offset_bound_m * np.array([0.0, 0.6, 0.8])
    np.testing.assert_allclose(commands[0], [bound, bound], atol=1e-12)
    np.testing.assert_allclose(commands[1], [4.0 * bound, bound], atol=1e-12)


def test_people_move_faster_than_the_bound_of_the_trained_antagonist_allows():
    """The same attack by the same person, with and without the wider bound."""
    speeds: list[float] = []
    for is_wide in (False, True):
        env = worlds()
        player = named("person-adaptive")
        env.reset(np.arange(WORLDS), np.random.default_rng(2))
        env.offset_scales = (player.offset_scale, 1.0) if is_wide else (1.0, 1.0)
        obs = (np.empty((WORLDS, 27), np.float32), np.empty((WORLDS, 27), np.float32))
        generator = np.random.default_rng(4)
        fastest = np.zeros(WORLDS)
        for _ in range(150):
            env.observe(*obs)
            speed = np.linalg.norm(Sight.of(obs[0]).velocities[:, OWN], axis=0)
            fastest = np.maximum(fastest, speed)
            env.step(player.act(obs[0], generator), np.zeros((WORLDS, 6), np.float32))
        speeds.append(float(fastest.mean()))
    assert speeds[1] > 1.15 * speeds[0]


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("name", [n for n in SCRIPTED_PLAYERS if n != "static"])
def test_training_against_a_player_with_a_memory_continues_bit_for_bit(name: str, side: int):
    """Through the file format of a cut, into worlds and a player that have done other things."""
    policy = GaussianPolicy(weights(seed=3))
    rules = RuleBook(bout_steps=80, camping_steps=10)

    def collector(seed: int) -> Collector:
        env = worlds(3, rules)
        opponent = scripted_player(f"scripted:{name}", env.arena)
        return Collector(env, side, opponent, 20, 1.0, 0.4, RewardConfig(), seed)

    one, other = collector(seed=7), collector(seed=99)
    for _ in range(3):
        one.collect(policy)
    other.collect(policy)
    arrays, values = one.state()
    other.restore(load(save(arrays)), values)
    for _ in range(5):
        mine, its = one.collect(policy), other.collect(policy)
        assert mine.obs.tobytes() == its.obs.tobytes()
        assert mine.rewards.tobytes() == its.rewards.tobytes()


def test_a_player_knows_the_arena_that_it_plays_in():
    env = FencingEnv(
        FencingModel.build(SimConfig(target_radius=0.31)),
        RuleBook(),
        ActionConfig(offset_bound_m=0.05, offset_bound_rad=0.1),
        1,
    )
    assert env.arena.target_radius == 0.31
    assert env.arena.offset_bound_m == 0.05
    assert env.arena.offset_bound_rad == 0.1
    assert env.arena.control_timestep == 0.01
    assert env.arena.bat == env.scores.bat
