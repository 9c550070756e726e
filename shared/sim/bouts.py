"""N bouts side by side seen from one side, the other side being given: reward and new beginnings.

Without any framework of environments, so that each of them can be a thin layer on top.
"""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from shared.game.bout import Judgement
from shared.game.reward import reward
from shared.messages.training import OBS_DIM
from shared.sim.task import SIDES, Float32s, Opponent, Side, Task, observe

_CHECK_EVERY = 40
"""Steps between two looks at whether the physics is still finite."""


@dataclasses.dataclass(frozen=True)
class Turn:
    """One control step of every bout, ended ones begun anew."""

    obs: Float32s
    """float32[N, 27], what is seen now: in a bout that ended, the beginning of the next."""
    paid: NDArray[np.float64]
    """float64[N], rewards."""
    ended: NDArray[np.bool_]
    """bool[N], whose time was over."""
    last_seen: Float32s
    """float32[E, 27], what was seen last in each of the E bouts that ended."""
    scores: NDArray[np.float64]
    """float64[N], of the bouts that ended, 0 of others."""


class Bouts:
    """N bouts and the opponent in them."""

    def __init__(
        self, task: Task, agent: Side, opponent: Opponent, num_envs: int, num_threads: int = 1
    ) -> None:
        """Build the worlds.

        Args:
            task: the game.
            agent: who is asked for actions.
            opponent: who plays the other side.
            num_envs: how many bouts.
            num_threads: of the physics.

        Raises:
            ConfigError: if the model file cannot be used.
            SnapshotError: if there is no such opponent, or it does not fit this game.
        """
        self.task = task
        self.side = SIDES.index(agent)
        self.env = task.worlds(num_envs, num_threads)
        self.player = task.player(opponent, self.env)
        scale = self.player.offset_scale
        self.env.offset_scales = (1.0, scale) if self.side == 0 else (scale, 1.0)
        self._others = np.zeros((num_envs, OBS_DIM), np.float32)
        self._steps = 0

    def start(self, generator: np.random.Generator, *, staggered: bool = False) -> Float32s:
        """Start every bout; return float32[N, 27], what is seen.

        Args:
            generator: of where the arms begin.
            staggered: at different times of the clock, so that a batch never shows only one
                moment of the game.
        """
        env = self.env
        worlds = np.arange(env.num_envs)
        first = worlds * env.rules.bout_steps // env.num_envs if staggered else 0 * worlds
        env.reset(worlds, generator, first.astype(np.int32))
        return self.observe()

    def observe(self) -> Float32s:
        """Return float32[N, 27], what the learning side sees now, in a new array."""
        seen = observe(self.env)
        self._others = seen[1 - self.side]
        return seen[self.side]

    def step(
        self, actions: Float32s, generator: np.random.Generator
    ) -> tuple[NDArray[np.float64], Judgement]:
        """Carry out one step since the last look; return float64[N] rewards and the judgement."""
        other = self.player.act(self._others, generator)
        pair = (actions, other) if self.side == 0 else (other, actions)
        judgement = self.env.step(*pair)
        self._steps += 1
        if self._steps % _CHECK_EVERY == 0:
            self.env.batch.check()
        task = self.task
        paid = reward(self.side, judgement, task.score_weight, task.shaping_weight, task.reward)
        return paid, judgement

    def advance(self, actions: Float32s, generator: np.random.Generator) -> Turn:
        """Carry out one step and begin anew what has ended.

        Args:
            actions: float32[N, 6].
            generator: of the opponent's choices and of new beginnings.
        """
        paid, _ = self.step(actions, generator)
        ended = self.env.scores.finished()
        obs = self.observe()
        last_seen = obs[ended]
        scores = np.where(ended, self.env.scores.score, 0.0)
        if ended.any():
            self.env.reset(np.flatnonzero(ended), generator)
            obs = self.observe()
        return Turn(obs, paid, ended, last_seen, scores)
