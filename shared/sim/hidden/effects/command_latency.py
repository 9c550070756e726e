"""Commands reach the controller late: in MuJoCo's own delay lines."""

import math

from shared.sim.hidden.effect import Case, Hidden, whole_arm
from shared.sim.hidden.robot import Robot

_LINEAR = 1
"""Between the samples of a delay line on a straight line."""


def _enter(robot: Robot, case: Case) -> None:
    for actuator in robot.spec.actuators:
        actuator.nsample = math.ceil(case.size / robot.timestep) + 2
        actuator.delay = case.size
        actuator.interp = _LINEAR


HIDDEN = Hidden(
    name="command_latency",
    way="MuJoCo's delay of an actuator",
    places=whole_arm,
    sizes=lambda scene, place: (1e-3, 0.1),
    values=lambda case: {"delay": (case.size, "s")},
    enter=_enter,
)
