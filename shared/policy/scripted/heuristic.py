"""The paper's heuristic baseline (appendix, "Baseline Heuristic Policy").

The bat's middle goes between the target's centre and the point of the opponent's bat that is
closest to it, the blade perpendicular to the opponent's, both with noise; half of the time the
pose of the step before is executed.
"""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from shared.game.geometry import dot
from shared.policy.scripted.blades import across, turned
from shared.policy.scripted.memory import Remembering
from shared.policy.scripted.retreat import Retreat
from shared.policy.scripted.sight import OTHER, OWN, Arena, Sight
from shared.policy.scripted.tracking import track

Floats = NDArray[np.float64]
Float32s = NDArray[np.float32]
Projection = Literal["geometric", "printed"]

TURN = np.deg2rad(25.0)
"""Largest random turn about each of x, y and z (rad)."""
NEAREST = 0.5
"""The bat's place on the way from the target to the opponent's bat is uniform in [this, 1]."""
OLD_POSE_CHANCE = 0.5
_UP = np.array([0.0, 0.0, 1.0])


def closest_share(low: Floats, up: Floats, bat_length: float, projection: Projection) -> Floats:
    """Return float64[N] in [0, 1]: where the point h_close is between both ends of a bat.

    The target's centre is the origin. The paper prints a division by 2 L; the projection on the
    bat divides by L squared. With its bats of about L = 0.75 m the printed one yields 0.375 of it.

    Args:
        low: float64[3, N], lower end of the opponent's bat (m).
        up: float64[3, N], its upper end.
        bat_length: L, the distance between them (m).
        projection: which of the two.
    """
    divisor = bat_length**2 if projection == "geometric" else 2.0 * bat_length
    return np.clip(-dot(low, up - low) / divisor, 0.0, 1.0)


class Heuristic(Remembering):
    """The baseline protagonist of the paper's second study."""

    offset_scale = 1.0

    def __init__(
        self,
        arena: Arena,
        projection: Projection = "geometric",
        patience_steps: int | None = None,
    ) -> None:
        """Prepare.

        Args:
            arena: the sizes of the game.
            projection: how h_t is computed.
            patience_steps: steps in the target after which the bat is drawn back; None as in the
                paper: never.
        """
        super().__init__(arena)
        self._projection: Projection = projection
        self._retreat = (
            None if patience_steps is None else Retreat(self._memory, arena, patience_steps)
        )

    def desired(self, sight: Sight, generator: np.random.Generator) -> tuple[Floats, Floats]:
        """Return the newest pose: the bats' middles (m) and unit vectors along their blades."""
        bat = self._arena.bat
        grips, blades = sight.grips[:, OTHER], sight.blades[:, OTHER]
        low, up = grips + bat.back * blades, grips + bat.front * blades
        share = closest_share(low, up, self._arena.bat_length, self._projection)
        random = generator.random((4, grips.shape[-1]))
        middles = (low + share * (up - low)) * (NEAREST + (1.0 - NEAREST) * random[0])
        upright = across(sight.blades[:, OWN], blades, _UP)
        return middles, turned(upright, TURN * (2.0 * random[1:] - 1.0))

    def act(self, obs: Float32s, generator: np.random.Generator) -> Float32s:
        """Return float32[N, 6], towards the newest pose or the one before."""
        sight = Sight.of(obs)
        is_new = began = self._memory.begin(sight.seconds)
        pose = np.concatenate(self.desired(sight, generator))
        is_old = generator.random(len(obs)) < OLD_POSE_CHANCE
        if is_new is None:
            self._memory["pose"] = pose
            is_new = np.ones(len(obs), np.bool_)
        chosen = np.where(is_old & ~is_new, self._memory["pose"], pose)
        self._memory["pose"] = pose
        middles, blades = chosen[:3], chosen[3:]
        grips = middles - self._arena.middle * blades
        if self._retreat is not None:
            grips, blades = self._retreat.apply(began, sight, grips, blades)
        return track(sight, grips, blades, self._arena)
