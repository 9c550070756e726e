"""rsl_rl's own runner on the batched environment, timed as the others.

Its own `RolloutStorage`, normalisers and PPO; the environment is ours, given whole batches.
"""
# pyright: basic

import contextlib
import io

import torch
from rsl_rl.runners import OnPolicyRunner

from benchmarks.baseline_rsl_rl import FencingVecEnv, runner_config
from benchmarks.peer_loops.work import Stopwatch, Timing, Work, main
from services.jobs.settings import Settings


def loop(work: Work) -> Timing:
    """Train until the window is over."""
    torch.set_num_threads(work.threads)
    torch.manual_seed(0)
    settings = Settings.load(None)
    watch = Stopwatch(work)
    env = FencingVecEnv(settings, work.num_envs, settings.actor.rollout_steps)
    samples = 0
    with contextlib.redirect_stdout(io.StringIO()):
        runner = OnPolicyRunner(env, runner_config(settings.learner, work.steps), log_dir=None)
        while True:
            runner.learn(1)
            samples += work.steps * work.num_envs
            if watch.update_done(samples):
                return watch.timing(samples)


if __name__ == "__main__":
    main(loop)
