"""Every policy a run publishes is, in numpy, the network that rsl_rl trained."""

from pathlib import Path

import numpy as np
import torch
from tensordict import TensorDict

from services.jobs.settings import Settings
from services.league.history import RunState
from services.league.ledger import open_read_only
from services.learner.checkpoint import CheckpointStore
from services.learner.ppo import PolicyOptimiser
from shared.messages.training import ACTION_DIM, AGENTS, OBS_DIM
from shared.policy.mlp import GaussianPolicy
from shared.policy.snapshot import unpack
from tests.integration.serial.running import RUN, run
from tests.integration.small import SMALL

KEEP_ALL = "learner.keep_checkpoints=100"


def test_every_published_snapshot_equals_the_model_of_its_checkpoint(tmp_path: Path) -> None:
    run(tmp_path, overrides=(KEEP_ALL,))
    cfg = Settings.load(None, [*SMALL, KEEP_ALL]).learner
    with open_read_only(tmp_path / "league.sqlite") as ledger:
        state = RunState.fold(ledger.replay())
    generator = np.random.default_rng(0)
    compared = 0
    for agent in AGENTS:
        store = CheckpointStore(tmp_path / "learner" / agent, RUN, agent, 100)
        assert sorted(state.versions[agent]) == sorted(store.versions())
        for version, record in state.versions[agent].items():
            path = tmp_path / "snapshots" / f"{record.snapshot}.safetensors"
            snapshot = unpack(path.read_bytes(), record.snapshot)
            assert (snapshot.card.agent, snapshot.card.policy_version) == (agent, version)
            acting = GaussianPolicy(snapshot.weights)
            optimiser = PolicyOptimiser(cfg, seed=99)
            optimiser.restore(store.load(version)[1])
            actor = optimiser._algorithm.actor
            # Around what it has seen, as the normaliser knows it, and far out.
            spread = generator.normal(size=(512, OBS_DIM)) * generator.uniform(0, 4, (512, 1))
            obs = (snapshot.weights.obs_mean + snapshot.weights.obs_std * spread).astype(np.float32)
            noise = generator.standard_normal((512, ACTION_DIM), np.float32)
            with torch.no_grad():
                seen = TensorDict({"policy": torch.from_numpy(obs)}, batch_size=[512])
                actor(seen, stochastic_output=True)
                mean, std = (part.numpy() for part in actor.output_distribution_params)
                actions = acting.sample(mean, noise)
                log_prob = actor.get_output_log_prob(torch.from_numpy(actions)).numpy()
            np.testing.assert_allclose(acting.mean(obs), mean, atol=1e-6, rtol=1e-6)
            np.testing.assert_allclose(acting.std, std[0], atol=1e-6)
            # The log probability of the noise, which the actor knows better than the learner.
            exact = -0.5 * (noise.astype(float) ** 2).sum(1) - (
                np.log(acting.std.astype(float)).sum() + 3.0 * np.log(2.0 * np.pi)
            )
            np.testing.assert_allclose(acting.log_prob(noise), exact, atol=2e-6, rtol=1e-6)
            np.testing.assert_allclose(log_prob, exact, atol=1e-4)
            compared += 1
    assert compared == sum(len(versions) for versions in state.versions.values()) >= 8
