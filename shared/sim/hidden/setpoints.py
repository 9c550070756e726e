"""Set points that go after their commands in short steps, as firmware moves them."""

from collections.abc import Callable

import numpy as np

from shared.sim.arm import Float64
from shared.sim.hidden.robot import Hold
from shared.sim.plant.signals import Signal


def followed(timestep: float, parts: int, move: Callable[[Float64, Float64], Float64]) -> Hold:
    """Return what a set point is on average in each step of the physics.

    Args:
        timestep: of the physics (s).
        parts: steps of the set point in one of those.
        move: returns float64[U], where it is after one, of where it was and its command.
    """
    begins: Float64 = timestep / parts * np.arange(parts, dtype=np.float64)
    place = np.empty(0)

    def hold(time: float, command: Signal) -> Float64:
        nonlocal place
        targets = command.held(time + begins)
        if not place.size:
            place = targets[0]
        passed: list[Float64] = []
        for target in targets:
            after = move(place, target)
            passed.append(0.5 * (place + after))
            place = after
        return np.mean(passed, axis=0)

    return hold
