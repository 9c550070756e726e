"""The best single-process loop we know: rsl_rl's own runner on the same environment.

``python -m benchmarks.baseline_rsl_rl --seconds 20`` prints one JSON object. Same networks,
normalisation, epochs, minibatches, batch and learning rate as ``services/learner``; the bouts are
the actor's ``FencingEnv``, so physics, observation, judging and the numpy opponent cost the same.
"""
# pyright: basic

import argparse
import contextlib
import io
import json
import os
import time

from shared.runtime.process import THREAD_LIMITS

os.environ.update(THREAD_LIMITS)

import numpy as np
import torch
from rsl_rl.env import VecEnv
from rsl_rl.runners import OnPolicyRunner
from tensordict import TensorDict

from services.actor.collector import staggered_starts
from services.jobs.settings import Settings
from services.learner.config import LearnerConfig
from services.learner.ppo import PolicyOptimiser
from shared.game.reward import reward
from shared.messages.training import ACTION_DIM, OBS_DIM
from shared.policy.mlp import GaussianPolicy
from shared.policy.players import SnapshotPlayer
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel

WARM_UP = 2
"""Iterations before the clock starts."""


class FencingVecEnv(VecEnv):
    """N bouts of the antagonist against a frozen protagonist, as rsl_rl wants them."""

    def __init__(self, settings: Settings, num_envs: int, rollout_steps: int) -> None:
        self.num_envs = num_envs
        self.num_actions = ACTION_DIM
        self.max_episode_length = settings.game.bout_steps
        self.episode_length_buf = torch.zeros(num_envs, dtype=torch.long)
        self.device = "cpu"
        self.cfg = {}
        self._reward = settings.reward
        league = settings.league
        self._weights = (league.score_weights[0], league.shaping_weights[0])
        model = FencingModel.build(settings.sim)
        self._env = FencingEnv(model, settings.game, settings.action, num_envs)
        fresh = PolicyOptimiser(settings.learner, seed=1).weights()
        self._opponent = SnapshotPlayer(GaussianPolicy(fresh), league.opponent_stochastic)
        self._generator = np.random.default_rng(0)
        first = staggered_starts(num_envs, settings.game.bout_steps, rollout_steps)
        self._env.reset(np.arange(num_envs), self._generator, first)
        self._other = np.empty((num_envs, OBS_DIM), np.float32)
        self._obs = self._observe()

    def get_observations(self) -> TensorDict:
        """Return what the antagonists see now."""
        return self._obs

    def step(self, actions: torch.Tensor) -> tuple[TensorDict, torch.Tensor, torch.Tensor, dict]:
        """Play one control step of every bout; finished ones start anew."""
        other = self._opponent.act(self._other, self._generator)
        judgement = self._env.step(actions.numpy(), other)
        rewards = reward(0, judgement, *self._weights, self._reward).astype(np.float32)
        done = self._env.scores.finished()
        if done.any():
            self._env.reset(np.flatnonzero(done), self._generator)
        self._obs = self._observe()
        dones = torch.from_numpy(done)
        return self._obs, torch.from_numpy(rewards), dones.long(), {"time_outs": dones}

    def _observe(self) -> TensorDict:
        obs = np.empty((self.num_envs, OBS_DIM), np.float32)
        self._env.observe(obs, self._other)
        return TensorDict({"policy": torch.from_numpy(obs)}, batch_size=[self.num_envs])


def runner_config(cfg: LearnerConfig, steps: int) -> dict:
    """Return the runner's configuration: ours, in its words."""
    network = {
        "class_name": "MLPModel",
        "hidden_dims": list(cfg.hidden_dims),
        "activation": cfg.activation,
        "obs_normalization": True,
    }
    return {
        "num_steps_per_env": steps,
        "save_interval": 1_000_000,
        "check_for_nan": False,
        "obs_groups": {"actor": ["policy"], "critic": ["policy"]},
        "algorithm": {
            "class_name": "PPO",
            "num_learning_epochs": cfg.epochs,
            "num_mini_batches": cfg.minibatches,
            "clip_param": cfg.clip,
            "gamma": cfg.gamma,
            "lam": cfg.gae_lambda,
            "value_loss_coef": cfg.value_loss_coef,
            "entropy_coef": cfg.entropy_coef,
            "learning_rate": cfg.learning_rate,
            "max_grad_norm": cfg.max_grad_norm,
            "use_clipped_value_loss": False,
            "schedule": "fixed",
        },
        "actor": network
        | {
            "distribution_cfg": {
                "class_name": "GaussianDistribution",
                "init_std": cfg.initial_std,
                "std_type": "log",
                "std_range": (cfg.minimum_std, cfg.maximum_std),
            }
        },
        "critic": dict(network),
    }


def train(settings: Settings, num_envs: int, threads: int, seconds: float) -> dict[str, float]:
    """Return samples a second, by the wall clock and by the CPU's, after a warm-up."""
    torch.set_num_threads(threads)
    torch.manual_seed(0)
    steps = settings.learner.batch_samples // num_envs
    env = FencingVecEnv(settings, num_envs, settings.actor.rollout_steps)
    runner = OnPolicyRunner(env, runner_config(settings.learner, steps), log_dir=None)
    runner.learn(WARM_UP)
    iterations = 0
    began_at, cpu_before = time.perf_counter(), time.process_time()
    while iterations == 0 or time.perf_counter() - began_at < seconds:
        runner.learn(1)
        iterations += 1
    wall, cpu = time.perf_counter() - began_at, time.process_time() - cpu_before
    samples = iterations * steps * num_envs
    return {
        "num_envs": num_envs,
        "threads": threads,
        "samples": samples,
        "samples_per_s": samples / wall,
        "samples_per_cpu_s": samples / cpu,
        "wall_s": wall,
        "cpu_s": cpu,
    }


def main() -> None:
    """Train for a while and print how fast it went."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--num-envs", type=int, default=128)
    parser.add_argument("--threads", type=int, default=1)
    found = parser.parse_args()
    with contextlib.redirect_stdout(io.StringIO()):
        figures = train(Settings.load(None), found.num_envs, found.threads, found.seconds)
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
