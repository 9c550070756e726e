"""A joint's drive gives less than the model allows: clipped in the path of the drive."""

from shared.sim.hidden.effect import Case, Hidden, Scene, every_joint
from shared.sim.hidden.robot import Law, Moment, Robot


def _sizes(scene: Scene, place: str) -> tuple[float, float]:
    """Return limits from 95 % down to 10 % of the largest torque."""
    return 1.0 / (0.95 * scene.torque(place)), 1.0 / (0.1 * scene.torque(place))


def _enter(robot: Robot, case: Case) -> None:
    robot.drive_apart()
    robot.drives.append(lambda: _clip(case))


def _clip(case: Case) -> Law:
    joint, limit = case.scene.joints.index(case.place), 1.0 / case.size

    def act(moment: Moment) -> None:
        moment.drive[joint] = min(max(float(moment.drive[joint]), -limit), limit)

    return act


HIDDEN = Hidden(
    name="torque_saturation",
    way="clipped in the path of the drive",
    places=every_joint,
    sizes=_sizes,
    values=lambda case: {"inverse_limit": (case.size, "1/(N m)")},
    enter=_enter,
)
