"""The antagonist learns against a player that holds still: can it learn at all, and how soon.

The parts of a real run without its processes: the actor's ``Collector`` and the learner's
``PolicyOptimiser``, with the product's default settings, and every sample counted, those of the
normaliser's warm-up, too.
"""

import time
from typing import Any

import numpy as np

from benchmarks.rollouts import rollout_of
from services.actor.collector import Collector, Evaluation
from services.jobs.settings import Settings
from services.learner.ppo import PolicyOptimiser
from shared.messages.training import Rollout
from shared.policy.mlp import GaussianPolicy
from shared.policy.players import SnapshotPlayer, scripted_player
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel

OPPONENT = "scripted:static"
EVALUATION_BOUTS = 128


def learn(settings: Settings, seed: int, samples: int) -> dict[str, Any]:
    """Train one antagonist with at most so many samples and return how it then plays."""
    began_at = time.perf_counter()
    env = _env(settings, settings.actor.num_envs)
    league, learner = settings.league, settings.learner
    collector = Collector(
        env, 0, scripted_player(OPPONENT), settings.actor.rollout_steps, league.score_weights[0],
        league.shaping_weights[0], settings.reward, seed,
    )  # fmt: skip
    optimiser = PolicyOptimiser(learner, seed)
    used = 0
    curve: list[dict[str, float]] = []

    def gather(needed: int) -> list[Rollout]:
        """Play until there are enough samples."""
        nonlocal used
        policy = GaussianPolicy(optimiser.weights())
        rollouts: list[Rollout] = []
        while sum(rollout.rewards.size for rollout in rollouts) < needed:
            segment = collector.collect(policy)
            rollouts.append(rollout_of(segment, policy, env.model.hash, OPPONENT))
            used += segment.rewards.size
            if segment.results is not None and segment.results.complete.any():
                scores = segment.results.score[segment.results.complete]
                curve.append({"samples": used, "score": float(scores.mean())})
        return rollouts

    if learner.warm_up_samples:
        optimiser.warm_up(gather(learner.warm_up_samples))
    per_rollout = settings.actor.num_envs * settings.actor.rollout_steps
    per_update = -(-learner.batch_samples // per_rollout) * per_rollout
    updates = 0
    while used + per_update <= samples:
        optimiser.update(gather(learner.batch_samples))
        updates += 1
    trained_at = time.perf_counter()
    played = evaluate(settings, GaussianPolicy(optimiser.weights()), seed)
    return {
        "seed": seed,
        "samples": used,
        "updates": updates,
        "training_seconds": trained_at - began_at,
        **played,
        "curve": curve,
    }


def evaluate(settings: Settings, policy: GaussianPolicy, seed: int) -> dict[str, float]:
    """Return how a policy's mean actions do in whole bouts against the static player."""
    rules = settings.game
    env = _env(settings, EVALUATION_BOUTS)
    players = (SnapshotPlayer(policy, stochastic=False), scripted_player(OPPONENT))
    evaluation = Evaluation(env, players, EVALUATION_BOUTS, seed + 1_000_000)
    results = evaluation.advance(rules.bout_steps)
    assert results is not None
    in_target = (results.attack_steps + results.penalty_steps) / rules.bout_steps
    return {
        "bouts": EVALUATION_BOUTS,
        "in_target_share": float(np.mean(in_target)),
        "in_target_worst_bout": float(np.min(in_target)),
        "score": float(np.mean(results.score)),
        "camping_points": float(rules.camping_award * np.mean(results.camping_steps)),
    }


def _env(settings: Settings, num_envs: int) -> FencingEnv:
    model = FencingModel.build(settings.sim)
    return FencingEnv(model, settings.game, settings.action, num_envs)
