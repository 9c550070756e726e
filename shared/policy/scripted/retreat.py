"""Keeps a protagonist from camping: it draws back when its bat was in the target for long."""

import numpy as np
from numpy.typing import NDArray

from shared.policy.scripted.blades import unit
from shared.policy.scripted.memory import Bools, Memory
from shared.policy.scripted.sight import OWN, Arena, Sight, is_in_target, nearest_to_centre

Floats = NDArray[np.float64]

STRIDE = 0.3
"""How far off the pose is that the bat is drawn back to (m)."""
_BACK = 0.05
"""Draws the way out towards the own side (m)."""


def way_out(sight: Sight, arena: Arena) -> Floats:
    """Return float64[3, N], unit vectors along which the own bat leaves the target.

    Out through the nearest side, though never forwards, where the arm's reach ends.
    """
    outward = nearest_to_centre(sight.grips[:, OWN], sight.blades[:, OWN], arena.bat)
    outward[0] = np.minimum(outward[0], 0.0) - _BACK
    return unit(outward)


class Retreat:
    """Counts the steps in the target, in the memory of its player."""

    def __init__(self, memory: Memory, arena: Arena, patience_steps: int) -> None:
        """Prepare.

        Args:
            memory: of the player; ``begin`` has been called when ``apply`` is.
            arena: the sizes of the game.
            patience_steps: consecutive steps in the target after which the bat is drawn back
                until it is out.
        """
        self._memory = memory
        self._arena = arena
        self._patience = patience_steps

    def apply(
        self, is_new: Bools | None, sight: Sight, grips: Floats, blades: Floats
    ) -> tuple[Floats, Floats]:
        """Return the poses to track: those wanted, or the way out where it is time to leave.

        Args:
            is_new: what ``Memory.begin`` returned.
            sight: what is seen now.
            grips: float64[3, N], where the grips are wanted.
            blades: float64[3, N], where the blades are to point.
        """
        is_inside = is_in_target(sight, OWN, self._arena)
        if is_new is None:
            inside = is_inside.astype(np.int32)
            leaving = np.zeros(len(inside), np.bool_)
        else:
            inside = (self._memory["inside"] * ~is_new + np.int32(1)) * is_inside
            leaving = self._memory["leaving"] & is_inside & ~is_new
            leaving |= inside > self._patience
        self._memory["inside"], self._memory["leaving"] = inside, leaving
        if not leaving.any():
            return grips, blades
        out = sight.grips[:, OWN] + STRIDE * way_out(sight, self._arena)
        return np.where(leaving, out, grips), np.where(leaving, sight.blades[:, OWN], blades)
