"""The controller smooths its commands: a filter that goes on from step to step, in short steps."""

import numpy as np

from shared.sim.arm import Float64
from shared.sim.hidden.effect import Case, Hidden, servos_alike
from shared.sim.hidden.robot import Hold, Robot
from shared.sim.plant.signals import Signal

_PARTS = 4
"""Steps of the filter in one of the physics."""


def _enter(robot: Robot, case: Case) -> None:
    robot.hold = lambda: _filter(case.size, robot.timestep)


def _filter(constant: float, timestep: float) -> Hold:
    """Return what brings a set point closer to its command in each step, by the midpoint rule."""
    short = timestep / _PARTS
    share = short / (constant + 0.5 * short)
    begins: Float64 = short * np.arange(_PARTS, dtype=np.float64)
    place = np.empty(0)

    def hold(time: float, command: Signal) -> Float64:
        nonlocal place
        targets = command.held(time + begins)
        if not place.size:
            place = targets[0]
        passed: list[Float64] = []
        for target in targets:
            after = place + share * (target - place)
            passed.append(0.5 * (place + after))
            place = after
        return np.mean(passed, axis=0)

    return hold


HIDDEN = Hidden(
    name="command_filter",
    way="a filter of the set point by the midpoint rule, from step to step",
    places=servos_alike,
    sizes=lambda scene, place: (0.008, 0.2),
    values=lambda case: {"time": (case.size, "s")},
    enter=_enter,
)
