"""A joint's drive weakens as it works: what it is told passes a winding that warms up."""

import math

from shared.sim.hidden.effect import Case, Hidden, Scene, every_joint
from shared.sim.hidden.robot import Law, Moment, Robot

_MEMORY = 120.0
"""Time in which most of the warmth is gone (s)."""


def _sizes(scene: Scene, place: str) -> tuple[float, float]:
    """Return what takes 1 % to 70 % after a recording at 30 % of the largest torque."""
    heat = (0.3 * scene.torque(place)) ** 2 * scene.duration
    return 0.01 / heat, 2.3 / heat


def _enter(robot: Robot, case: Case) -> None:
    robot.drive_apart()
    robot.drives.append(lambda: _warm(case))


def _warm(case: Case) -> Law:
    joint, heat = case.scene.joints.index(case.place), 0.0

    def act(moment: Moment) -> None:
        nonlocal heat
        if moment.time < 0.0:
            return
        told = float(moment.drive[joint])
        moment.drive[joint] = told / (1.0 + case.size * heat)
        heat = heat * math.exp(-moment.timestep / _MEMORY) + told**2 * moment.timestep

    return act


HIDDEN = Hidden(
    name="thermal_derating",
    way="a winding in the path of the drive, not a torque against it",
    places=every_joint,
    sizes=_sizes,
    values=lambda case: {"loss": (case.size, "1/((N m)^2 s)")},
    enter=_enter,
)
