"""Something like a cable pulls a joint towards an angle: as a torque."""

from shared.sim.hidden.effect import Case, Hidden, Scene, dof_of, every_joint
from shared.sim.hidden.robot import Law, Moment, Robot


def _rest(case: Case) -> float:
    away = (2.0 * float(case.shape[0]) - 1.0) * case.scene.reach(case.place)
    return case.scene.middle(case.place) + away


def _sizes(scene: Scene, place: str) -> tuple[float, float]:
    """Return what pulls by 0.2 % to 40 % of the largest torque at the end of the travel."""
    full = scene.torque(place) / scene.reach(place)
    return 2e-3 * full, 0.4 * full


def _enter(robot: Robot, case: Case) -> None:
    robot.laws.append(lambda: _pull(robot, case))


def _pull(robot: Robot, case: Case) -> Law:
    rest = _rest(case)

    def act(moment: Moment) -> None:
        joint = moment.model.joint(robot.plant.mj_joint(case.place))
        angle = float(moment.data.qpos[int(joint.qposadr[0])])
        moment.data.qfrc_applied[dof_of(robot, moment.model, case.place)] += case.size * (
            rest - angle
        )

    return act


HIDDEN = Hidden(
    name="joint_spring",
    way="a torque, not MuJoCo's spring",
    places=every_joint,
    sizes=_sizes,
    values=lambda case: {"stiffness": (case.size, "N m/rad"), "rest": (_rest(case), "rad")},
    enter=_enter,
)
