"""A rollout as an actor made it, to be played again under other names."""

from pathlib import Path

import msgspec
import numpy as np

from benchmarks.actor import a_policy
from benchmarks.rollouts import rollout_of
from services.actor.collector import Collector
from shared.game.reward import RewardConfig
from shared.game.rules import RuleBook
from shared.messages.league import Lease
from shared.messages.topics import ROLLOUT
from shared.messages.training import Rollout
from shared.messages.wire import decode, encode
from shared.policy.action import ActionConfig
from shared.policy.players import SnapshotPlayer
from shared.sim.config import SimConfig
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel


def record(path: Path, num_envs: int, rollout_steps: int = 40) -> None:
    """Play one rollout of the antagonist in the simulator and write it, encoded as on the wire.

    Args:
        path: of the file.
        num_envs: bouts in it.
        rollout_steps: control steps of it.
    """
    generator = np.random.default_rng(0)
    model = FencingModel.build(SimConfig())
    env = FencingEnv(model, RuleBook(), ActionConfig(), num_envs)
    policy, opponent = a_policy(generator), SnapshotPlayer(a_policy(generator), stochastic=True)
    collector = Collector(env, 0, opponent, rollout_steps, 1.0, 0.1, RewardConfig(), seed=0)
    path.write_bytes(encode(rollout_of(collector.collect(policy), policy, model.hash)))


def read(path: Path) -> Rollout:
    """Return what ``record`` wrote."""
    return decode(Rollout, path.read_bytes(), ROLLOUT.max_bytes)


def under(
    rollout: Rollout, lease: Lease, *, actor: str, boot: str, sequence: int, version: int,
    snapshot: str,
) -> Rollout:  # fmt: skip
    """Return the rollout as if this actor had played it under its lease just now.

    Its bouts get numbers of their own, for a learner refuses a stretch of play that it had before.

    Args:
        rollout: as recorded.
        lease: for training.
        actor: name of the actor.
        boot: of its process.
        sequence: counts its rollouts.
        version: of the policy that acts now.
        snapshot: that policy's hash.
    """
    assert lease.stage is not None
    return msgspec.structs.replace(
        rollout, agent=lease.stage.agent, actor=actor, boot=boot, sequence=sequence,
        lease=lease.lease, stage=lease.stage.index, opponent=lease.stage.opponent, seed=lease.seed,
        policy_version=version, snapshot=snapshot,
        bouts=rollout.bouts + sequence * (int(rollout.bouts.max()) + 1),
    )  # fmt: skip
