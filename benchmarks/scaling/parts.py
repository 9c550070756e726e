"""What an actor and PPO cost, each alone in this process: CPU seconds, no bus."""

import os
import statistics

import numpy as np

from benchmarks.actor import Loop
from benchmarks.harness import cpu_of
from benchmarks.rollouts import rollout_of
from services.learner.config import LearnerConfig

NUM_ENVS = 128
BATCH = 4
"""Rollouts in one update."""


def costs(rounds: int) -> dict[str, float]:
    """Return the CPU seconds for a sample of an actor's loop and of PPO, medians of rounds.

    Args:
        rounds: rollouts played, each followed by an update from the newest four.
    """
    from services.learner.ppo import PolicyOptimiser  # torch: only where PPO runs

    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(before)})
    loop = Loop(NUM_ENVS, 1)
    optimiser = PolicyOptimiser(LearnerConfig(), 0)
    rollouts = []
    playing: list[float] = []
    updating: list[float] = []
    while len(updating) < rounds:
        playing.append(cpu_of(loop.play))
        rollouts.append(rollout_of(loop.segment, loop.policy, loop.model.hash))
        if len(rollouts) >= BATCH:
            newest = rollouts[-BATCH:]
            updating.append(cpu_of(lambda: optimiser.update(newest)))  # noqa: B023
    os.sched_setaffinity(0, before)
    samples = float(np.size(rollouts[0].rewards))
    return {
        "actor_s": statistics.median(playing) / samples,
        "update_s": statistics.median(updating) / (BATCH * samples),
    }
