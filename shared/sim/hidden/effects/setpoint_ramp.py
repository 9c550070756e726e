"""Set points ramp to each command: a filter that goes on from step to step, as firmware has it."""

import numpy as np

from shared.sim.arm import Float64
from shared.sim.hidden.effect import Case, Hidden, servos_alike
from shared.sim.hidden.robot import Hold, Robot
from shared.sim.hidden.setpoints import followed

_PARTS = 2
"""Steps of the set point in one of the physics."""


def _enter(robot: Robot, case: Case) -> None:
    robot.hold = lambda: _filter(1.0 / case.size, robot.timestep)


def _filter(acceleration: float, timestep: float) -> Hold:
    """Return what brings a set point to its command, never too fast to stop there.

    In halves of a step: a command comes where one begins, and steps of drives begin half of one
    earlier.
    """
    half = timestep / _PARTS
    most = acceleration * half
    speed: Float64 = np.zeros(1)

    def move(place: Float64, target: Float64) -> Float64:
        nonlocal speed
        left = target - place
        fastest = np.sqrt(most**2 + 2.0 * acceleration * np.abs(left)) - most
        speed = speed + np.clip(np.sign(left) * fastest - speed, -most, most)
        return place + half * speed

    return followed(timestep, _PARTS, move)


HIDDEN = Hidden(
    name="setpoint_ramp",
    way="a filter of the set point, from step to step",
    places=servos_alike,
    sizes=lambda scene, place: (0.002, 0.15),
    values=lambda case: {"inverse_acceleration": (case.size, "1/(rad/s^2)")},
    enter=_enter,
)
