"""Stable-Baselines3's PPO on the batched environment, observations normalised by its VecNormalize.

An adapter gives it the whole batch at once, which is faster than its DummyVecEnv of single bouts.
"""
# pyright: basic

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnv, VecNormalize
from torch import nn

from benchmarks.peer_loops.work import INPUTS, OUTPUTS, Stopwatch, Timing, Work, main

ENDLESS = 2_000_000_000


class BatchedBouts(VecEnv):
    """Our vector environment as one of theirs."""

    def __init__(self, work: Work) -> None:
        self._bouts = work.batch()
        self._actions = np.zeros(0, np.float32)
        super().__init__(
            work.num_envs,
            spaces.Box(-np.inf, np.inf, (INPUTS,), np.float32),
            spaces.Box(-1.0, 1.0, (OUTPUTS,), np.float32),
        )

    def reset(self):
        """Start every bout."""
        return self._bouts.reset()

    def step_async(self, actions: np.ndarray) -> None:
        """Keep what is to be done."""
        self._actions = actions

    def step_wait(self):
        """Do it; what was seen last is where they look for it."""
        turn = self._bouts.step(self._actions)
        infos: list[dict] = [{} for _ in range(self.num_envs)]
        for world, seen in zip(np.flatnonzero(turn.ended), turn.last_seen, strict=True):
            infos[world] = {"terminal_observation": seen, "TimeLimit.truncated": True}
        return turn.obs, turn.paid.astype(np.float32), turn.ended, infos

    def close(self) -> None:
        """Nothing is open."""

    def get_attr(self, attr_name, indices=None):
        """Return None for each bout: nothing can be asked for."""
        return [None for _ in self._get_indices(indices)]

    def set_attr(self, attr_name, value, indices=None) -> None:
        """Refuse."""
        raise AttributeError(attr_name)

    def env_method(self, method_name, *method_args, indices=None, **method_kwargs):
        """Refuse."""
        raise AttributeError(method_name)

    def env_is_wrapped(self, wrapper_class, indices=None):
        """Return False for each bout."""
        return [False for _ in self._get_indices(indices)]


class _Clock(BaseCallback):
    """Looks at the stopwatch where an update has ended: when the next rollout begins."""

    def __init__(self, watch: Stopwatch) -> None:
        super().__init__()
        self._watch = watch
        self.is_over = False

    def _on_rollout_start(self) -> None:
        if self.num_timesteps:
            self.is_over = self._watch.update_done(self.num_timesteps, self._act)

    def _act(self, obs: np.ndarray) -> np.ndarray:
        seen = self.model.get_vec_normalize_env().normalize_obs(obs)
        return self.model.predict(seen, deterministic=True)[0]

    def _on_step(self) -> bool:
        return not self.is_over


def loop(work: Work) -> Timing:
    """Train until the window is over."""
    torch.set_num_threads(work.threads)
    watch = work.stopwatch()
    env = VecNormalize(BatchedBouts(work), norm_reward=False, gamma=work.gamma)
    layers = list(work.hidden_dims)
    ppo = PPO(
        "MlpPolicy", env, learning_rate=work.learning_rate, n_steps=work.steps,
        batch_size=work.batch_samples // work.minibatches, n_epochs=work.epochs, gamma=work.gamma,
        gae_lambda=work.gae_lambda, clip_range=work.clip, ent_coef=work.entropy_coef,
        vf_coef=work.value_loss_coef, max_grad_norm=work.max_grad_norm, seed=work.seed,
        device="cpu",
        policy_kwargs={
            "net_arch": {"pi": layers, "vf": layers}, "activation_fn": nn.Tanh,
            "log_std_init": float(np.log(work.initial_std)),
        },
    )  # fmt: skip
    clock = _Clock(watch)
    ppo.learn(ENDLESS, callback=clock, log_interval=None)
    return watch.timing(ppo.num_timesteps - work.num_envs)


if __name__ == "__main__":
    main(loop)
