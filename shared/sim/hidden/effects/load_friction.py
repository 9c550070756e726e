"""A gear's friction grows with the load on it: as bristles."""

from shared.sim.hidden.bristles import Bristles
from shared.sim.hidden.effect import Case, Hidden, dof_of, every_joint
from shared.sim.hidden.robot import Law, Moment, Robot


def _enter(robot: Robot, case: Case) -> None:
    robot.laws.append(lambda: _rub(robot, case))


def _rub(robot: Robot, case: Case) -> Law:
    bristles = Bristles()
    joint = case.scene.joints.index(case.place)

    def act(moment: Moment) -> None:
        dof = dof_of(robot, moment.model, case.place)
        level = case.size * abs(float(moment.drive[joint]))
        speed = float(moment.data.qvel[dof])
        moment.data.qfrc_applied[dof] += bristles.torque(level, speed, moment.timestep)

    return act


HIDDEN = Hidden(
    name="load_friction",
    way="bristles, not a constraint",
    places=every_joint,
    sizes=lambda scene, place: (5e-3, 0.4),
    values=lambda case: {"share": (case.size, "1")},
    enter=_enter,
)
