"""The tracker writes where the tool was a while ago: in MuJoCo's own delay lines."""

import math

from shared.sim.hidden.effect import Case, Hidden, whole_arm
from shared.sim.hidden.robot import Robot
from shared.sim.plant.plant import TOOL

_LINEAR = 1
"""Between the samples of a delay line on a straight line."""


def _enter(robot: Robot, case: Case) -> None:
    for sensor in robot.spec.sensors:
        if sensor.name.startswith(TOOL):
            sensor.nsample = math.ceil(case.size / robot.timestep) + 2
            sensor.delay = case.size
            sensor.interp = _LINEAR


HIDDEN = Hidden(
    name="tracker_latency",
    way="MuJoCo's delay of a sensor",
    places=whole_arm,
    sizes=lambda scene, place: (1e-3, 0.1),
    values=lambda case: {"delay": (case.size, "s")},
    enter=_enter,
)
