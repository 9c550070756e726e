"""Who can play a side: snapshots and scripted players, behind one interface."""

from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from shared.errors import SnapshotError
from shared.messages.training import ACTION_DIM, Agent
from shared.policy.mlp import GaussianPolicy
from shared.policy.scripted.attack import Slash, Stab
from shared.policy.scripted.guard import Guard
from shared.policy.scripted.heuristic import Heuristic
from shared.policy.scripted.person import ADAPTIVE, NOVICE, STEADY, Person
from shared.policy.scripted.sight import Arena

Floats = NDArray[np.float32]
SCRIPTED_PREFIX = "scripted:"
RETREAT_STEPS = 100
"""Steps in the target after which ``heuristic-retreating`` draws back; camping is paid past 200."""


class Player(Protocol):
    """Plays one side of N bouts."""

    @property
    def offset_scale(self) -> float:
        """How many times wider than configured the bounds of its actions are."""
        ...

    def act(self, obs: Floats, generator: np.random.Generator) -> Floats:
        """Return float32[N, 6], what to do on float32[N, 27]."""
        ...


@runtime_checkable
class RememberingPlayer(Player, Protocol):
    """A player whose next action also depends on what it saw before.

    It sees for itself where a bout is new: the game time in the observation went back.
    """

    def state(self) -> dict[str, NDArray[Any]]:
        """Return copies of all it remembers, from which ``restore`` continues bit for bit."""
        ...

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Continue from what ``state`` returned."""
        ...


class SnapshotPlayer:
    """A frozen policy."""

    offset_scale = 1.0

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

    offset_scale = 1.0

    def act(self, obs: Floats, generator: np.random.Generator) -> Floats:
        """Return zeros."""
        return np.zeros((len(obs), ACTION_DIM), np.float32)


Makers = dict[str, Callable[[Arena], Player]]

SCRIPTED_PROTAGONISTS: Makers = {
    "static": lambda arena: StaticPlayer(),
    "heuristic": Heuristic,
    "heuristic-printed": lambda arena: Heuristic(arena, projection="printed"),
    "heuristic-retreating": lambda arena: Heuristic(arena, patience_steps=RETREAT_STEPS),
    "guard": Guard,
}
"""Those that defend, by name."""
SCRIPTED_ANTAGONISTS: Makers = {
    "stab": Stab,
    "slash": Slash,
    "person-novice": lambda arena: Person(arena, NOVICE),
    "person-steady": lambda arena: Person(arena, STEADY),
    "person-adaptive": lambda arena: Person(arena, ADAPTIVE),
}
"""Those that attack, by name."""
SCRIPTED_PLAYERS: Makers = SCRIPTED_PROTAGONISTS | SCRIPTED_ANTAGONISTS
"""All, by name; docs/players.md describes them."""


def scripted_role(name: str) -> Agent:
    """Return the side that a scripted player is for."""
    return "antagonist" if name in SCRIPTED_ANTAGONISTS else "protagonist"


def scripted_player(reference: str, arena: Arena | None = None) -> Player:
    """Return the scripted player that a reference names, with nothing in its memory.

    Args:
        reference: ``scripted:<name>``.
        arena: the sizes of the game it plays; those of ``riposte train`` if None.

    Raises:
        SnapshotError: if there is none of that name.
    """
    name = reference.removeprefix(SCRIPTED_PREFIX)
    if not reference.startswith(SCRIPTED_PREFIX) or name not in SCRIPTED_PLAYERS:
        known = ", ".join(SCRIPTED_PREFIX + known for known in sorted(SCRIPTED_PLAYERS))
        raise SnapshotError(f"there is no player {reference!r}; scripted players: {known}")
    return SCRIPTED_PLAYERS[name](arena or Arena())
