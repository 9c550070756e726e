"""A joint's drive gives more or less than it is told: in the path of the drive."""

from shared.sim.hidden.effect import Case, Hidden, Scene, sign
from shared.sim.hidden.robot import Law, Moment, Robot


def _places(scene: Scene) -> tuple[str, ...]:
    """Return the joints; none where a servo's gains are the same thing."""
    return () if scene.arm.control == "position" else scene.joints


def _share(case: Case) -> float:
    return sign(float(case.shape[0])) * case.size


def _enter(robot: Robot, case: Case) -> None:
    robot.drive_apart()
    robot.drives.append(lambda: _scale(case))


def _scale(case: Case) -> Law:
    joint = case.scene.joints.index(case.place)

    def act(moment: Moment) -> None:
        moment.drive[joint] *= 1.0 + _share(case)

    return act


HIDDEN = Hidden(
    name="torque_gain",
    way="a factor in the path of the drive",
    places=_places,
    sizes=lambda scene, place: (5e-3, 0.5),
    values=lambda case: {"share": (_share(case), "1")},
    enter=_enter,
)
