"""rsl_rl's own runner on the batched environment, in one process.

Same networks, normalisation, epochs, minibatches, batch and learning rate as ``services/learner``;
its own `RolloutStorage` and PPO, the bouts ours, given in whole batches. It begins as it always
does, or, in mode `begun-alike`, as ours does: with normalisers that have learned from a rollout and
with a policy that holds still.
"""
# pyright: basic

import contextlib
import io

import numpy as np
import torch
from rsl_rl.env import VecEnv
from rsl_rl.runners import OnPolicyRunner
from tensordict import TensorDict

from benchmarks.peer_loops.work import OUTPUTS, Timing, Work, main
from services.jobs.settings import Settings
from services.learner.config import LearnerConfig

BEGUN_ALIKE = "begun-alike"


class BatchedBouts(VecEnv):
    """Our bouts as rsl_rl wants them."""

    def __init__(self, work: Work) -> None:
        self._bouts = work.batch()
        self.num_envs = work.num_envs
        self.num_actions = OUTPUTS
        self.max_episode_length = Settings.load(None).game.bout_steps
        self.episode_length_buf = torch.zeros(work.num_envs, dtype=torch.long)
        self.device = "cpu"
        self.cfg = {}
        self._obs = self._seen(self._bouts.reset())

    def get_observations(self) -> TensorDict:
        """Return what the antagonists see now."""
        return self._obs

    def step(self, actions: torch.Tensor) -> tuple[TensorDict, torch.Tensor, torch.Tensor, dict]:
        """Play one control step of every bout; finished ones start anew."""
        turn = self._bouts.step(actions.numpy())
        self._obs = self._seen(turn.obs)
        dones = torch.from_numpy(turn.ended)
        paid = torch.from_numpy(turn.paid.astype(np.float32))
        return self._obs, paid, dones.long(), {"time_outs": dones}

    def _seen(self, obs: np.ndarray) -> TensorDict:
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


def begin_alike(runner: OnPolicyRunner, env: BatchedBouts, steps: int) -> None:
    """Make the policy's last layer small, and teach the observation normalisers a rollout."""
    with torch.no_grad():
        last = [layer for layer in runner.alg.actor.mlp if isinstance(layer, torch.nn.Linear)][-1]
        last.weight.mul_(0.01)
        last.bias.zero_()
    seen = []
    with torch.inference_mode():
        for _ in range(steps):
            obs = env.get_observations()
            seen.append(obs["policy"])
            env.step(runner.alg.actor(obs, stochastic_output=True))
    together = TensorDict({"policy": torch.cat(seen)}, batch_size=[steps * env.num_envs])
    for model in (runner.alg.actor, runner.alg.critic):
        model.update_normalization(together)


def loop(work: Work) -> Timing:
    """Train until the window is over."""
    torch.set_num_threads(work.threads)
    torch.manual_seed(work.seed)
    watch = work.stopwatch()
    env = BatchedBouts(work)
    cfg = Settings.load(None).learner
    samples = 0
    with contextlib.redirect_stdout(io.StringIO()):
        runner = OnPolicyRunner(env, runner_config(cfg, work.steps), log_dir=None)

        def act(obs: np.ndarray) -> np.ndarray:
            seen = TensorDict({"policy": torch.from_numpy(obs)}, batch_size=[len(obs)])
            with torch.inference_mode():
                return runner.get_inference_policy()(seen).numpy()

        if work.mode == BEGUN_ALIKE:
            begin_alike(runner, env, work.steps)
            samples += work.steps * work.num_envs
        while True:
            runner.learn(1)
            samples += work.steps * work.num_envs
            if watch.update_done(samples, act):
                return watch.timing(samples)


if __name__ == "__main__":
    main(loop)
