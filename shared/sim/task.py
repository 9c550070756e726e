"""What the Gymnasium and PettingZoo environments share: settings, spaces, opponents."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, cast

import gymnasium
import msgspec
import numpy as np
from numpy.typing import NDArray

from shared.errors import SnapshotError
from shared.game.reward import RewardConfig
from shared.game.rules import RuleBook
from shared.messages.training import ACTION_DIM, OBS_DIM
from shared.policy.action import ActionConfig
from shared.policy.mlp import GaussianPolicy
from shared.policy.players import Player, SnapshotPlayer, scripted_player
from shared.policy.snapshot import Fit, unpack
from shared.sim.config import SimConfig
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel

Float32s = NDArray[np.float32]
Side = Literal["antagonist", "protagonist"]
SIDES: tuple[Side, Side] = ("antagonist", "protagonist")

Opponent = Player | Callable[[Float32s], Float32s] | str | Path
"""A player, a function from float32[N, 27] to float32[N, 6], a reference such as
``"scripted:static"``, or the file of a snapshot."""


class Task(msgspec.Struct, frozen=True, kw_only=True):
    """The game to play; the defaults are those of ``riposte train`` in phase one."""

    sim: SimConfig = SimConfig()
    rules: RuleBook = RuleBook()
    action: ActionConfig = ActionConfig()
    reward: RewardConfig = RewardConfig()
    score_weight: float = 1.0
    """Factor of the scaled game score in the reward."""
    shaping_weight: float = 0.4
    """Factor of the continuous part; 0 leaves a zero-sum game."""

    def worlds(self, num_envs: int, num_threads: int = 1) -> FencingEnv:
        """Return ``num_envs`` bouts of this game.

        Raises:
            ConfigError: if the model file cannot be used.
        """
        model = FencingModel.build(self.sim)
        return FencingEnv(model, self.rules, self.action, num_envs, num_threads)

    def observation_space(self) -> "gymnasium.Space[Float32s]":
        """Return the box of float32[27]: own bat, other bat (13 numbers each), time (s)."""
        bat = [10.0] * 3 + [1.01] * 4 + [50.0] * 3 + [200.0] * 3
        seconds = self.rules.bout_steps * self.sim.control_timestep
        high = np.array([*bat, *bat, 1.001 * seconds], np.float32)
        low = -high
        low[-1] = 0.0
        assert high.shape == (OBS_DIM,)
        return _float32s(gymnasium.spaces.Box(low, high, dtype=np.float32))

    def action_space(self) -> "gymnasium.Space[Float32s]":
        """Return the box of float32[6]: offset of the tool, in units of its bounds."""
        return _float32s(gymnasium.spaces.Box(-1.0, 1.0, (ACTION_DIM,), np.float32))

    def player(self, opponent: Opponent, env: FencingEnv) -> Player:
        """Return who an opponent in these worlds is.

        Raises:
            SnapshotError: if there is no such player, or its snapshot does not fit this game.
        """
        if isinstance(opponent, Path):
            try:
                snapshot = unpack(opponent.read_bytes())
            except OSError as error:
                raise SnapshotError(f"cannot read {opponent}: {error.strerror}") from error
            snapshot.check_fits(Fit.of(self.action, self.sim.control_timestep, env.model.hash))
            return SnapshotPlayer(GaussianPolicy(snapshot.weights), stochastic=True)
        if isinstance(opponent, str):
            return scripted_player(opponent, env.arena)
        return _Function(opponent) if callable(opponent) else opponent


def observe(env: FencingEnv) -> tuple[Float32s, Float32s]:
    """Return what antagonist and protagonist see now: new arrays, float32[N, 27] each."""
    antagonist, protagonist = np.empty((2, env.num_envs, OBS_DIM), np.float32)
    env.observe(antagonist, protagonist)
    return antagonist, protagonist


def _float32s(box: "gymnasium.spaces.Box[Any]") -> "gymnasium.Space[Float32s]":
    return cast("gymnasium.Space[Float32s]", box)  # a box does not tell its dtype to the checker


class _Function:
    """A function of observations as a player."""

    offset_scale = 1.0

    def __init__(self, function: Callable[[Float32s], Float32s]) -> None:
        self._function = function

    def act(self, obs: Float32s, generator: np.random.Generator) -> Float32s:
        """Return what the function makes of float32[N, 27]."""
        return self._function(obs)
