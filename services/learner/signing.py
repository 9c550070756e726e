"""What a snapshot says of where it comes from, and the seeds of a run."""

import dataclasses

import numpy as np

from services.learner.checkpoint import Meta
from services.learner.config import LearnerConfig
from shared.game.rules import RuleBook
from shared.messages.training import Agent
from shared.policy.action import ACTION_SCHEMA
from shared.policy.mlp import PolicyWeights
from shared.policy.observation import OBSERVATION_SCHEMA
from shared.policy.snapshot import Card, Fit, Snapshot, normaliser_hash, pack


@dataclasses.dataclass(frozen=True)
class RunFacts:
    """What a learner must know of its run to sign snapshots and to check rollouts."""

    run: str
    seed: int
    fit: Fit
    """With the model's hash."""
    rules: RuleBook


def sign(cfg: LearnerConfig, facts: RunFacts, meta: Meta, weights: PolicyWeights) -> Snapshot:
    """Return the snapshot of a version, its card filled in."""
    fit = facts.fit
    card = Card(
        agent=meta.agent,
        policy_version=meta.policy_version,
        stage=meta.stage,
        run=facts.run,
        seed=facts.seed,
        total_samples=meta.total_samples,
        observation_schema=OBSERVATION_SCHEMA,
        action_schema=ACTION_SCHEMA,
        normaliser=normaliser_hash(weights.obs_mean, weights.obs_std),
        control_timestep=fit.control_timestep,
        offset_bound_m=fit.offset_bound_m,
        offset_bound_rad=fit.offset_bound_rad,
        model=fit.model or "",
        activation=cfg.activation,
        hidden_dims=cfg.hidden_dims,
    )
    return pack(card, weights)


def seed_of(seed: int, agent: Agent, round: int = 0) -> int:
    """Return the agent's own seed in a run, and in a round of its phase two."""
    own = seed * 2 + (agent == "protagonist")
    if not round:
        return own
    return int(np.random.SeedSequence((own, round)).generate_state(1, np.uint64)[0] >> np.uint64(1))
