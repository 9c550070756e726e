"""One player's answers: encoder, player and action decoder for a single live bout; no bus."""

import numpy as np
from numpy.typing import NDArray

from shared.game.geometry import Target
from shared.messages.training import ACTION_DIM, AGENTS, OBS_DIM, Agent
from shared.policy.action import ActionConfig, bounded_offset
from shared.policy.observation import ObservationEncoder
from shared.policy.players import Player
from shared.sim.arena import BASE_YAW

Floats = NDArray[np.float64]


class Acting:
    """Turns bat states into the offset that a player asks for, as ``FencingEnv`` does."""

    def __init__(self, agent: Agent, target: Target, action: ActionConfig, seed: int) -> None:
        """Prepare the encoder.

        Args:
            agent: the side that is played.
            target: where the game is.
            action: bounds of the offset.
            seed: of players that draw numbers.
        """
        self._side = AGENTS.index(agent)
        self._encoder = ObservationEncoder(target.centre, BASE_YAW)
        self._obs = [np.empty((1, OBS_DIM), np.float32) for _ in AGENTS]
        self._action = action
        self._generator = np.random.default_rng(seed)

    def offset(self, player: Player, bats: Floats, seconds: float) -> Floats | None:
        """Return float64[6], where the tool should go; None if the player's answer is no number.

        Args:
            player: whose turn it is.
            bats: float64[2, 13], antagonist first, world frame.
            seconds: game time.
        """
        self._encoder.encode(bats[None], np.array([seconds]), self._obs)
        actions = player.act(self._obs[self._side], self._generator)
        offset = bounded_offset(actions.T.astype(np.float64), self._action)[:, 0]
        offset = offset * player.offset_scale
        return offset if np.isfinite(offset).all() else None


HOLD: Floats = np.zeros(ACTION_DIM)
"""The offset of a tool that is to stay where it is."""
