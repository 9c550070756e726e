"""The actor's loop against the physics alone, on one core, through the same states.

A round plays a rollout and keeps what was commanded at each step, puts the worlds back where they
were, and steps them once more under the same commands with nothing but ``Batch.step``. So
both sides see the same contacts, joint limits and sizes; what differs is what an actor adds:
observations, two policies, sampling, commands, judging, rewards, and the rollout's bytes.
"""

import itertools
import os
from typing import Any

import numpy as np

from benchmarks.harness import cpu_of, interleaved, median
from benchmarks.rollouts import rollout_of
from services.actor.collector import Collector, Verdict
from services.jobs.bench import Check, Measurement
from services.league.config import LeagueConfig
from shared.game.reward import RewardConfig
from shared.game.rules import RuleBook
from shared.messages.training import ACTION_DIM, OBS_DIM
from shared.messages.wire import encode
from shared.policy.action import ActionConfig
from shared.policy.mlp import GaussianPolicy, PolicyWeights
from shared.policy.players import SnapshotPlayer
from shared.sim.config import SimConfig
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel

QUESTION = "how much of Batch.step's speed is left in the whole actor loop, on one core"
GOAL = 0.85
ROLLOUT_STEPS = 40
WARM_UP = 12
"""Rollouts before the first round: the bats have met by then."""


def a_policy(generator: np.random.Generator) -> GaussianPolicy:
    """Return a policy of the default size that moves about."""
    sizes = (OBS_DIM, 64, 64, ACTION_DIM)
    layers = tuple(
        (
            (generator.standard_normal((after, before)) / np.sqrt(before)).astype(np.float32),
            np.zeros(after, np.float32),
        )
        for before, after in itertools.pairwise(sizes)
    )
    layers[-1][0][:] *= 0.1  # as in a fresh policy: it explores around holding still
    return GaussianPolicy(
        PolicyWeights(
            obs_mean=np.zeros(OBS_DIM, np.float32),
            obs_std=np.ones(OBS_DIM, np.float32),
            layers=layers,
            log_std=np.full(ACTION_DIM, np.log(0.6), np.float32),
            activation="tanh",
        )
    )


def a_collector(env: FencingEnv) -> tuple[Collector, GaussianPolicy]:
    """Return what plays two policies of the default size in some worlds, and the learning one."""
    generator = np.random.default_rng(0)
    policy = a_policy(generator)
    opponent = SnapshotPlayer(a_policy(generator), LeagueConfig().opponent_stochastic)
    made = Collector(env, 0, opponent, ROLLOUT_STEPS, 1.0, 0.1, RewardConfig(), seed=0)
    return made, policy


class Loop:
    """One actor's worlds, played and played again."""

    def __init__(self, num_envs: int, rollouts: int) -> None:
        self.model = FencingModel.build(SimConfig())
        self.env = FencingEnv(self.model, RuleBook(), ActionConfig(), num_envs)
        self.collector, self.policy = a_collector(self.env)
        self.rollouts = rollouts
        self.commands = np.empty((ROLLOUT_STEPS, *self.env.batch.ctrl.shape))
        for _ in range(WARM_UP):
            self.play()

    def keep_command(self, verdict: Verdict) -> None:
        """Keep what was just commanded; counted on the actor's side."""
        self.commands[self.at] = self.env.batch.ctrl
        self.at += 1

    def play(self) -> None:
        """Play a rollout as an actor does, up to its bytes."""
        self.at = 0
        self.segment = self.collector.collect(self.policy, self.keep_command)
        self.payload = encode(rollout_of(self.segment, self.policy, self.model.hash))

    def step_alone(self) -> None:
        """Step the worlds through the same commands."""
        batch = self.env.batch
        for command in self.commands:
            batch.ctrl[:] = command
            batch.step()

    def round(self) -> dict[str, Any]:
        """Return the CPU microseconds a world step of the loop and of the physics alone."""
        batch = self.env.batch
        loop = physics = 0.0
        is_same = True
        for _ in range(self.rollouts):
            before = batch.state()
            loop += cpu_of(self.play)
            after = batch.state()
            batch.restore(before)
            physics += cpu_of(self.step_alone)
            went_on = ~self.segment.truncated  # the others were put back en garde by the loop
            is_same &= bool(np.array_equal(batch.state()[went_on], after[went_on]))
            batch.restore(after)
        scale = 1e6 / (self.rollouts * ROLLOUT_STEPS * self.env.num_envs)
        return {
            "num_envs": self.env.num_envs,
            "loop_us": loop * scale,
            "physics_us": physics * scale,
            "ratio": physics / loop,
            "same_states": is_same,
        }


def measure(smoke: bool) -> Measurement:
    """Return the actor's speed beside the physics alone, at 128 and 256 worlds."""
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    rollouts, rounds = (1, 2) if smoke else (4, 25)
    loops = {num_envs: Loop(num_envs, rollouts) for num_envs in (128, 256)}
    runs = [
        run for pair in interleaved(rounds, [loop.round for loop in loops.values()]) for run in pair
    ]
    by_size = {n: [run for run in runs if run["num_envs"] == n] for n in loops}
    at = by_size[256]
    return Measurement(
        value=1e6 / median(at, "loop_us"),
        unit="world steps per CPU second, 256 worlds",
        limit=1e6 / median(at, "physics_us"),
        ratio=Check(
            name="actor loop / Batch.step alone, 256 worlds", value=median(at, "ratio"), goal=GOAL
        ),
        runs=tuple(runs),
        checks=(
            Check(
                name="actor loop / Batch.step alone, 128 worlds",
                value=median(by_size[128], "ratio"),
            ),
            *(
                Check(name=f"{what}, {n} worlds", value=median(by_size[n], key), unit="us")
                for n in loops
                for what, key in (("loop", "loop_us"), ("physics", "physics_us"))
            ),
            Check(
                name="rounds whose replay ended in the same bits",
                value=sum(run["same_states"] for run in runs) / len(runs),
                goal=1.0,
            ),
        ),
        details={"rollout_bytes": {n: len(loop.payload) for n, loop in loops.items()}},
    )
