"""The tracker's clock goes wrong: it looks at the right times and writes others."""

from shared.sim.hidden.effect import Case, Hidden, sign, whole_arm
from shared.sim.hidden.robot import Robot


def _rate(case: Case) -> float:
    return sign(float(case.shape[0])) * case.size


def _enter(robot: Robot, case: Case) -> None:
    faster = 1.0 + 1e-6 * _rate(case)
    robot.tracker_clocks.append(lambda at: faster * at)


HIDDEN = Hidden(
    name="clock_skew",
    way="what the tracker writes, not when it is looked at",
    places=whole_arm,
    sizes=lambda scene, place: (30.0, 4500.0),
    values=lambda case: {"rate": (_rate(case), "ppm")},
    enter=_enter,
)
