"""kill -9 at random moments of real training runs."""

from pathlib import Path

import numpy as np
import pytest

from tests.integration.training.killing import (
    IN_TURN,
    assert_nothing_lost_nor_counted_twice,
    assert_report_lists,
    kill_in_turn,
)
from tests.integration.training.training import finish, processes_of, training

pytestmark = [pytest.mark.chaos, pytest.mark.timeout(590)]

REAL = (
    "actor.num_envs=32",
    "actor.rollout_steps=40",
    "game.bout_steps=400",
    "learner.batch_samples=5120",
    "learner.warm_up_samples=5120",
    "learner.hidden_dims=[32,32]",
    "league.antagonist_updates=60",
    "league.protagonist_updates=60",
    "league.iterations=1",
    "league.evaluation_bouts=64",
    "league.convergence_min_updates=0",
    "train.actors=2",
)
VICTIMS = ("actor-0", "actor-1", IN_TURN, "league-0", "router-0", "recorder-0")


@pytest.mark.parametrize("seed", range(3))
def test_a_run_outlives_a_dozen_deaths(tmp_path: Path, seed: int) -> None:
    folder = tmp_path / "run"
    generator = np.random.default_rng(seed)
    victims = [str(name) for _ in range(2) for name in generator.permutation(VICTIMS)]
    with training(folder, overrides=(*REAL, f"train.seed={seed}")) as process:
        killed = kill_in_turn(folder, process, victims, generator, longest_pause=1.0)
        code, out, err = finish(process, 400)
    assert (code, err) == (0, ""), out
    assert len(killed) >= len(VICTIMS)
    assert processes_of(folder) == []
    assert_nothing_lost_nor_counted_twice(folder)
    assert_report_lists(folder, killed)
