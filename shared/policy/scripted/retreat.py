"""Keeps a protagonist from camping: it draws back when its bat was in the target for long."""

import numpy as np
from numpy.typing import NDArray

from shared.policy.scripted.blades import unit
from shared.policy.scripted.memory import Bools, Memory
from shared.policy.scripted.sight import OWN, Arena, Sight, is_in_target

Floats = NDArray[np.float64]

HOME_GRIP: Floats = np.array([[-0.45], [-0.25], [-0.10]])
HOME_BLADE: Floats = unit(np.array([[0.25], [0.0], [0.97]]))
"""Where the bat is drawn back to: en garde, blade up, clear of the target (m)."""


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
        """Return the poses to track: those wanted, or home where it is time to leave.

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
        return np.where(leaving, HOME_GRIP, grips), np.where(leaving, HOME_BLADE, blades)
