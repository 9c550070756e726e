"""A joint's transmission gives: drive, rotor, friction and encoder are before its spring."""

from shared.sim.hidden.effect import Case, Hidden, Scene, every_joint
from shared.sim.hidden.robot import Law, Moment, Robot
from shared.sim.hidden.series import add_series, series_dof, series_qpos

_LOSS = 1.5e-3
"""Damping per stiffness (s)."""


def _sizes(scene: Scene, place: str) -> tuple[float, float]:
    """Return what gives by 1 mrad to 60 mrad under the largest torque."""
    return 1e-3 / scene.torque(place), 0.06 / scene.torque(place)


def _enter(robot: Robot, case: Case) -> None:
    add_series(robot, case.place)
    robot.laws.append(lambda: _spring(case.place, 1.0 / case.size))
    robot.trust_encoders()


def _spring(place: str, stiffness: float) -> Law:
    def act(moment: Moment) -> None:
        model, data = moment.model, moment.data
        dof, qpos = series_dof(model, place), series_qpos(model, place)
        model.dof_damping[dof] = _LOSS * stiffness
        data.qfrc_applied[dof] -= stiffness * float(data.qpos[qpos])

    return act


HIDDEN = Hidden(
    name="joint_elasticity",
    way="a spring as a torque, with another damping; a pose controller that knows encoders only",
    places=every_joint,
    sizes=_sizes,
    values=lambda case: {"compliance": (case.size, "rad/(N m)")},
    enter=_enter,
)
