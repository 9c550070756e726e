"""A person with a free bat, in one game after the other; knows no bus.

Sees, hears, aims and searches as the scripted people do (docs/players.md); but where those move a
robot's arm, this one's hand goes where it wants, within what a hand can do.
"""

import numpy as np
from numpy.typing import NDArray

from shared.game.geometry import Target
from shared.messages.training import OBS_DIM
from shared.policy.observation import ObservationEncoder
from shared.policy.scripted.person import READY_BLADE, READY_GRIP, Character, Person
from shared.policy.scripted.sight import Arena, Sight
from shared.study.people.hand import Hand

Floats = NDArray[np.float64]

YAW = np.pi
"""The antagonist looks along -x (rad)."""


class Fencer:
    """One person's bat."""

    def __init__(
        self, arena: Arena, target: Target, character: Character, rng: np.random.Generator
    ) -> None:
        """Stand ready.

        Args:
            arena: the sizes of the game.
            target: where it is, world frame.
            character: of the first game.
            rng: of everything that is drawn.
        """
        self._person = Person(arena, character)
        self._character = character
        self._rng = rng
        self._centre = np.array(target.centre)
        self._encoder = ObservationEncoder(target.centre, (YAW, 0.0))
        self._obs = [np.empty((1, OBS_DIM), np.float32) for _ in range(2)]
        self._hand = Hand(READY_GRIP[:, 0], READY_BLADE[:, 0])

    def become(self, character: Character) -> None:
        """Play as this character from the next game on."""
        self._character = character
        self._person.become(character)

    def play(self, bats: Floats, game_seconds: float, seconds: float) -> Floats:
        """Go on in a game; return where the bat is now, as ``pose``.

        Args:
            bats: float64[2, 13], the own bat first, world frame.
            game_seconds: game time (s); where it went back, a game is new.
            seconds: since the bat was moved last.
        """
        self._encoder.encode(bats[None], np.array([game_seconds]), self._obs)
        grips, blades = self._person.wish(Sight.of(self._obs[0]), self._rng)
        self._hand.step(grips[:, 0], blades[:, 0], self._character.noise, seconds, self._rng)
        return self.pose()

    def wait(self, seconds: float) -> Floats:
        """Go on to where one stands between games; return where the bat is now."""
        grip, blade = READY_GRIP[:, 0], READY_BLADE[:, 0]
        self._hand.step(grip, blade, self._character.noise, seconds, self._rng)
        return self.pose()

    def pose(self) -> Floats:
        """Return float64[7], the bat in the world: position (m), orientation (w x y z)."""
        x, y, z, a, b, c, d = self._hand.pose().tolist()
        cx, cy, cz = self._centre.tolist()
        # half a turn about the vertical: its quaternion is (0, 0, 0, 1)
        return np.array([cx - x, cy - y, cz + z, -d, -c, b, a])
