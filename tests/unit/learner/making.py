"""Rollouts and learners for tests: real arrays, real PPO, no simulator."""

from typing import Any

import msgspec
import numpy as np

from services.learner.config import LearnerConfig
from shared.messages.training import ACTION_DIM, OBS_DIM, Rollout
from shared.policy.mlp import GaussianPolicy, PolicyWeights
from tests.unit.policy.making import weights

SMALL = LearnerConfig(
    batch_samples=64,
    warm_up_samples=64,
    hidden_dims=(16, 16),
    epochs=2,
    minibatches=4,
    keep_checkpoints=3,
)
MODEL = "m" * 64
STEPS, WORLDS = 8, 8
BOUT_STEPS = 80


def rollout(
    sequence: int = 0,
    *,
    policy: PolicyWeights | None = None,
    draw: int | None = None,
    steps: int = STEPS,
    worlds: int = WORLDS,
    **changes: Any,
) -> Rollout:
    """A consistent rollout; observations and rewards are noise, actions are the policy's own."""
    generator = np.random.default_rng(sequence if draw is None else draw)
    acting = GaussianPolicy(policy or weights((16, 16)))
    obs = generator.normal(0.3, 1.5, (steps, worlds, OBS_DIM)).astype(np.float32)
    means = np.stack([acting.mean(row) for row in obs])
    noise = generator.standard_normal((steps, worlds, ACTION_DIM), np.float32)
    first = (np.arange(worlds, dtype=np.int32) % 10) * np.int32(steps)
    plain = Rollout(
        agent="antagonist",
        actor="actor-0",
        boot="b0",
        sequence=sequence,
        lease="L000001",
        stage=0,
        policy_version=0,
        snapshot="a" * 64,
        opponent="scripted:static",
        model=MODEL,
        seed=11,
        bouts=np.arange(worlds, dtype=np.int64) + worlds * sequence,
        first_step=first,
        obs=obs,
        last_obs=generator.normal(0.3, 1.5, (worlds, OBS_DIM)).astype(np.float32),
        actions=np.stack([acting.sample(*step) for step in zip(means, noise, strict=True)]),
        means=means,
        stds=acting.std,
        log_probs=acting.log_prob(noise),
        rewards=generator.normal(size=(steps, worlds)).astype(np.float32),
        truncated=first + steps == BOUT_STEPS,
    )
    return msgspec.structs.replace(plain, **changes)
