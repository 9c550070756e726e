"""Set points follow commands at a limited speed: from step to step, as firmware has it."""

import numpy as np

from shared.sim.arm import Float64
from shared.sim.hidden.effect import Case, Hidden, Scene, servos_alike
from shared.sim.hidden.robot import Hold, Robot
from shared.sim.hidden.setpoints import followed

_PARTS = 4
"""Steps of the set point in one of the physics."""


def _sizes(scene: Scene, place: str) -> tuple[float, float]:
    """Return limits from 90 % down to 25 % of how fast the fastest joint is told to go."""
    fastest = max(map(scene.speed, scene.joints))
    return 1.0 / (0.9 * fastest), 1.0 / (0.25 * fastest)


def _enter(robot: Robot, case: Case) -> None:
    robot.hold = lambda: _follow(1.0 / case.size, robot.timestep)


def _follow(speed: float, timestep: float) -> Hold:
    """Return what takes a set point towards its command in short steps."""
    most = speed * timestep / _PARTS

    def move(place: Float64, target: Float64) -> Float64:
        return place + np.clip(target - place, -most, most)

    return followed(timestep, _PARTS, move)


HIDDEN = Hidden(
    name="setpoint_speed",
    way="a limit of the set point's speed, from step to step",
    places=servos_alike,
    sizes=_sizes,
    values=lambda case: {"inverse_speed": (case.size, "1/(rad/s)")},
    enter=_enter,
)
