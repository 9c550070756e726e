"""Plays the bouts of one evaluation lease: two fixed players, from start to end; knows no bus."""

from collections.abc import Callable

import numpy as np

from services.actor.collector import Results, Verdict, results_of
from shared.game.bout import Judgement
from shared.messages.training import OBS_DIM
from shared.policy.players import Player
from shared.sim.env import UNJUDGED_STEPS, FencingEnv
from shared.styles.features import StyleMeter


class Evaluation:
    """Bouts between the same two players, all begun together, with the style of both."""

    def __init__(
        self, env: FencingEnv, players: tuple[Player, Player], bouts: int, seed: int
    ) -> None:
        """Start the bouts.

        Args:
            env: the worlds.
            players: antagonist, protagonist.
            bouts: how many, at most ``env.num_envs``.
            seed: of everything random in here.

        Raises:
            ValueError: if there are more bouts than worlds.
        """
        if not 1 <= bouts <= env.num_envs:
            raise ValueError(f"bouts ({bouts}) must be in 1..{env.num_envs}, one a world")
        self._env = env
        self._players = players
        self._generator = np.random.default_rng(seed)
        self._numbers = np.arange(env.num_envs, dtype=np.int64)
        self._count = bouts
        self._meter = StyleMeter(env.num_envs, env.model.cfg.control_timestep)
        self.num_envs = env.num_envs
        """Worlds that are stepped for it."""
        self.left = env.rules.bout_steps
        antagonist, protagonist = players
        env.offset_scales = (antagonist.offset_scale, protagonist.offset_scale)
        env.reset(self._numbers, self._generator)

    def advance(
        self, steps: int, on_step: Callable[[Verdict], None] | None = None
    ) -> Results | None:
        """Play up to so many steps; return the results once the bouts are over."""
        env, meter = self._env, self._meter
        positions, velocities = env.bat_motion
        obs = [np.empty((env.num_envs, OBS_DIM), np.float32) for _ in self._players]

        def verdict() -> Judgement:
            return env.judge().newest

        for _ in range(min(steps, self.left)):
            env.observe(*obs)
            actions = [
                player.act(seen, self._generator)
                for player, seen in zip(self._players, obs, strict=True)
            ]
            env.advance(*actions)
            meter.add(positions, velocities)
            self.left -= 1
            if on_step is not None:
                on_step(verdict)
            if env.unjudged == UNJUDGED_STEPS:
                env.judge()
        if env.unjudged:
            env.judge()
        env.batch.check()
        if self.left:
            return None
        worlds = self._numbers[: self._count]
        complete = np.ones(env.num_envs, np.bool_)
        return results_of(env, worlds, self._numbers, complete, meter.features())
