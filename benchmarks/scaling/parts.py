"""What an actor and PPO cost, each alone in this process: CPU seconds, no bus."""

import statistics

import numpy as np

from benchmarks.actor import Loop
from benchmarks.harness import cpu_of, on_first_cores
from benchmarks.rollouts import rollout_of
from benchmarks.speed import piece_seconds
from services.learner.config import LearnerConfig

NUM_ENVS = 128
BATCH = 4
"""Rollouts in one update."""


def costs(rounds: int) -> dict[str, float]:
    """Return CPU seconds, medians of rounds: an actor's for a sample, PPO's, a piece of work's.

    Args:
        rounds: rollouts played, each followed by an update from the newest four.
    """
    from services.learner.ppo import PolicyOptimiser  # torch: only where PPO runs

    with on_first_cores(1):
        loop = Loop(NUM_ENVS, 1)
        optimiser = PolicyOptimiser(LearnerConfig(), 0)
        rollouts = []
        playing: list[float] = []
        updating: list[float] = []
        pieces: list[float] = []
        while len(updating) < rounds:
            pieces.append(piece_seconds())
            playing.append(cpu_of(loop.play))
            rollouts.append(rollout_of(loop.segment, loop.policy, loop.model.hash))
            if len(rollouts) >= BATCH:
                newest = rollouts[-BATCH:]
                updating.append(cpu_of(lambda: optimiser.update(newest)))  # noqa: B023
    samples = float(np.size(rollouts[0].rewards))
    return {
        "actor_s": statistics.median(playing) / samples,
        "update_s": statistics.median(updating) / (BATCH * samples),
        "piece_s": statistics.median(pieces),
    }
