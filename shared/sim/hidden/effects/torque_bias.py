"""A joint's drive pushes by a constant torque: added to what the drive does."""

from shared.sim.hidden.effect import Case, Hidden, every_joint, share_of_torque, sign
from shared.sim.hidden.robot import Law, Moment, Robot


def _torque(case: Case) -> float:
    return sign(float(case.shape[0])) * case.size


def _enter(robot: Robot, case: Case) -> None:
    robot.drives.append(lambda: _push(case))


def _push(case: Case) -> Law:
    joint = case.scene.joints.index(case.place)

    def act(moment: Moment) -> None:
        moment.drive[joint] += _torque(case)

    return act


HIDDEN = Hidden(
    name="torque_bias",
    way="an offset of the drive, not a soft spring",
    places=every_joint,
    sizes=share_of_torque(1e-3, 0.2),
    values=lambda case: {"torque": (_torque(case), "N m")},
    enter=_enter,
)
