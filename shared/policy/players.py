"""Who can play a side: snapshots and scripted players, behind one interface."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from shared.errors import SnapshotError
from shared.messages.training import ACTION_DIM
from shared.policy.mlp import GaussianPolicy

Floats = NDArray[np.float32]
SCRIPTED_PREFIX = "scripted:"


class Player(Protocol):
    """Plays one side of N bouts."""

    def act(self, obs: Floats, generator: np.random.Generator) -> Floats:
        """Return float32[N, 6], what to do on float32[N, 27]."""
        ...


class SnapshotPlayer:
    """A frozen policy."""

    def __init__(self, policy: GaussianPolicy, stochastic: bool) -> None:
        self.policy = policy
        self.stochastic = stochastic

    def act(self, obs: Floats, generator: np.random.Generator) -> Floats:
        """Return the mean action, or a sample around it."""
        mean = self.policy.mean(obs)
        if not self.stochastic:
            return mean
        return self.policy.sample(mean, generator.standard_normal(mean.shape, np.float32))


class StaticPlayer:
    """Asks for no offset: holds still."""

    def act(self, obs: Floats, generator: np.random.Generator) -> Floats:
        """Return zeros."""
        return np.zeros((len(obs), ACTION_DIM), np.float32)


SCRIPTED_PLAYERS: dict[str, type[StaticPlayer]] = {"static": StaticPlayer}


def scripted_player(reference: str) -> Player:
    """Return the scripted player that a reference names.

    Raises:
        SnapshotError: if there is none of that name.
    """
    name = reference.removeprefix(SCRIPTED_PREFIX)
    if not reference.startswith(SCRIPTED_PREFIX) or name not in SCRIPTED_PLAYERS:
        known = ", ".join(SCRIPTED_PREFIX + known for known in sorted(SCRIPTED_PLAYERS))
        raise SnapshotError(f"there is no player {reference!r}; scripted players: {known}")
    return SCRIPTED_PLAYERS[name]()
