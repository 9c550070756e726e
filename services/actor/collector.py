"""Plays the bouts of one training lease and cuts them into rollouts; knows no bus."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shared.game.bout import Judgement
from shared.game.reward import RewardConfig, reward
from shared.messages.league import FEATURE_DIM
from shared.messages.training import ACTION_DIM, AGENTS, OBS_DIM
from shared.policy.mlp import GaussianPolicy
from shared.policy.players import Player, RememberingPlayer
from shared.sim.env import UNJUDGED_STEPS, FencingEnv

Float32s = NDArray[np.float32]
NOT_MEASURED: Float32s = np.zeros((0, len(AGENTS), FEATURE_DIM), np.float32)
Verdict = Callable[[], Judgement]
"""Gives a viewer the judgement of the step just played; made only when asked for, and once."""


@dataclasses.dataclass(frozen=True)
class Segment:
    """T steps of N bouts, and the bouts that ended with them; arrays as in ``Rollout``."""

    bouts: NDArray[np.int64]
    first_step: NDArray[np.int32]
    obs: Float32s
    last_obs: Float32s
    actions: Float32s
    means: Float32s
    log_probs: Float32s
    rewards: Float32s
    truncated: NDArray[np.bool_]
    results: "Results | None"


@dataclasses.dataclass(frozen=True)
class Results:
    """The finished bouts of one segment; arrays as in ``BoutResults``."""

    bouts: NDArray[np.int64]
    score: Float32s
    attack_steps: NDArray[np.int32]
    penalty_steps: NDArray[np.int32]
    camping_steps: NDArray[np.int32]
    complete: NDArray[np.bool_]
    features: Float32s
    """float32[F, 2, 8]; no rows where the style of the bouts was not measured."""


def staggered_starts(num_envs: int, bout_steps: int, rollout_steps: int) -> NDArray[np.int32]:
    """Return int32[N], first steps spread over the bout in whole rollouts.

    Side by side, bouts that all began together would fill every batch with one moment of the game.
    """
    rollouts = bout_steps // rollout_steps
    return (np.arange(num_envs, dtype=np.int32) * rollouts // num_envs) * np.int32(rollout_steps)


def results_of(
    env: FencingEnv,
    worlds: NDArray[np.int64],
    bouts: NDArray[np.int64],
    complete: NDArray[np.bool_],
    features: Float32s | None = None,
) -> Results:
    """Return the scoreboard of these worlds under their bout numbers.

    Args:
        env: the worlds.
        worlds: int64[K], which.
        bouts: int64[N], the number of the bout in each world.
        complete: bool[N], whether it was played from step 0.
        features: float32[N, 2, 8], how both sides moved in it, where that was measured.
    """
    scores = env.scores
    return Results(
        bouts=bouts[worlds],
        score=scores.score[worlds].astype(np.float32),
        attack_steps=scores.attack_steps[worlds],
        penalty_steps=scores.penalty_steps[worlds],
        camping_steps=scores.camping_steps[worlds],
        complete=complete[worlds],
        features=NOT_MEASURED if features is None else features[worlds],
    )


class Collector:
    """The bouts of one training lease."""

    def __init__(
        self,
        env: FencingEnv,
        side: int,
        opponent: Player,
        rollout_steps: int,
        score_weight: float,
        shaping_weight: float,
        reward_cfg: RewardConfig,
        seed: int,
    ) -> None:
        """Start the bouts, staggered.

        Args:
            env: the worlds; what was played in them before is forgotten.
            side: who learns: 0 antagonist, 1 protagonist.
            opponent: plays the other side.
            rollout_steps: T, a divisor of the bout's steps.
            score_weight: factor of the game score in the reward.
            shaping_weight: factor of the continuous reward.
            reward_cfg: its scales.
            seed: of everything random in here.
        """
        self._env = env
        self._side = side
        self._opponent = opponent
        self._steps = rollout_steps
        self._weights = (score_weight, shaping_weight)
        self._reward_cfg = reward_cfg
        self._generator = np.random.default_rng(seed)
        first = staggered_starts(env.num_envs, env.rules.bout_steps, rollout_steps)
        self._bouts = np.arange(env.num_envs, dtype=np.int64)
        self._next_bout = env.num_envs
        self._complete = first == 0
        scale = opponent.offset_scale
        env.offset_scales = (1.0, scale) if side == 0 else (scale, 1.0)
        env.reset(self._bouts, self._generator, first)

    def collect(
        self, policy: GaussianPolicy, on_step: Callable[[Verdict], None] | None = None
    ) -> Segment:
        """Play T steps with one policy and return them; finished bouts start anew.

        Args:
            policy: acts for the learning side.
            on_step: called after each step, for viewers.
        """
        env, side, steps = self._env, self._side, self._steps
        worlds = env.num_envs
        obs = np.empty((steps, worlds, OBS_DIM), np.float32)
        means = np.empty((steps, worlds, ACTION_DIM), np.float32)
        actions = np.empty((steps, worlds, ACTION_DIM), np.float32)
        rewards = np.empty((steps, worlds), np.float32)
        noise = self._generator.standard_normal((steps, worlds, ACTION_DIM), np.float32)
        other_obs = np.empty((worlds, OBS_DIM), np.float32)
        first_step = env.scores.step.copy()
        judged = 0

        def verdict() -> Judgement:
            """Judge what was played since the last time, with its rewards."""
            nonlocal judged
            judgement = env.judge()
            count = len(judgement.points)
            rewards[judged : judged + count] = reward(
                side, judgement, *self._weights, self._reward_cfg
            )
            judged += count
            return judgement.newest

        for step in range(steps):
            env.observe(*((obs[step], other_obs) if side == 0 else (other_obs, obs[step])))
            means[step] = policy.mean(obs[step])
            actions[step] = policy.sample(means[step], noise[step])
            other = self._opponent.act(other_obs, self._generator)
            pair = (actions[step], other) if side == 0 else (other, actions[step])
            env.advance(*pair)
            if on_step is not None:
                on_step(verdict)
            if env.unjudged == UNJUDGED_STEPS:
                verdict()
        if env.unjudged:
            verdict()
        env.batch.check()
        last_obs = np.empty_like(other_obs)
        env.observe(*((last_obs, other_obs) if side == 0 else (other_obs, last_obs)))
        finished = env.finished()
        bouts = self._bouts.copy()
        truncated = np.zeros(worlds, np.bool_)
        truncated[finished] = True
        return Segment(
            bouts=bouts,
            first_step=first_step,
            obs=obs,
            last_obs=last_obs,
            actions=actions,
            means=means,
            log_probs=policy.log_prob(noise),
            rewards=rewards,
            truncated=truncated,
            results=self._restart(finished) if len(finished) else None,
        )

    def _restart(self, finished: NDArray[np.int64]) -> Results:
        """Start these worlds' next bouts and return what the finished ones ended with."""
        results = results_of(self._env, finished, self._bouts, self._complete)
        self._bouts[finished] = np.arange(len(finished)) + self._next_bout
        self._next_bout += len(finished)
        self._complete[finished] = True
        self._env.reset(finished, self._generator)
        return results

    def state(self) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Return arrays and JSON values from which ``restore`` continues bit for bit."""
        arrays: dict[str, NDArray[Any]] = {
            "physics": self._env.batch.state(),
            "bouts": self._bouts.copy(),
            "complete": self._complete.copy(),
        }
        for name, value in self._env.scores.state().items():
            arrays[f"scores.{name}"] = value
        if isinstance(self._opponent, RememberingPlayer):
            for name, value in self._opponent.state().items():
                arrays[f"opponent.{name}"] = value
        values = {"next_bout": self._next_bout, "generator": self._generator.bit_generator.state}
        return arrays, values

    def restore(self, arrays: dict[str, NDArray[Any]], values: dict[str, Any]) -> None:
        """Continue from what ``state`` returned."""
        self._env.batch.restore(arrays["physics"])
        self._bouts[:] = arrays["bouts"]
        self._complete[:] = arrays["complete"]
        self._env.scores.restore(_of("scores.", arrays))
        if isinstance(self._opponent, RememberingPlayer):
            self._opponent.restore(_of("opponent.", arrays))
        self._next_bout = int(values["next_bout"])
        self._generator.bit_generator.state = values["generator"]


def _of(prefix: str, arrays: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Return the arrays whose names begin so, without that beginning."""
    return {k.removeprefix(prefix): v for k, v in arrays.items() if k.startswith(prefix)}
