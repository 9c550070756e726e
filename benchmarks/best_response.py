"""A fresh antagonist learns against a player that never changes: how much can be taken off it.

The parts of a real run without its processes: the actor's ``Collector`` and the learner's
``PolicyOptimiser``, with a run's settings; every sample counts, those of the normaliser's warm-up,
too. The score it ends with is the *exploitability* of that player: the antagonist maximises it, so
the higher, the more exploitable; a learner with a budget finds a lower bound of it.
"""

import dataclasses
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.rollouts import rollout_of
from services.actor.collector import Collector
from services.actor.evaluation import Evaluation
from services.jobs.settings import Settings
from services.learner.ppo import PolicyOptimiser
from shared.messages.training import Rollout
from shared.policy.mlp import GaussianPolicy
from shared.policy.players import Player, SnapshotPlayer
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel
from shared.telemetry.intervals import mean_interval

EVALUATION_BOUTS = 128
SHAPED_SHARE = 0.5
"""Part of the budget with the reward of phase one, so that a fresh antagonist finds the target;
the rest is rewarded by the game score alone, as in phase two, so that every weakness pays."""
_OTHER_STREAM = 1_000_000
"""Added to a seed for what must not repeat the training's random numbers."""


@dataclasses.dataclass(frozen=True)
class Opponent:
    """Whom to learn against."""

    reference: str
    """Player reference, for the rollouts."""
    make: Callable[[], Player]
    """Returns a new one: players may remember their bouts."""


def learn(
    settings: Settings, opponent: Opponent, seed: int, samples: int,
    shaped_share: float = SHAPED_SHARE,
) -> dict[str, Any]:  # fmt: skip
    """Train one antagonist with at most so many samples and return how it then plays.

    Args:
        settings: of the run that the opponent comes from.
        opponent: never changes.
        seed: of weights, postures and noise.
        samples: budget.
        shaped_share: part of the updates with the continuous reward.
    """
    began_at = time.perf_counter()
    env = _env(settings, settings.actor.num_envs)
    learner = settings.learner
    optimiser = PolicyOptimiser(learner, seed)
    collector = _collector(settings, env, opponent, seed, is_shaped=shaped_share > 0.0)
    used = 0
    curve: list[dict[str, float]] = []

    def gather(needed: int) -> list[Rollout]:
        """Play until there are enough samples."""
        nonlocal used
        policy = GaussianPolicy(optimiser.weights())
        rollouts: list[Rollout] = []
        while sum(rollout.rewards.size for rollout in rollouts) < needed:
            segment = collector.collect(policy)
            rollouts.append(rollout_of(segment, policy, env.model.hash, opponent.reference))
            used += segment.rewards.size
            if segment.results is not None and segment.results.complete.any():
                scores = segment.results.score[segment.results.complete]
                curve.append({"samples": used, "score": float(scores.mean())})
        return rollouts

    if learner.warm_up_samples:
        optimiser.warm_up(gather(learner.warm_up_samples))
    per_rollout = settings.actor.num_envs * settings.actor.rollout_steps
    per_update = -(-learner.batch_samples // per_rollout) * per_rollout
    updates = max(0, samples - used) // per_update
    shaped = round(updates * shaped_share)
    for update in range(updates):
        if update == shaped and update > 0:
            other = seed + 2 * _OTHER_STREAM
            collector = _collector(settings, env, opponent, other, is_shaped=False)
        rate = learner.learning_rate_at(update / updates)  # as over a stage of a run
        optimiser.update(gather(learner.batch_samples), rate)
    trained_at = time.perf_counter()
    played = evaluate(settings, GaussianPolicy(optimiser.weights()), opponent, seed)
    return {
        "opponent": opponent.reference,
        "seed": seed,
        "samples": used,
        "updates": updates,
        "shaped_updates": min(shaped, updates),
        "training_seconds": trained_at - began_at,
        **played,
        "curve": curve,
    }


def evaluate(
    settings: Settings, policy: GaussianPolicy, opponent: Opponent, seed: int
) -> dict[str, Any]:
    """Return how a policy's mean actions do in whole bouts against the opponent."""
    rules = settings.game
    env = _env(settings, EVALUATION_BOUTS)
    players = (SnapshotPlayer(policy, stochastic=False), opponent.make())
    evaluation = Evaluation(env, players, EVALUATION_BOUTS, seed + _OTHER_STREAM)
    results = evaluation.advance(rules.bout_steps)
    assert results is not None
    in_target = (results.attack_steps + results.penalty_steps) / rules.bout_steps
    score = mean_interval(results.score.tolist(), np.random.default_rng(seed))
    assert score is not None
    return {
        "bouts": EVALUATION_BOUTS,
        "in_target_share": float(np.mean(in_target)),
        "in_target_worst_bout": float(np.min(in_target)),
        "score": score.mean,
        "score_low": score.low,
        "score_high": score.high,
        "camping_points": float(rules.camping_award * np.mean(results.camping_steps)),
    }


def _collector(
    settings: Settings, env: FencingEnv, opponent: Opponent, seed: int, *, is_shaped: bool
) -> Collector:
    """Return the antagonist's bouts, begun anew, with the reward of phase one or of phase two."""
    league = settings.league
    weights = (league.score_weights[0], league.shaping_weights[0]) if is_shaped else (1.0, 0.0)
    return Collector(
        env, 0, opponent.make(), settings.actor.rollout_steps, *weights, settings.reward, seed
    )


def _env(settings: Settings, num_envs: int) -> FencingEnv:
    model = FencingModel.build(settings.sim)
    return FencingEnv(model, settings.game, settings.action, num_envs)
