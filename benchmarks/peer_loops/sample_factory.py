"""Sample Factory's APPO: its batched sampler, in one process, in step, or ahead of the learner.

``mode`` is ``serial`` (one process), ``sync`` (a worker and a learner in turns) or ``async`` (two
workers that go on while the learner learns; their policies are some updates old).
"""
# pyright: basic

import os
import sys
import tempfile

import gymnasium
import numpy as np
import torch
from sample_factory.algo.runners.runner import AlgoObserver, Runner
from sample_factory.cfg.arguments import parse_full_cfg, parse_sf_args
from sample_factory.envs.env_utils import register_env
from sample_factory.train import make_runner

from benchmarks.peer_loops.work import INPUTS, OUTPUTS, Stopwatch, Timing, Work, main, say

ENDLESS = 2_000_000_000
WORKERS = {"serial": 1, "sync": 1, "async": 2}


class BatchedBouts(gymnasium.Env):
    """Our vector environment as one of theirs with many agents; it starts ended bouts itself."""

    is_multiagent = True

    def __init__(self, work: Work, seed: int) -> None:
        torch.set_num_threads(1)
        self.num_agents = work.num_envs // WORKERS[work.mode]
        self._bouts = work.batch(self.num_agents, seed)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (INPUTS,), np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (OUTPUTS,), np.float32)
        self.render_mode = None

    def reset(self, **kwargs):
        """Start every bout."""
        return self._bouts.reset(), [{} for _ in range(self.num_agents)]

    def step(self, action):
        """Play one control step of every bout."""
        commanded = np.clip(np.asarray(action, np.float32), -1.0, 1.0)
        turn = self._bouts.step(commanded)
        never = np.zeros(self.num_agents, np.bool_)
        return turn.obs, turn.paid.astype(np.float32), never, turn.ended, {}


class BoutsOfWork:
    """Makes the environment; it travels to their worker processes."""

    def __init__(self, work: Work) -> None:
        self._work = work

    def __call__(self, name, cfg=None, env_config=None, render_mode=None):
        """Return the environment of one worker."""
        index = 0 if env_config is None else env_config.worker_index
        return BatchedBouts(self._work, seed=index)


class _Clock(AlgoObserver):
    """Looks at the stopwatch after every update, and ends the process when it is over."""

    def __init__(self, watch: Stopwatch, batch_samples: int) -> None:
        self._watch = watch
        self._batch_samples = batch_samples
        self._updates = 0

    def on_training_step(self, runner: Runner, training_iteration_since_resume: int) -> None:
        """Count an update."""
        self._updates += 1
        samples = self._updates * self._batch_samples
        if self._watch.update_done(samples):
            say(self._watch.timing(samples))
            os._exit(0)  # whoever started us ends the workers


def _flags(work: Work, folder: str) -> list[str]:
    layers = [str(width) for width in work.hidden_dims]
    flags = {
        "algo": "APPO", "env": "fencing", "experiment": "peer", "train_dir": folder,
        "device": "cpu", "serial_mode": work.mode == "serial", "async_rl": work.mode == "async",
        "batched_sampling": True, "num_workers": WORKERS[work.mode], "num_envs_per_worker": 1,
        "worker_num_splits": 1, "rollout": work.steps,
        "batch_size": work.batch_samples // work.minibatches,
        "num_batches_per_epoch": work.minibatches, "num_epochs": work.epochs,
        "use_rnn": False, "with_vtrace": False, "normalize_input": True,
        "normalize_returns": False, "actor_critic_share_weights": False,
        "nonlinearity": "tanh", "adaptive_stddev": False, "continuous_tanh_scale": 0.0,
        "initial_stddev": work.initial_std, "gamma": work.gamma, "gae_lambda": work.gae_lambda,
        "ppo_clip_ratio": work.clip, "value_loss_coeff": work.value_loss_coef,
        "exploration_loss_coeff": work.entropy_coef, "max_grad_norm": work.max_grad_norm,
        "learning_rate": work.learning_rate, "lr_schedule": "constant", "reward_scale": 1.0,
        "train_for_env_steps": ENDLESS, "save_every_sec": 100_000, "save_best_every_sec": 100_000,
        "decorrelate_experience_max_seconds": 0, "with_wandb": False, "seed": 1,
    }  # fmt: skip
    return [*(f"--{name}={value}" for name, value in flags.items()),
            "--encoder_mlp_layers", *layers]  # fmt: skip


def loop(work: Work) -> Timing:
    """Train until the window is over; does not return."""
    watch = Stopwatch(work)
    register_env("fencing", BoutsOfWork(work))
    with tempfile.TemporaryDirectory() as folder:
        parser, _ = parse_sf_args(_flags(work, folder))
        cfg = parse_full_cfg(parser, _flags(work, folder))
        _, runner = make_runner(cfg)
        runner.register_observer(_Clock(watch, work.batch_samples))
        runner.init()
        status = runner.run()
    sys.exit(f"it ended before its window was over: {status}")


if __name__ == "__main__":
    main(loop)
