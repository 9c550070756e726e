"""The controller smooths its commands: a filter that goes on from step to step, in short steps."""

from shared.sim.hidden.effect import Case, Hidden, servos_alike
from shared.sim.hidden.robot import Hold, Robot
from shared.sim.hidden.setpoints import followed

_PARTS = 4
"""Steps of the filter in one of the physics."""


def _enter(robot: Robot, case: Case) -> None:
    robot.hold = lambda: _filter(case.size, robot.timestep)


def _filter(constant: float, timestep: float) -> Hold:
    """Return what brings a set point closer to its command in each step, by the midpoint rule."""
    short = timestep / _PARTS
    share = short / (constant + 0.5 * short)
    return followed(timestep, _PARTS, lambda place, target: place + share * (target - place))


HIDDEN = Hidden(
    name="command_filter",
    way="a filter of the set point by the midpoint rule, from step to step",
    places=servos_alike,
    sizes=lambda scene, place: (0.008, 0.2),
    values=lambda case: {"time": (case.size, "s")},
    enter=_enter,
)
