"""Bouts as an actor plays them, with the bat states of every step."""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from services.actor.collector import Results
from services.actor.evaluation import Evaluation
from shared.game.rules import RuleBook
from shared.policy.action import ActionConfig
from shared.policy.observation import BAT_DIM
from shared.policy.players import scripted_player
from shared.sim.config import SimConfig
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel


@dataclasses.dataclass(frozen=True)
class RecordedBouts:
    """N bouts of T steps between two players, and what the actor says of them."""

    first: NDArray[np.float64]
    """float64[N, 2, 13], the states in which they begin; nobody judges these."""
    bats: NDArray[np.float64]
    """float64[T, N, 2, 13], those after each step."""
    results: Results


def play(
    antagonist: str, protagonist: str, rules: RuleBook, bouts: int, seed: int
) -> RecordedBouts:
    """Return bouts between two scripted players, played and judged by the actor's own code."""
    env = FencingEnv(FencingModel.build(SimConfig()), rules, ActionConfig(), bouts)
    players = (
        scripted_player(f"scripted:{antagonist}", env.arena),
        scripted_player(f"scripted:{protagonist}", env.arena),
    )
    evaluation = Evaluation(env, players, bouts, seed)

    def states() -> NDArray[np.float64]:
        return env.batch.sensors.reshape(bouts, 2, -1)[:, :, :BAT_DIM].copy()

    first = states()
    kept: list[NDArray[np.float64]] = []
    results = evaluation.advance(rules.bout_steps, lambda _: kept.append(states()))
    assert results is not None
    return RecordedBouts(first, np.stack(kept), results)
