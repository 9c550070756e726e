"""A joint is braked harder one way than the other: its damping changes with the direction."""

from shared.sim.hidden.effect import Case, Hidden, Scene, dof_of, every_joint, sign
from shared.sim.hidden.robot import Law, Moment, Robot


def _half(case: Case) -> float:
    return sign(float(case.shape[0])) * case.size


def _sizes(scene: Scene, place: str) -> tuple[float, float]:
    """Return what takes 0.2 % to 40 % of the largest torque at speed."""
    full = scene.torque(place) / scene.speed(place)
    return 2e-3 * full, 0.4 * full


def _enter(robot: Robot, case: Case) -> None:
    robot.laws.append(lambda: _brake(robot, case))


def _brake(robot: Robot, case: Case) -> Law:
    half = _half(case)

    def act(moment: Moment) -> None:
        dof = dof_of(robot, moment.model, case.place)
        if moment.time < 0.0:  # settling has dampers of its own
            return
        usual = float(moment.usual_damping[dof])
        moment.model.dof_damping[dof] = usual + (half if moment.data.qvel[dof] > 0.0 else -half)

    return act


HIDDEN = Hidden(
    name="asymmetric_friction",
    way="another damper for each direction, not a torque",
    places=every_joint,
    sizes=_sizes,
    values=lambda case: {"half_difference": (_half(case), "N m s/rad")},
    enter=_enter,
)
