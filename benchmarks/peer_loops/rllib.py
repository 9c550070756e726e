"""RLlib's PPO and APPO, new API stack: two env runners with half of the bouts each, local learner.

The runners get our batch whole (`VECTOR_ENTRY_POINT`), which is faster than their loop over single
bouts; observations are normalised by their `MeanStdFilter`.
"""
# pyright: basic

import os
from typing import Any

import gymnasium
import numpy as np
import ray
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from ray.rllib.algorithms.appo import APPOConfig
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.connectors.env_to_module import MeanStdFilter
from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig
from ray.tune.registry import register_env

from benchmarks.peer_loops.work import INPUTS, OUTPUTS, Stopwatch, Timing, Work, main

RUNNERS = 2
SAMPLED = "num_env_steps_sampled_lifetime"
"""Of APPO that is more than was learned from: it drops what its learner has no time for."""


class BatchedBouts(VectorEnv):
    """Our vector environment with the new beginnings where RLlib looks for them: a step later."""

    metadata: dict[str, Any] = {"autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012

    def __init__(self, work: Work, num_envs: int, seed: int) -> None:
        self.num_envs = num_envs
        self._bouts = work.batch(num_envs, seed)
        self._ended = np.zeros(num_envs, np.bool_)
        self.single_observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (INPUTS,), np.float32)
        self.single_action_space = gymnasium.spaces.Box(-1.0, 1.0, (OUTPUTS,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(self, *, seed=None, options=None):
        """Start every bout."""
        self._ended[:] = False
        return self._bouts.reset(), {}

    def step(self, actions):
        """Play one control step of every bout; that of one that ended before counts for nothing."""
        turn = self._bouts.step(np.clip(np.asarray(actions, np.float32), -1.0, 1.0))
        obs = turn.obs
        obs[turn.ended] = turn.last_seen
        paid = np.where(self._ended, 0.0, turn.paid)
        self._ended = turn.ended
        return obs, paid, np.zeros(self.num_envs, np.bool_), turn.ended, {}


def _config(work: Work):
    common: dict[str, Any] = {
        "lr": work.learning_rate, "gamma": work.gamma, "num_epochs": work.epochs,
        "train_batch_size_per_learner": work.batch_samples, "lambda_": work.gae_lambda,
        "minibatch_size": work.batch_samples // work.minibatches, "clip_param": work.clip,
        "entropy_coeff": work.entropy_coef, "vf_loss_coeff": work.value_loss_coef,
        "grad_clip": work.max_grad_norm, "use_kl_loss": False,
    }  # fmt: skip
    if work.mode == "appo":  # has V-trace instead of GAE
        del common["lambda_"]
        config = APPOConfig().training(**common)
    else:
        config = PPOConfig().training(**common, vf_clip_param=np.inf)

    def make(context):
        return BatchedBouts(work, context.get("num_envs", 1), os.getpid())

    register_env("fencing", make)
    return (
        config.environment("fencing", observation_space=gymnasium.spaces.Box(
            -np.inf, np.inf, (INPUTS,), np.float32),
            action_space=gymnasium.spaces.Box(-1.0, 1.0, (OUTPUTS,), np.float32))
        .env_runners(
            num_env_runners=RUNNERS, num_envs_per_env_runner=work.num_envs // RUNNERS,
            gym_env_vectorize_mode=gymnasium.VectorizeMode.VECTOR_ENTRY_POINT,
            rollout_fragment_length=work.steps,
            env_to_module_connector=lambda *_, **__: MeanStdFilter(),
        )
        .learners(num_learners=0)
        .reporting(
            min_time_s_per_iteration=0, min_sample_timesteps_per_iteration=work.batch_samples
        )
        .rl_module(model_config=DefaultModelConfig(
            fcnet_hiddens=list(work.hidden_dims), fcnet_activation="tanh",
            vf_share_layers=False, free_log_std=True))
    )  # fmt: skip


def loop(work: Work) -> Timing:
    """Train until the window is over."""
    watch = Stopwatch(work)
    ray.init(num_cpus=RUNNERS + 1, include_dashboard=False, log_to_driver=False)
    try:
        algorithm = _config(work).build_algo()
        while True:
            result = algorithm.train()
            samples = int(result.get("env_runners", {}).get(SAMPLED, 0))
            if samples and watch.update_done(samples):
                return watch.timing(samples)
    finally:
        ray.shutdown()


if __name__ == "__main__":
    main(loop)
