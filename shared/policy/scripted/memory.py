"""What a player remembers of each world, from step to step and from bout to bout.

A player is only shown observations. It knows that a world's bout is new because the game time
went back; so a memory needs no help from whoever runs the worlds.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from shared.policy.scripted.sight import Arena

Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]
Arrays = dict[str, NDArray[Any]]

_TIME = "seconds"


class Memory:
    """Named arrays with the worlds on their last axis."""

    def __init__(self) -> None:
        self._arrays: Arrays = {}

    def begin(self, seconds: Floats) -> Bools | None:
        """Look at the clock of every world; call it once a step.

        Args:
            seconds: float64[N], game time.

        Returns:
            bool[N], where a bout is new; None where there is nothing yet, or of another number
            of worlds: everything has to be made anew.
        """
        before = self._arrays.get(_TIME)
        if before is None or before.shape != seconds.shape:
            self._arrays = {_TIME: seconds.copy()}
            return None
        is_new = seconds < before
        before[:] = seconds
        return is_new

    @property
    def count(self) -> int | None:
        """Return of how many worlds this is the memory; None before the first step."""
        before = self._arrays.get(_TIME)
        return None if before is None else len(before)

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return an array, to be read and written."""
        return self._arrays[name]

    def __setitem__(self, name: str, value: NDArray[Any]) -> None:
        """Keep an array."""
        self._arrays[name] = value

    def state(self) -> Arrays:
        """Return copies of all arrays."""
        return {name: value.copy() for name, value in self._arrays.items()}

    def restore(self, arrays: Arrays) -> None:
        """Continue from what ``state`` returned."""
        self._arrays = {name: value.copy() for name, value in arrays.items()}


class Remembering:
    """What scripted players that remember have in common: their memory can be kept."""

    def __init__(self, arena: Arena) -> None:
        """Begin with nothing in the memory.

        Args:
            arena: the sizes of the game.
        """
        self._arena = arena
        self._memory = Memory()

    def state(self) -> Arrays:
        """Return what ``restore`` continues from."""
        return self._memory.state()

    def restore(self, arrays: Arrays) -> None:
        """Continue from what ``state`` returned."""
        self._memory.restore(arrays)
