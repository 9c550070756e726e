"""A joint's viscous friction grows faster than its speed: as a torque."""

from shared.sim.hidden.effect import Case, Hidden, Scene, dof_of, every_joint
from shared.sim.hidden.robot import Law, Moment, Robot


def _sizes(scene: Scene, place: str) -> tuple[float, float]:
    """Return what takes 0.5 % to 60 % of the largest torque at speed."""
    full = scene.torque(place) / scene.speed(place) ** 2
    return 5e-3 * full, 0.6 * full


def _enter(robot: Robot, case: Case) -> None:
    robot.laws.append(lambda: _drag(robot, case))


def _drag(robot: Robot, case: Case) -> Law:
    def act(moment: Moment) -> None:
        dof = dof_of(robot, moment.model, case.place)
        speed = float(moment.data.qvel[dof])
        moment.data.qfrc_applied[dof] -= case.size * speed * abs(speed)

    return act


HIDDEN = Hidden(
    name="nonlinear_viscous",
    way="a torque, not MuJoCo's damping polynomial",
    places=every_joint,
    sizes=_sizes,
    values=lambda case: {"quadratic": (case.size, "N m s^2/rad^2")},
    enter=_enter,
)
