"""The game as others see it, under their own checkers."""

from collections.abc import Iterator
from pathlib import Path
from typing import get_args

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import parallel_api_test, parallel_seed_test

from shared.errors import SnapshotError
from shared.game.rules import RuleBook
from shared.sim.gymnasium_env import FencingSingleEnv, FencingVectorEnv
from shared.sim.pettingzoo_env import FencingParallelEnv
from shared.sim.task import Side, Task

SHORT = Task(rules=RuleBook(bout_steps=50))
ID = "RiposteFencing-v0"


@pytest.fixture
def registered() -> Iterator[None]:
    gymnasium.register(ID, lambda **given: FencingSingleEnv(**given))
    yield
    gymnasium.registry.pop(ID)


@pytest.mark.usefixtures("registered")
@pytest.mark.parametrize("agent", get_args(Side))
def test_gymnasiums_checker_accepts_the_single_environment(agent: Side):
    env = gymnasium.make(ID, agent=agent, render_mode="rgb_array")
    check_env(env.unwrapped)
    env.close()


def test_pettingzoos_checker_accepts_the_parallel_environment():
    parallel_api_test(FencingParallelEnv(SHORT), num_cycles=120)


def test_the_parallel_environment_repeats_itself_from_a_seed():
    parallel_seed_test(lambda: FencingParallelEnv(SHORT), num_cycles=60)


def test_a_bout_ends_by_truncation_after_its_steps():
    env = FencingSingleEnv(task=SHORT)
    env.reset(seed=1)
    ends = [env.step(env.action_space.sample())[2:4] for _ in range(50)]
    assert ends == [(False, False)] * 49 + [(False, True)]


def test_the_vector_environment_is_the_single_one_side_by_side():
    vector = FencingVectorEnv(1, "protagonist", task=SHORT)
    single = FencingSingleEnv("protagonist", task=SHORT)
    rng = np.random.default_rng(2)
    assert (vector.reset(seed=3)[0][0] == single.reset(seed=3)[0]).all()
    for step in range(50):
        action = rng.uniform(-1, 1, 6).astype(np.float32)
        obs, paid, terminated, truncated, info = vector.step(action[None])
        one = single.step(action)
        seen = info["final_obs"][0] if step == 49 else obs[0]
        assert (seen == one[0]).all()
        assert (paid[0], terminated[0], truncated[0]) == one[1:4]
    assert info["final_info"]["score"][0] == one[4]["score"]
    assert obs[0, -1] == 0.0  # the next bout has begun
    assert single.observation_space.contains(one[0])


def test_staggered_bouts_end_one_after_the_other():
    vector = FencingVectorEnv(5, task=SHORT, staggered=True)
    vector.reset(seed=0)
    ended = [vector.step(np.zeros((5, 6), np.float32))[3] for _ in range(50)]
    assert [int(ends.sum()) for ends in ended] == ([0] * 9 + [1]) * 5


def test_an_episode_wrapper_of_gymnasium_sees_whole_bouts():
    vector = gymnasium.wrappers.vector.RecordEpisodeStatistics(FencingVectorEnv(3, task=SHORT))
    vector.reset(seed=0)
    for _ in range(50):
        *_, info = vector.step(np.zeros((3, 6), np.float32))
    assert (info["episode"]["l"] == 50).all()


def test_an_opponent_is_a_function_a_reference_or_a_snapshot(tmp_path: Path):
    asked = []

    def lunge(obs: np.ndarray) -> np.ndarray:
        asked.append(obs.shape)
        return np.full((len(obs), 6), 1.0, np.float32)

    moved = {}
    for name, opponent in (("function", lunge), ("reference", "scripted:static")):
        env = FencingSingleEnv(opponent=opponent, task=SHORT)
        first, _ = env.reset(seed=5)
        for _ in range(20):
            last, *_ = env.step(np.zeros(6, np.float32))
        moved[name] = np.abs(last - first)[13:16].max()
    assert asked == [(1, 27)] * 20
    assert moved["function"] > 0.05 > moved["reference"]
    with pytest.raises(SnapshotError, match="no player 'scripted:dancer'"):
        FencingSingleEnv(opponent="scripted:dancer")
    with pytest.raises(SnapshotError, match="cannot read"):
        FencingSingleEnv(opponent=tmp_path / "missing.safetensors")


def test_the_score_alone_is_a_zero_sum_game():
    env = FencingParallelEnv(Task(shaping_weight=0.0, rules=RuleBook(bout_steps=200)))
    obs, _ = env.reset(seed=1)
    rng, seen = np.random.default_rng(1), 0.0
    while env.agents:
        # The antagonist takes its grip to the target, the protagonist moves about.
        to_target = -obs["antagonist"][:3] / 0.0375
        actions = {
            "antagonist": np.concatenate([to_target, np.zeros(3)]).astype(np.float32),
            "protagonist": rng.uniform(-1, 1, 6).astype(np.float32),
        }
        obs, rewards, *_ = env.step(actions)
        assert rewards["antagonist"] == -rewards["protagonist"]
        seen += abs(rewards["antagonist"])
    assert seen > 0.0
