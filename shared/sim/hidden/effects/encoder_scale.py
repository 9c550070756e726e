"""A joint's encoder counts in another gear ratio: a controller beside the arm believes it."""

from shared.sim.hidden.effect import Case, Hidden, every_joint, sign
from shared.sim.hidden.robot import Robot


def _share(case: Case) -> float:
    return sign(float(case.shape[0])) * case.size


def _enter(robot: Robot, case: Case) -> None:
    robot.misread(case.place, 1.0 + _share(case), 0.0)


HIDDEN = Hidden(
    name="encoder_scale",
    way="a controller of its own that believes the encoder",
    places=every_joint,
    sizes=lambda scene, place: (1e-3, 0.15),
    values=lambda case: {"share": (_share(case), "1")},
    enter=_enter,
)
