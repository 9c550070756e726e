"""Set points follow commands at a limited speed: from step to step, as firmware has it."""

import numpy as np

from shared.sim.arm import Float64
from shared.sim.hidden.effect import Case, Hidden, Scene, servos_alike
from shared.sim.hidden.robot import Hold, Robot
from shared.sim.plant.signals import Signal

_PARTS = 4
"""Steps of the set point in one of the physics."""


def _sizes(scene: Scene, place: str) -> tuple[float, float]:
    """Return limits from 90 % down to 25 % of how fast the fastest joint is told to go."""
    fastest = max(map(scene.speed, scene.joints))
    return 1.0 / (0.9 * fastest), 1.0 / (0.25 * fastest)


def _enter(robot: Robot, case: Case) -> None:
    robot.hold = lambda: _follow(1.0 / case.size, robot.timestep / _PARTS)


def _follow(speed: float, short: float) -> Hold:
    """Return what takes a set point towards its command in short steps."""
    begins: Float64 = short * np.arange(_PARTS, dtype=np.float64)
    place = np.empty(0)

    def hold(time: float, command: Signal) -> Float64:
        nonlocal place
        targets = command.held(time + begins)
        if not place.size:
            place = targets[0]
        passed: list[Float64] = []
        for target in targets:
            after = place + np.clip(target - place, -speed * short, speed * short)
            passed.append(0.5 * (place + after))
            place = after
        return np.mean(passed, axis=0)

    return hold


HIDDEN = Hidden(
    name="setpoint_speed",
    way="a limit of the set point's speed, from step to step",
    places=servos_alike,
    sizes=_sizes,
    values=lambda case: {"inverse_speed": (case.size, "1/(rad/s)")},
    enter=_enter,
)
