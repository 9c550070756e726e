"""A joint's encoder has another zero: a controller beside the arm believes it."""

from shared.sim.hidden.effect import Case, Hidden, every_joint, sign
from shared.sim.hidden.robot import Robot


def _offset(case: Case) -> float:
    return sign(float(case.shape[0])) * case.size


def _enter(robot: Robot, case: Case) -> None:
    robot.misread(case.place, 1.0, _offset(case))


HIDDEN = Hidden(
    name="encoder_offset",
    way="a controller of its own that believes the encoder",
    places=every_joint,
    sizes=lambda scene, place: (5e-4, 0.12),
    values=lambda case: {"offset": (_offset(case), "rad")},
    enter=_enter,
)
